//! The estimator as a whole, where no channel is needed: its memory, and inputs that no channel delivers.

use std::mem::size_of;

use cslam_core::paths::{Estimator, EstimatorConfig, PaperEstimator, PathEstimator, TapDelays};
use cslam_core::signal::{BeamBlock, Iq};

type Block = [[Iq; 512]; 32];
type Best = Estimator<4, 8, 32, 72, 3, 8, 8, 360, 9>;
type Paper = PaperEstimator<4, 8, 32, 72, 9>;

#[test]
fn memory_is_bounded() {
    let (best, paper, block) = (size_of::<Best>(), size_of::<Paper>(), size_of::<Block>());
    println!("estimator state: best {best} B, paper {paper} B, one beam block {block} B");
    assert!(best + block <= 300 * 1024, "best mode: {} B", best + block);
    assert!(paper + block <= 300 * 1024, "paper mode: {} B", paper + block);
}

fn estimators() -> [(&'static str, Box<dyn PathEstimator<32, 9>>); 3] {
    let config = EstimatorConfig::single_sweeps();
    [
        ("best", Box::new(Best::new(&config))),
        ("paper", Box::new(Paper::new(&config))),
        (
            "paper-interpolated",
            Box::new(Paper::new(&config).with_delays(TapDelays::Interpolated)),
        ),
    ]
}

/// Blocks that no channel delivers.
fn hostile() -> Vec<(&'static str, Box<Block>)> {
    let mut state = 1_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        Iq::from_word((state >> 32) as u32)
    };
    let mut all: Vec<(&'static str, Box<Block>)> = Vec::new();
    let mut add = |name, f: &mut dyn FnMut(usize, usize) -> Iq| {
        let mut block: Box<Block> = Box::new([[Iq::ZERO; 512]; 32]);
        for (c, channel) in block.iter_mut().enumerate() {
            for (n, x) in channel.iter_mut().enumerate() {
                *x = f(c, n);
            }
        }
        all.push((name, block));
    };
    add("silence", &mut |_, _| Iq::ZERO);
    add("full scale", &mut |_, _| Iq::new(i16::MAX, i16::MAX));
    add("negative full scale", &mut |_, _| Iq::new(i16::MIN, i16::MIN));
    add("alternating", &mut |_, n| {
        if n % 2 == 0 {
            Iq::new(i16::MAX, i16::MIN)
        } else {
            Iq::new(i16::MIN, i16::MAX)
        }
    });
    add("impulse", &mut |_, n| {
        if n == 17 { Iq::new(i16::MAX, 0) } else { Iq::ZERO }
    });
    add("one channel", &mut |c, n| {
        if c == 5 {
            Iq::new((n * 64) as i16, -7)
        } else {
            Iq::ZERO
        }
    });
    add("random words", &mut |_, _| random());
    add("least bits", &mut |c, n| Iq::new(((c + n) % 2) as i16, 0));
    all
}

#[test]
fn hostile_blocks_are_survived() {
    for (mode, mut estimator) in estimators() {
        for (name, block) in hostile() {
            for (beam, exponent) in [(0, 0), (71, -40), (72, 0), (u16::MAX, 20)] {
                let mut samples = block.clone();
                estimator.push_beam(BeamBlock {
                    samples: &mut samples,
                    beam,
                    exponent,
                });
            }
            for path in estimator.finish() {
                let p = &path.path;
                assert!(
                    (0.0..=625.0).contains(&p.c_tau_m)
                        && p.covariance.iter().all(|c| c.is_finite())
                        && path.snr_db.is_finite(),
                    "{mode}, {name}: {path:?}"
                );
            }
        }
        assert!(
            estimator.finish().is_empty(),
            "{mode}: a finished sweep leaves nothing behind"
        );
    }
}

//! The samples of today's budget, kept as check sums: what is new is off by default and changes no bit.

use super::probe::one_path;
use super::*;

/// FNV-1a over beams, exponents and samples.
fn sum(sweep: &Sweep) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut eat = |word: u32| {
        for byte in word.to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    };
    for block in &sweep.blocks {
        eat(block.beam.into());
        eat(block.exponent as u32);
        block.samples.iter().flatten().for_each(|iq| eat(iq.word()));
    }
    hash
}

/// Beams and squint symbols of two paths with motion and a drifting clock.
fn sums(config: ChannelConfig) -> [u64; 3] {
    let simulator = Simulator::new(config, 7);
    let mut link = one_path(43.2, [1.3, 0.7], [1.5, 0.1]);
    link.paths.extend(one_path(61.7, [2.0, -2.1], [1.4, 2.3]).paths);
    let instant = Instant {
        velocity_m_per_s: nalgebra::Vector3::new(3.0, -2.0, 0.5),
        clock_offset_s: 3e-9,
        clock_drift: 4e-7,
        ..Instant::at_rest()
    };
    let squint = |scheme| {
        simulator
            .squint(&link, &instant, 5, scheme)
            .expect("complete paths")
    };
    [
        sum(&simulator.sweep(&link, &instant, 5).expect("complete paths")),
        sum(&squint(SquintScheme::Sequential)),
        sum(&squint(SquintScheme::Raster)),
    ]
}

#[test]
fn the_samples_of_the_budget_are_the_same_bits() {
    assert_eq!(
        sums(ChannelConfig::default()),
        [381152133251600420, 12266239572877202686, 16682985871423125535]
    );
}

#[test]
fn the_samples_with_the_older_impairments_are_the_same_bits() {
    let config = ChannelConfig {
        impairments: Impairments {
            cfo_hz: 12e3,
            dropped_beams: vec![3],
            dead_channels: vec![9],
            jammer: Some(Jammer {
                kind: JammerKind::Pulsed,
                ..Jammer::tone(-75.0)
            }),
            ..Impairments::budget()
        },
        ..ChannelConfig::default()
    };
    assert_eq!(
        sums(config),
        [1537588091402283994, 14559737010211324462, 16094980118742142560]
    );
}

//! The recorded sweeps: scenes at several SNRs through the channel and the front end, and captures that no gain control
//! delivers.

use cslam_checks::sweep::{BLOCK, END_OF_SWEEP, header};
use cslam_core::signal::Iq;
use cslam_host_sim::channel::{Block, Impairments, Jammer, Sweep};

use crate::recorder::Recorder;

/// Beams of the shorter sweeps: one face, and some beams of the others.
const SOME: std::ops::Range<u16> = 0..30;

/// Sweeps one after another, each with its name and how many paths it must show at least.
#[derive(Default)]
pub(crate) struct Recording {
    pub(crate) bytes: Vec<u8>,
    pub(crate) names: Vec<(String, usize)>,
}

impl Recording {
    fn add(&mut self, name: &str, least: usize, sweep: &Sweep) {
        for block in sweep.clone().strongest_first() {
            self.bytes.extend(header(BLOCK, block.beam, block.exponent));
            let words = block.samples.iter().flatten().map(|x| x.word());
            self.bytes.extend(words.flat_map(u32::to_le_bytes));
        }
        self.bytes.extend(header(END_OF_SWEEP, 0, 0));
        self.names.push((name.to_owned(), least));
    }
}

fn some_beams(impairments: Impairments) -> Impairments {
    Impairments {
        dropped_beams: (0..72).filter(|beam| !SOME.contains(beam)).collect(),
        ..impairments
    }
}

/// One short sweep.
pub(crate) fn few() -> Recording {
    let mut recording = Recording::default();
    let mut recorder = Recorder::new(some_beams(Impairments::budget()), 4);
    let rays = recorder.nine(20.0);
    recording.add("nine paths", 1, &recorder.sweep(&rays, 0));
    recording
}

/// The golden sweeps.
pub(crate) fn all() -> Recording {
    let mut recording = Recording::default();
    whole_sweeps(&mut recording);
    short_sweeps(&mut recording);
    extremes(&mut recording);
    recording
}

/// Sweeps whose cost is counted: nine paths at 0, 10, 20, 30 dB in all beams, with calibrated arrays, then with the error
/// budget's.
pub(crate) fn nine_paths() -> Recording {
    let mut recording = Recording::default();
    let calibrated = Impairments {
        free_array_phase: true,
        ..Impairments::none()
    };
    for impairments in [calibrated, Impairments::budget()] {
        let mut recorder = Recorder::new(impairments, 9);
        for (index, snr_db) in (0..).zip([0.0, 10.0, 20.0, 30.0]) {
            let rays = recorder.nine(snr_db);
            let name = format!("nine paths, {snr_db} dB");
            recording.add(&name, 5, &recorder.sweep(&rays, index));
        }
    }
    recording
}

/// All beams.
fn whole_sweeps(recording: &mut Recording) {
    let mut recorder = Recorder::new(Impairments::budget(), 1);
    for (index, snr_db) in (0..).zip([-10.0, 0.0, 10.0, 20.0, 30.0, 40.0]) {
        let rays = recorder.nine(snr_db);
        recording.add(
            &format!("nine paths, {snr_db} dB"),
            1,
            &recorder.sweep(&rays, index),
        );
    }
    recording.add("noise", 0, &recorder.sweep(&[], 100));
}

/// Thirty beams.
fn short_sweeps(recording: &mut Recording) {
    let mut recorder = Recorder::new(some_beams(Impairments::budget()), 2);
    for (index, snr_db) in (0..).zip([-20.0, -10.0, 0.0, 10.0, 20.0, 30.0, 40.0]) {
        let rays = [recorder.ray(snr_db)];
        recording.add(
            &format!("one path, {snr_db} dB"),
            0,
            &recorder.sweep(&rays, index),
        );
    }
    // Pairs that only a joint fit tells apart, and a triple.
    for (index, apart_m) in (10..).zip([0.3, 0.8, 2.0]) {
        let first = recorder.ray(25.0);
        let late = apart_m / cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
        let follow = |by: f64| cslam_host_sim::channel::Ray {
            delay_s: first.delay_s + by * late,
            amplitude: first.amplitude * cslam_core::array::phasor(by),
            ..first
        };
        let rays = [first, follow(1.0), follow(2.5)];
        let count = if apart_m < 1.0 { 2 } else { 3 };
        recording.add(
            &format!("{count} paths {apart_m} m apart"),
            1,
            &recorder.sweep(&rays[..count], index),
        );
    }
    let jammer = Jammer {
        offset_hz: 30e6,
        zenith_deg: 80.0,
        azimuth_deg: 20.0,
        ..Jammer::tone(-70.0)
    };
    let mut jammed = Recorder::new(
        some_beams(Impairments {
            jammer: Some(jammer),
            dead_channels: vec![3, 17],
            dropped_beam_probability: 0.2,
            ..Impairments::budget()
        }),
        3,
    );
    let rays = jammed.nine(20.0);
    recording.add(
        "jammed, two dead channels, lost beams",
        0,
        &jammed.sweep(&rays, 0),
    );
}

/// Not from the channel: gain control that failed, and words that no converter gives.
fn extremes(recording: &mut Recording) {
    let mut recorder = Recorder::new(some_beams(Impairments::budget()), 6);
    let rays = recorder.nine(30.0);
    let shifted = |sweep: &Sweep, bits: i32| Sweep {
        blocks: sweep.blocks.iter().map(|block| scaled(block, bits)).collect(),
    };
    let sweep = recorder.sweep(&rays, 0);
    recording.add("clipped by 18 dB", 1, &shifted(&sweep, 3));
    recording.add("18 dB under the gain control's level", 1, &shifted(&sweep, -3));
    let mut state = 1_u64;
    let mut noise = Sweep::default();
    for beam in 0..4 {
        let mut block = Block::zero(beam, -40);
        for x in block.samples.iter_mut().flatten() {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            *x = match beam {
                0 => Iq::from_word((state >> 32) as u32),
                1 => Iq::new(i16::MAX, i16::MIN),
                2 => Iq::ZERO,
                _ => Iq::new((state >> 63) as i16, 0),
            };
        }
        noise.blocks.push(block);
    }
    recording.add("random words, full scale, silence, least bits", 0, &noise);
}

/// The block with its samples (not its exponent) scaled by 2^bits, clipped to int16.
fn scaled(block: &Block, bits: i32) -> Block {
    let part = |x: i16| {
        let wide = if bits > 0 {
            i32::from(x) << bits
        } else {
            i32::from(x) >> -bits
        };
        wide.clamp(i32::from(i16::MIN), i32::from(i16::MAX)) as i16
    };
    let mut out = block.clone();
    for x in out.samples.iter_mut().flatten() {
        *x = Iq::new(part(x.re()), part(x.im()));
    }
    out
}

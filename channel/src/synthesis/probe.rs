//! What tests measure on a block: a matched filter in `f64`, apart from the receiver's own.

use cslam_core::signal::{SAMPLES, Waveform};

use super::antenna::phasor;
use super::spectrum::Transform;
use super::{Block, C64, ChannelConfig, FrontEndConfig, Impairments, MotionConfig, Sweep};
use crate::paths::Link;

/// Delay and amplitude of the strongest path of a channel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    pub(super) delay_s: f64,
    /// sqrt(W), per active subcarrier of unit amplitude times sqrt(active): the wave's amplitude.
    pub(super) amplitude: C64,
}

/// Impairments alone: no noise, and a converter of 16 bits.
pub(super) fn noiseless(impairments: Impairments) -> ChannelConfig {
    ChannelConfig {
        front_end: FrontEndConfig {
            noise: false,
            adc_bits: 16,
            ..FrontEndConfig::default()
        },
        impairments,
        motion: MotionConfig::default(),
    }
}

/// Channel response on the active subcarriers, in amplitude units of the block.
pub(super) fn response(block: &Block, channel: usize) -> Vec<C64> {
    let waveform = Waveform::default();
    let scale = libm::ldexp(1.0, block.exponent) * (waveform.active as f64).sqrt() / SAMPLES as f64;
    let mut x: [C64; SAMPLES] = std::array::from_fn(|n| {
        let iq = block.samples[channel][n];
        C64::new(f64::from(iq.re()), f64::from(iq.im())) * scale
    });
    Transform::new().forward(&mut x);
    (0..waveform.active)
        .map(|i| x[waveform.bin(i)] * waveform.symbol::<f64>(i).conj())
        .collect()
}

fn correlate(h: &[C64], delay_s: f64) -> C64 {
    let waveform = Waveform::default();
    let turns = delay_s * waveform.spacing_hz();
    let (step, mut phase) = (
        phasor(std::f64::consts::TAU * turns),
        phasor(std::f64::consts::TAU * turns * f64::from(waveform.offset(0))),
    );
    let mut sum = C64::new(0.0, 0.0);
    for h in h {
        sum += h * phase;
        phase *= step;
    }
    sum / h.len() as f64
}

/// Delay that maximises the correlation, by a grid of half samples and golden sections.
pub(super) fn fit(h: &[C64]) -> Fit {
    let sample_s = 1.0 / Waveform::default().sample_rate_hz;
    let power = |delay_s: f64| correlate(h, delay_s).norm_sqr();
    let best = (0..2 * SAMPLES)
        .map(|n| (n, power(n as f64 * 0.5 * sample_s)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map_or(0, |(n, _)| n);
    let (mut low, mut high) = (
        (best as f64 - 1.0) * 0.5 * sample_s,
        (best as f64 + 1.0) * 0.5 * sample_s,
    );
    let golden = 0.618_033_988_749_895;
    for _ in 0..48 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if power(a) > power(b) {
            high = b;
        } else {
            low = a;
        }
    }
    let delay_s = 0.5 * (low + high);
    Fit {
        delay_s,
        amplitude: correlate(h, delay_s),
    }
}

/// Fits of all channels of a block.
pub(super) fn fits(block: &Block) -> Vec<Fit> {
    (0..32).map(|c| fit(&response(block, c))).collect()
}

pub(super) fn block(sweep: &Sweep, beam: u16) -> &Block {
    sweep
        .blocks
        .iter()
        .find(|b| b.beam == beam)
        .expect("beam in sweep")
}

/// A link of one path: length, arrival and departure angles, gain of the free space between the format's dipoles.
pub(super) fn one_path(length_m: f64, arrival: [f64; 2], departure: [f64; 2]) -> Link {
    let dipole = |zenith: f64| {
        libm::sqrt(1.643) * libm::cos(std::f64::consts::FRAC_PI_2 * libm::cos(zenith)) / libm::sin(zenith)
    };
    let wavelength_m = 299_792_458.0 / 30e9;
    let free_space = wavelength_m / (4.0 * std::f64::consts::PI * length_m);
    let path = serde_json::json!({
        "delay_s": length_m / 299_792_458.0,
        "aoa_zenith_rad": arrival[0],
        "aoa_azimuth_rad": arrival[1],
        "aod_zenith_rad": departure[0],
        "aod_azimuth_rad": departure[1],
        "gain": [free_space * dipole(arrival[0]) * dipole(departure[0]), 0.0],
    });
    let link = serde_json::json!({"tx": [0.0, 0.0, 0.0], "rx": [length_m, 0.0, 0.0], "paths": [path]});
    serde_json::from_value(link).expect("a link")
}

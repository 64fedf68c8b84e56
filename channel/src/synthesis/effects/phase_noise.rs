//! Phase noise of a local oscillator after the model of 3GPP TR 38.803 for 29.55 GHz: white noise through a filter.
//!
//! The model is `S(f) = 32 dB prod(1 + (f/fz)^az) / prod(1 + (f/fp)^ap)` with powers that are no integers. The filter has
//! four poles and four zeros that follow it within 0.7 dB from 8 kHz to half of the sample rate. What is slower stands
//! still over a block: it is part of the oscillator's free phase and of the carrier offset.

use cslam_core::signal::SAMPLES;

use crate::synthesis::noise::Gaussian;

/// Deviation of the driving noise, rad.
const DRIVE_RAD: f32 = 0.011_897_095;
/// Sections of the filter: `(1 + n1 z^-1 + n2 z^-2) / (1 + d1 z^-1 + d2 z^-2)` as [n1, n2, d1, d2].
const SECTIONS: [[f64; 4]; 3] = [
    [-0.998_379_350, 0.0, -0.999_629_762, 0.0],
    [0.222_019_433, 0.0, -0.933_743_328, 0.0],
    [-1.989_606_774, 0.989_759_666, -1.982_563_298, 0.982_741_671],
];
/// Samples of a beam's slot: the waveform is sent twice, and the second one is kept.
const SLOT: usize = 2 * SAMPLES;

/// One oscillator.
#[derive(Clone, Debug, Default)]
struct Filter {
    state: [[f64; 2]; SECTIONS.len()],
}

impl Filter {
    /// Phase at the next sample, rad.
    fn next(&mut self, drive: f64) -> f64 {
        let mut x = drive;
        for (state, [n1, n2, d1, d2]) in self.state.iter_mut().zip(SECTIONS) {
            let y = x + state[0];
            state[0] = n1 * x - d1 * y + state[1];
            state[1] = n2 * x - d2 * y;
            x = y;
        }
        x
    }
}

/// Phase of an oscillator over a block, rad: a stream of its own, at rest before the block's first repetition.
pub(crate) fn block(gaussian: &mut Gaussian, seed: u64, stream: u64) -> [f64; SAMPLES] {
    let mut drive = [0.0_f32; SLOT];
    gaussian.restart(seed, stream);
    gaussian.add_to(&mut drive, DRIVE_RAD);
    let mut filter = Filter::default();
    let (before, kept) = drive.split_at(SLOT - SAMPLES);
    for x in before {
        filter.next(f64::from(*x));
    }
    let mut out = [0.0; SAMPLES];
    for (out, x) in out.iter_mut().zip(kept) {
        *out = filter.next(f64::from(*x));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthesis::C64;
    use crate::synthesis::antenna::phasor;

    const RATE_HZ: f64 = 245.76e6;

    /// The model, rad^2/Hz of one side.
    fn model(f_hz: f64) -> f64 {
        let factor = |(corner_hz, power): (f64, f64)| 1.0 + libm::pow(f_hz / corner_hz, power);
        let zeros = [(3e3, 2.37), (550e3, 2.7), (280e6, 2.53)].map(factor);
        let poles = [(1.0, 3.3), (1.6e6, 3.3), (30e6, 1.0)].map(factor);
        libm::exp10(3.2) * zeros.iter().product::<f64>() / poles.iter().product::<f64>()
    }

    /// Power in bands between the frequencies, of a million samples; Hann windows of 2^k samples, half overlapping.
    fn band_powers(phase: &[f64], size: usize, edges_hz: &[f64]) -> Vec<f64> {
        let mut powers = vec![0.0; edges_hz.len() - 1];
        let mut count = 0.0;
        for segment in phase.windows(size).step_by(size / 2) {
            let hann = |n: usize| 1.0 - libm::cos(std::f64::consts::TAU * (n as f64 + 0.5) / size as f64);
            let mut x: Vec<C64> = segment
                .iter()
                .enumerate()
                .map(|(n, p)| C64::new(p * hann(n), 0.0))
                .collect();
            transform(&mut x);
            count += 1.0;
            let bin_hz = RATE_HZ / size as f64;
            for (k, x) in x.iter().take(size / 2).enumerate() {
                let band = edges_hz.partition_point(|edge| *edge <= k as f64 * bin_hz);
                if (1..edges_hz.len()).contains(&band) {
                    // The window's mean square is 3/2.
                    powers[band - 1] += x.norm_sqr() / (1.5 * size as f64 * RATE_HZ) * bin_hz;
                }
            }
        }
        powers.iter().map(|p| p / count).collect()
    }

    fn transform(x: &mut [C64]) {
        if x.len() == 1 {
            return;
        }
        let (mut even, mut odd): (Vec<C64>, Vec<C64>) = x.chunks(2).map(|c| (c[0], c[1])).unzip();
        transform(&mut even);
        transform(&mut odd);
        let half = x.len() / 2;
        for k in 0..half {
            let t = odd[k] * phasor(-std::f64::consts::TAU * k as f64 / x.len() as f64);
            (x[k], x[k + half]) = (even[k] + t, even[k] - t);
        }
    }

    #[test]
    fn the_spectrum_of_a_million_samples_is_the_model_within_a_decibel() {
        let mut gaussian = Gaussian::new();
        gaussian.restart(5, 1);
        let mut drive = vec![0.0_f32; 1 << 20];
        gaussian.add_to(&mut drive, DRIVE_RAD);
        let mut filter = Filter::default();
        let phase: Vec<f64> = drive.iter().map(|x| filter.next(f64::from(*x))).collect();
        // Two bands a decade; long windows for the low ones, many short ones for the high ones.
        for (size, edges_hz) in [
            (1 << 16, vec![1e4, 3.16e4, 1e5, 3.16e5, 1e6]),
            (1 << 11, vec![1e6, 3.16e6, 1e7, 3.16e7, 1e8]),
        ] {
            let bin_hz = RATE_HZ / size as f64;
            let bins = |low: f64, high: f64| {
                let inside = (0..size / 2)
                    .map(|k| k as f64 * bin_hz)
                    .filter(move |f| (low..high).contains(f));
                inside.map(model).sum::<f64>() * bin_hz
            };
            for (power, edges) in band_powers(&phase, size, &edges_hz)
                .iter()
                .zip(edges_hz.windows(2))
            {
                let off_db = 10.0 * libm::log10(power / bins(edges[0], edges[1]));
                assert!(off_db.abs() < 1.0, "{edges:?}: {off_db} dB");
            }
        }
        // The figures of the model.
        for (f_hz, db) in [(1e4, -87.4), (1e5, -96.9), (1e6, -99.4), (1e7, -109.0)] {
            assert!((10.0 * libm::log10(model(f_hz)) - db).abs() < 0.05);
        }
    }

    #[test]
    fn blocks_repeat_and_differ_by_stream() {
        let mut gaussian = Gaussian::new();
        let mut of = |stream| block(&mut gaussian, 9, stream);
        assert_eq!(of(4), of(4));
        assert_ne!(of(4), of(5));
        let rms = (of(6).iter().map(|p| p * p).sum::<f64>() / SAMPLES as f64).sqrt();
        assert!((0.01..0.2).contains(&rms), "{rms}");
    }
}

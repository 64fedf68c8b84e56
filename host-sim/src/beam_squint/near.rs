//! Trials of near-field range: a long row of elements sweeps its focus from 5 to 100 m at the UAV's azimuth.

use cslam_core::array::{GmtArrays, UavArrays, phasor};
use cslam_core::beam_squint::near_field::{Focus, FocusSweep, Range, RangeSquint};
use cslam_core::beam_squint::{Refusal, Sighting};
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{Direction, Vector3};
use cslam_core::signal::{Correlator, Waveform, Workspace};
use nalgebra::{Complex, Matrix2, Vector2};
use rayon::prelude::*;

use crate::channel::{ChannelConfig, Impairments, Instant, Ray, Simulator};
use crate::random::Stream;
use crate::statistics::rms;

/// Ends of the sweep, m.
const SWEEP_M: [f64; 2] = [5.0, 100.0];
/// Offset of the UAV clock: 40 ns, 12 m. Range must not notice.
const CLOCK_S: f64 = 40e-9;

/// Figures of a row: rms range errors, m.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct NearRow {
    /// Elements of the row.
    pub elements: usize,
    /// Distance, m.
    pub distance_m: f64,
    /// Trials.
    pub trials: usize,
    /// Cramer-Rao bound, gain and clock unknown, m.
    pub bound_m: f64,
    /// Maximum likelihood, m.
    pub fit_m: f64,
    /// Rms of the errors of maximum likelihood, each over its bound.
    pub fit_over_bound: f64,
    /// Peak subcarrier, m.
    pub pick_m: f64,
    /// Trials in which the fit refused.
    pub refused: usize,
}

/// Field of the sweep in double precision, straight from the definition.
fn field<const N: usize>(
    sweep: &FocusSweep<N>,
    spacing_m: f64,
    range_m: f64,
    sine: f64,
) -> Vec<Complex<f64>> {
    let waveform = Waveform::default();
    let mut sum = vec![Complex::new(0.0, 0.0); waveform.active];
    for n in 0..N {
        let y = (n as f64 - (N as f64 - 1.0) / 2.0) * spacing_m;
        let way_m = (range_m * range_m + y * y - 2.0 * range_m * y * sine).sqrt() - range_m;
        let (delay_s, phase) = sweep.weight(n);
        for (index, sum) in sum.iter_mut().enumerate() {
            let f_hz = waveform.carrier_hz + f64::from(waveform.offset(index)) * waveform.spacing_hz();
            let turns = f_hz * (delay_s - way_m / SPEED_OF_LIGHT_M_PER_S);
            *sum += phasor(std::f64::consts::TAU * (turns - turns.floor()) + phase);
        }
    }
    let scale = (N as f64).sqrt().recip();
    sum.iter().map(|z| z * scale).collect()
}

/// Standard deviation of the range, m, by the numerical Fisher matrix over range and delay with the gain eliminated.
/// `snr`: per active subcarrier, all receive elements, behind a transmit pattern of gain one.
fn bound_m<const N: usize>(sweep: &FocusSweep<N>, spacing_m: f64, range_m: f64, sine: f64, snr: f64) -> f64 {
    let waveform = Waveform::default();
    let step = 1e-4 * range_m;
    let mean = field(sweep, spacing_m, range_m, sine);
    let (ahead, behind) = (
        field(sweep, spacing_m, range_m + step, sine),
        field(sweep, spacing_m, range_m - step, sine),
    );
    let columns = |index: usize| {
        let per_m = std::f64::consts::TAU * waveform.spacing_hz() / SPEED_OF_LIGHT_M_PER_S;
        let turn = Complex::new(0.0, -per_m * f64::from(waveform.offset(index)));
        [(ahead[index] - behind[index]) / (2.0 * step), mean[index] * turn]
    };
    let inner = |f: &dyn Fn(usize) -> Complex<f64>| (0..waveform.active).map(f).sum::<Complex<f64>>();
    let power = inner(&|k| mean[k].conj() * mean[k]).re;
    let along = Vector2::from_fn(|a, _| inner(&|k| mean[k].conj() * columns(k)[a]));
    let fisher = Matrix2::from_fn(|a, b| {
        let product = inner(&|k| columns(k)[a].conj() * columns(k)[b]);
        2.0 * snr * (product - along[a].conj() * along[b] / power).re
    });
    fisher.try_inverse().map_or(f64::NAN, |i| i.m11.sqrt())
}

/// Runs the trials of a row: range error of fit and pick over the bound.
pub fn near<const N: usize>(distance_m: f64, trials: usize, seed: u64) -> NearRow {
    let all: Vec<(f64, Option<f64>, Option<f64>)> = (0..trials as u32)
        .into_par_iter()
        .map(|index| trial::<N>(distance_m, seed, index))
        .collect();
    let root = |values: Vec<f64>| rms(&values).unwrap_or(f64::NAN);
    NearRow {
        elements: N,
        distance_m,
        trials,
        bound_m: root(all.iter().map(|t| t.0).collect()),
        fit_m: root(all.iter().filter_map(|t| t.1).collect()),
        fit_over_bound: root(all.iter().filter_map(|t| Some(t.1? / t.0)).collect()),
        pick_m: root(all.iter().filter_map(|t| t.2).collect()),
        refused: all.iter().filter(|t| t.1.is_none()).count(),
    }
}

fn trial<const N: usize>(distance_m: f64, seed: u64, index: u32) -> (f64, Option<f64>, Option<f64>) {
    let mut stream = Stream::new(seed, u64::from(index));
    let waveform = Waveform::default();
    let wavelength_m = SPEED_OF_LIGHT_M_PER_S / waveform.carrier_hz;
    let spacing_m = 0.5 * wavelength_m;
    let sine = stream.uniform() - 0.5;
    let edge_hz = |k: usize| waveform.carrier_hz + f64::from(waveform.offset(k)) * waveform.spacing_hz();
    let focus = |range_m| Focus { range_m, sine };
    let edges = [edge_hz(0), edge_hz(waveform.active - 1)];
    let sweep = FocusSweep::<N>::new(spacing_m, focus(SWEEP_M[0]), focus(SWEEP_M[1]), edges).expect("sound");
    let impairments = Impairments {
        free_array_phase: true,
        clock_offset_s: CLOCK_S,
        ..Impairments::none()
    };
    let config = ChannelConfig {
        impairments,
        ..ChannelConfig::default()
    };
    let simulator = Simulator::new(config, seed ^ (u64::from(index) << 20));
    let yaw = std::f64::consts::TAU * stream.uniform();
    let ray = Ray {
        amplitude: phasor(yaw) * (wavelength_m / (4.0 * std::f64::consts::PI * distance_m)),
        across: Complex::ZERO,
        delay_s: distance_m / SPEED_OF_LIGHT_M_PER_S,
        arrival: Direction::from_vector(Vector3::new(libm::cos(yaw), libm::sin(yaw), -0.1)).expect("unit"),
        departure: Direction::from_vector(Vector3::new((1.0 - sine * sine).sqrt(), sine, 0.0)).expect("unit"),
        doppler_hz: 0.0,
    };
    let gmt = GmtArrays::<f64>::default();
    let element = gmt.amplitude(&gmt.faces()[0], &ray.departure);
    let amplitude = ray.amplitude.norm() * simulator.signal_amplitude() * element;
    let gains: f64 = UavArrays::<f64>::default()
        .amplitude(&ray.arrival)
        .iter()
        .map(|g| 8.0 * g * g)
        .sum();
    let snr = amplitude * amplitude * 512.0 / waveform.active as f64 / simulator.noise_power_w() * gains;
    let bound = bound_m(&sweep, spacing_m, distance_m, sine, snr);
    let pattern: Vec<_> = field(&sweep, spacing_m, distance_m, sine)
        .iter()
        .map(|z| z * element)
        .collect();
    let mut heard = simulator.shaped_rays(&[ray], &Instant::at_rest(), index, 0..1, |_, rays| {
        vec![pattern.clone(); rays.len()]
    });
    let mut squint = RangeSquint::<N>::new(sweep, UavArrays::default(), &waveform).expect("416 subcarriers");
    // Path estimation knows delay and arrival this well.
    let tilt = |stream: &mut Stream| 3e-4 * stream.normal();
    let arrival =
        ray.arrival.vector() + Vector3::new(tilt(&mut stream), tilt(&mut stream), tilt(&mut stream));
    let sighting = Sighting {
        line_of_sight: true,
        face: 0,
        aoa: Direction::from_vector(arrival.map(|c| c as f32)).expect("unit"),
        c_tau_m: (distance_m + SPEED_OF_LIGHT_M_PER_S * CLOCK_S + 0.05 * stream.normal()) as f32,
        interferers: Default::default(),
        expected: None,
        ground: None,
    };
    squint.begin(&sighting).expect("line of sight");
    for block in &mut heard.blocks {
        squint.push(block.view(), &Correlator::new(&waveform), &mut Workspace::new());
    }
    let off = |range: Result<Range, Refusal>| range.ok().map(|r| (f64::from(r.range_m) - distance_m).abs());
    (bound, off(squint.fit(sine as f32)), off(squint.pick(sine as f32)))
}

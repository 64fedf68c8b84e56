//! What a radio hears, from docs/signal-model.md and from no code of the receiver.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI, TAU};

use cslam_core::signal::{BeamBlock, Iq, SAMPLES};
use cslam_host_sim::random::Stream;
use nalgebra::{Complex, Vector3};

pub(crate) type C64 = Complex<f64>;

pub(crate) const SPEED_OF_LIGHT_M_PER_S: f64 = 299_792_458.0;
const SUBCARRIER_HZ: f64 = 480e3;
const ACTIVE: usize = 416;

/// `exp(j 2 pi turns)`.
pub(crate) fn polar(turns: f64) -> C64 {
    C64::from_polar(1.0, TAU * turns.fract())
}

/// Subcarrier of an index, counted from the carrier.
fn subcarrier(index: usize) -> f64 {
    index as f64 - (ACTIVE / 2) as f64
}

/// A row of elements half a wavelength apart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    pub(crate) normal: Vector3<f64>,
    pub(crate) axis: Vector3<f64>,
    pub(crate) centre_m: Vector3<f64>,
}

/// A radio: its carrier, the root of its waveform and its receive elements.
#[derive(Clone, Debug)]
pub(crate) struct Signal {
    pub(crate) carrier_hz: f64,
    pub(crate) root: f64,
    pub(crate) rows: Vec<Row>,
    /// Elements of a row.
    pub(crate) elements: usize,
    /// From row to row, half a wavelength, where all have one oscillator.
    pub(crate) column: Option<Vector3<f64>>,
    /// Attenuation of an element from its side to its rear, dB.
    pub(crate) rear_db: f64,
}

/// Four tilted rows around the body.
pub(crate) fn tilted_rows() -> Vec<Row> {
    let tilt_rad = FRAC_1_SQRT_2.atan();
    let row = |j: u8| {
        let azimuth_rad = FRAC_PI_2 * f64::from(j);
        let normal = Vector3::new(azimuth_rad.cos(), azimuth_rad.sin(), 0.0);
        let tangent = Vector3::new(-normal.y, normal.x, 0.0);
        Row {
            normal,
            axis: tangent * tilt_rad.cos() + Vector3::z() * tilt_rad.sin(),
            centre_m: normal * 0.2,
        }
    };
    (0..4).map(row).collect()
}

/// Eight rows along y, on a face that looks along x.
pub(crate) fn planar_rows() -> Vec<Row> {
    let row = Row {
        normal: Vector3::x(),
        axis: Vector3::y(),
        centre_m: Vector3::x() * 0.2,
    };
    vec![row; 8]
}

/// Amplitude of a half-wave dipole.
pub(crate) fn dipole(u: &Vector3<f64>) -> f64 {
    1.643_f64.sqrt() * (FRAC_PI_2 * u.z).cos() / (1.0 - u.z * u.z).sqrt()
}

/// Amplitude of a receive element on a face.
fn receive_amplitude(u: &Vector3<f64>, normal: &Vector3<f64>, rear_db: f64) -> f64 {
    let off = u.dot(normal).clamp(-1.0, 1.0).acos() / FRAC_PI_2;
    let attenuation_db = if off <= 1.0 {
        6.0 * off * off
    } else {
        6.0 + rear_db * (off - 1.0)
    };
    dipole(u) * 2_f64.sqrt() * 10_f64.powf(-attenuation_db / 20.0)
}

/// A wave as it comes in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wave {
    /// Towards where it came from, body axes.
    pub(crate) from: Vector3<f64>,
    pub(crate) c_tau_m: f64,
}

impl Signal {
    /// A wave at each row, its phase at the oscillator of each free: `amplitude` of a subcarrier by its index, of an isotropic receive element.
    pub(crate) fn waves(
        &self,
        wave: &Wave,
        phase_turns: &[f64],
        amplitude: impl Fn(usize) -> f64,
    ) -> Vec<[C64; SAMPLES]> {
        let at_row = |(row, phase): (&Row, &f64)| {
            let delay_s = (wave.c_tau_m - row.centre_m.dot(&wave.from)) / SPEED_OF_LIGHT_M_PER_S;
            let gain = polar(phase - self.carrier_hz * delay_s)
                * receive_amplitude(&wave.from, &row.normal, self.rear_db);
            let mut samples = [C64::new(0.0, 0.0); SAMPLES];
            for index in 0..ACTIVE {
                let n = (index % 409) as f64;
                let k = subcarrier(index);
                let symbol = polar(-self.root * n * (n + 1.0) / 818.0 - k * SUBCARRIER_HZ * delay_s);
                let (mut turned, step) = (symbol * gain * amplitude(index), polar(k / SAMPLES as f64));
                for sample in &mut samples {
                    *sample += turned;
                    turned *= step;
                }
            }
            samples
        };
        self.rows.iter().zip(phase_turns).map(at_row).collect()
    }

    /// A phase for the oscillator of each row.
    pub(crate) fn phases(&self, stream: &mut Stream) -> Vec<f64> {
        let common = self.column.map(|_| stream.uniform());
        let phase = |_: &Row| common.unwrap_or_else(|| stream.uniform());
        self.rows.iter().map(phase).collect()
    }

    /// Channels of what comes in, in noise of this variance a sample: waves at each row, each with a factor.
    pub(crate) fn channels(
        &self,
        heard: &[(&Wave, &Vec<[C64; SAMPLES]>, f64)],
        noise: f64,
        stream: &mut Stream,
    ) -> Vec<[C64; SAMPLES]> {
        let mut channels = Vec::new();
        let sigma = (0.5 * noise).sqrt();
        for (j, row) in self.rows.iter().enumerate() {
            for i in 0..self.elements {
                let place = i as f64 - (self.elements as f64 - 1.0) / 2.0;
                let mut channel = [C64::new(0.0, 0.0); SAMPLES];
                for sample in &mut channel {
                    *sample = C64::new(stream.normal(), stream.normal()) * sigma;
                }
                for (wave, at_rows, factor) in heard {
                    let row_place = j as f64 - (self.rows.len() as f64 - 1.0) / 2.0;
                    let across = self
                        .column
                        .map_or(0.0, |column| row_place * column.dot(&wave.from));
                    let along = place * row.axis.dot(&wave.from);
                    let steering = polar(0.5 * (along + across)) * *factor;
                    for (sample, wave) in channel.iter_mut().zip(&at_rows[j]) {
                        *sample += wave * steering;
                    }
                }
                channels.push(channel);
            }
        }
        channels
    }
}

/// Samples of `C` channels as a front end takes them, the strongest channel 12 dB under full scale, with their exponent.
pub(crate) struct Captured<const C: usize> {
    samples: Box<[[Iq; SAMPLES]; C]>,
    exponent: i32,
}

impl<const C: usize> Captured<C> {
    pub(crate) fn of(channels: &[[C64; SAMPLES]]) -> Self {
        let power = |channel: &[C64; SAMPLES]| channel.iter().map(|x| x.norm_sqr()).sum::<f64>();
        let strongest = channels.iter().map(power).fold(0.0, f64::max);
        let rms = (strongest / SAMPLES as f64).sqrt();
        let exponent = (4.0 * rms / 32768.0).log2().ceil() as i32;
        let whole = |x: f64| (x * f64::from(-exponent).exp2()).round().clamp(-32768.0, 32767.0) as i16;
        let mut samples: Box<[[Iq; SAMPLES]; C]> = vec![[Iq::ZERO; SAMPLES]; C]
            .try_into()
            .expect("made of so many channels");
        for (row, channel) in samples.iter_mut().zip(channels) {
            for (iq, x) in row.iter_mut().zip(channel) {
                *iq = Iq::new(whole(x.re), whole(x.im));
            }
        }
        Self { samples, exponent }
    }

    pub(crate) fn block(&mut self, beam: u16) -> BeamBlock<'_, C> {
        BeamBlock {
            samples: &mut self.samples,
            beam,
            exponent: self.exponent,
        }
    }
}

/// Outward normal of a face of the GMT, and along its row.
fn face_axes(face: usize) -> [Vector3<f64>; 2] {
    let azimuth_rad = TAU * face as f64 / 3.0;
    let normal = Vector3::new(azimuth_rad.cos(), azimuth_rad.sin(), 0.0);
    [normal, Vector3::new(-normal.y, normal.x, 0.0)]
}

/// Sum of eight elements whose phase grows by `step_rad`: real, for they lie about the middle.
fn row_of_eight(step_rad: f64) -> f64 {
    (0..8).map(|n| ((f64::from(n) - 3.5) * step_rad).cos()).sum()
}

fn transmit_amplitude(face: usize, u: &Vector3<f64>) -> f64 {
    let ahead = u.dot(&face_axes(face)[0]);
    let pattern = if ahead < 0.0 { 0.05 } else { ahead.max(0.05).sqrt() };
    dipole(u) * pattern
}

/// Field of a transmit beam towards `u`: eight azimuths and these elevations a face.
pub(crate) fn beam_field(beam: usize, elevations_deg: &[f64], u: &Vector3<f64>) -> f64 {
    let (face, within) = (
        beam / (8 * elevations_deg.len()),
        beam % (8 * elevations_deg.len()),
    );
    let (k, e) = (within / elevations_deg.len(), within % elevations_deg.len());
    let [_, tangent] = face_axes(face);
    let elevation_rad = elevations_deg[e].to_radians();
    let across = 60_f64.to_radians().sin() * (k as f64 - 3.5) / 4.0 * elevation_rad.cos();
    let [x, z] = [tangent.dot(u) - across, u.z - elevation_rad.sin()];
    row_of_eight(PI * x) * row_of_eight(PI * z) / 8.0 * transmit_amplitude(face, u)
}

/// Field of a squint symbol of a face towards `u` at a subcarrier: three sweeps along the row, then eight up the column.
pub(crate) fn squint_field(
    face: usize,
    symbol: usize,
    carrier_hz: f64,
    index: usize,
    u: &Vector3<f64>,
) -> f64 {
    let [low_hz, high_hz] = [0, ACTIVE - 1].map(|index| subcarrier(index) * SUBCARRIER_HZ);
    let swept = |first: f64, last: f64| {
        let start = first * (1.0 + low_hz / carrier_hz);
        let delay_s = (last * (1.0 + high_hz / carrier_hz) - start) / (2.0 * (high_hz - low_hz));
        (start - 2.0 * delay_s * low_hz, delay_s)
    };
    let (x, z) = match symbol {
        0..3 => (swept(-0.87, 0.87), ([0.05, 0.28, 0.51][symbol], 0.0)),
        _ => {
            let azimuth = 60_f64.to_radians().sin() * (symbol as f64 - 3.0 - 3.5) / 4.0;
            ((azimuth, 0.0), swept(-0.10, 0.75))
        }
    };
    let f_hz = subcarrier(index) * SUBCARRIER_HZ;
    let step_rad = |s: f64, (psi, delay_s): (f64, f64)| {
        PI * (s * (1.0 + f_hz / carrier_hz) - psi) - TAU * f_hz * delay_s
    };
    let [_, tangent] = face_axes(face);
    row_of_eight(step_rad(tangent.dot(u), x)) * row_of_eight(step_rad(u.z, z)) / 8.0
        * transmit_amplitude(face, u)
}

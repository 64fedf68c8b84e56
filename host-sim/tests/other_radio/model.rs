//! The signal model of docs/signal-model.md, written for this radio alone and by no code of the receiver or of the simulation.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, TAU};

use cslam_core::profile::quad_4x16_gmt_48::{ACTIVE, ELEMENTS};
use cslam_core::signal::SAMPLES;
use nalgebra::{Complex, Vector3};

pub(crate) type C64 = Complex<f64>;

pub(crate) const CARRIER_HZ: f64 = 28e9;
pub(crate) const SPEED_OF_LIGHT_M_PER_S: f64 = 299_792_458.0;
const SUBCARRIER_HZ: f64 = 480e3;

pub(crate) fn polar(turns: f64) -> C64 {
    C64::from_polar(1.0, TAU * turns.fract())
}

/// Normal and horizontal tangent of a face that looks at an azimuth.
fn face(azimuth_rad: f64) -> [Vector3<f64>; 2] {
    let normal = Vector3::new(azimuth_rad.cos(), azimuth_rad.sin(), 0.0);
    [normal, Vector3::new(-normal.y, normal.x, 0.0)]
}

/// Outward normal, axis and centre of a receive array.
fn array(j: usize) -> [Vector3<f64>; 3] {
    let [normal, tangent] = face(FRAC_PI_2 * j as f64);
    let tilt_rad = FRAC_1_SQRT_2.atan();
    let axis = tangent * tilt_rad.cos() + Vector3::z() * tilt_rad.sin();
    [normal, axis, normal * 0.2]
}

/// Delay of a wave from `u` at a receive array, s, when it has come `length_m` at the body's origin.
pub(crate) fn delay_s(j: usize, length_m: f64, u: &Vector3<f64>) -> f64 {
    let [_, _, centre_m] = array(j);
    (length_m - centre_m.dot(u)) / SPEED_OF_LIGHT_M_PER_S
}

fn dipole(u: &Vector3<f64>) -> f64 {
    1.643_f64.sqrt() * (FRAC_PI_2 * u.z).cos() / (1.0 - u.z * u.z).sqrt()
}

/// Amplitude of an element on a face of the UAV.
fn amplitude(u: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
    let off = u.dot(normal).acos() / FRAC_PI_2;
    let attenuation_db = if off <= 1.0 {
        6.0 * off * off
    } else {
        6.0 + 12.0 * (off - 1.0)
    };
    dipole(u) * 2_f64.sqrt() * 10_f64.powf(-attenuation_db / 20.0)
}

/// What the elements of a receive array hear of a path of so many metres from `u`, with a gain before the elements. The transform keeps
/// power: the gain is the amplitude of a subcarrier.
pub(crate) fn heard_by_array(
    j: usize,
    length_m: f64,
    u: &Vector3<f64>,
    gain: C64,
) -> [[C64; SAMPLES]; ELEMENTS] {
    let [normal, axis, _] = array(j);
    let delay_s = delay_s(j, length_m, u);
    let gain = gain * amplitude(u, &normal);
    let mut wave = [C64::new(0.0, 0.0); SAMPLES];
    for index in 0..ACTIVE {
        let n = (index % 409) as f64;
        let k = index as f64 - 208.0;
        let symbol = polar(-136.0 * n * (n + 1.0) / 818.0 - k * SUBCARRIER_HZ * delay_s) * gain
            / (SAMPLES as f64).sqrt();
        let (mut turned, step) = (symbol, polar(k / SAMPLES as f64));
        for sample in &mut wave {
            *sample += turned;
            turned *= step;
        }
    }
    std::array::from_fn(|i| {
        let place = i as f64 - (ELEMENTS as f64 - 1.0) / 2.0;
        let steering = polar(0.5 * place * axis.dot(u));
        wave.map(|wave| wave * steering)
    })
}

/// Field of a transmit beam towards `v`: beam 16 s + 2 k + e of face s, azimuth k of eight, elevation e of 0 and 14 degrees.
pub(crate) fn field(beam: usize, v: &Vector3<f64>) -> C64 {
    let (s, k, e) = (beam / 16, beam % 16 / 2, beam % 2);
    let [normal, tangent] = face(TAU * s as f64 / 3.0);
    let elevation_rad = (14.0 * e as f64).to_radians();
    let sine = 60_f64.to_radians().sin() * (k as f64 - 3.5) / 4.0;
    let off = [
        tangent.dot(v) - sine * elevation_rad.cos(),
        v.z - elevation_rad.sin(),
    ];
    let row = |off: f64| -> C64 { (0..8).map(|n| polar(0.5 * (f64::from(n) - 3.5) * off)).sum() };
    let cosine = normal.dot(v);
    let aperture = if cosine < 0.0 {
        0.05
    } else {
        cosine.max(0.05).sqrt()
    };
    row(off[0]) * row(off[1]) / 8.0 * (dipole(v) * aperture)
}

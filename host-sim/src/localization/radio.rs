//! What a receiver measures of a traced path, without its samples: truth and the errors of both ends' arrays.
//!
//! The errors are those of docs/localization.md, "The model", each from its physical cause: element phases of the UAV's arrays act
//! as one slope per array, tilted axes and array delays add to it; element errors of a GMT face act as a constant bias of
//! its direction cosines and a smooth rest; multipath is white. An angle of arrival is made by the same least-squares
//! combination of the arrays that a receiver performs.

use core::f64::consts::{PI, TAU};

use cslam_core::array::{GmtArrays, UavArrays};
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{Body, Direction};
use cslam_core::localization::filter::{FaceDirection, PathMeasurement};
use nalgebra::{Rotation3, Vector3};

use crate::seeded::{Seeded, Source};

const DEG: f64 = PI / 180.0;

/// Noise of a strong path as the receiver knows it, beside the errors of [`RadioErrors`]: delay m, angle of arrival deg per axis,
/// cosine of departure.
const NOISE: (f64, f64, f64) = (0.005, 0.01, 0.1e-3);

/// Errors of the radio measurements: the budget of design section 6 by default.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadioErrors {
    /// Phase error of the UAV's elements, deg rms.
    pub element_phase_deg: f64,
    /// Axis error of the UAV's arrays, deg per component.
    pub axis_deg: f64,
    /// Delay between the UAV's arrays, ps rms.
    pub array_delay_ps: f64,
    /// Constant bias of a GMT face's cosines along row and column.
    pub face_bias: [f64; 2],
    /// Smooth rest of that over the face.
    pub face_smooth: [f64; 2],
    /// White error of the direction cosines.
    pub departure_white: f64,
    /// White errors of the angle of arrival, deg per axis: multipath, noise.
    pub aoa_white_deg: [f64; 2],
    /// White error of the delay, m.
    pub delay_white_m: f64,
}

impl Default for RadioErrors {
    fn default() -> Self {
        Self {
            element_phase_deg: 2.0,
            axis_deg: 0.1,
            array_delay_ps: 50.0,
            face_bias: [1.5e-3; 2],
            face_smooth: [0.33e-3, 0.19e-3],
            departure_white: 0.9e-3,
            aoa_white_deg: [0.05, 0.02],
            delay_white_m: 0.02,
        }
    }
}

/// The arrays of both ends as they were built, hidden from the receiver.
#[derive(Clone, Debug)]
pub struct Hardware {
    errors: RadioErrors,
    arrays: UavArrays<f64>,
    faces: GmtArrays<f64>,
    slope: [f64; 4],
    tilt_rad: [[f64; 2]; 4],
    delay_m: [f64; 4],
    face_bias: [[f64; 2]; 3],
    /// Wave vector and phase of each face's smooth rest, per cosine.
    ripple: [[[f64; 3]; 2]; 3],
}

impl Hardware {
    /// The hardware of the world of `seed`.
    pub fn new(errors: RadioErrors, seed: u64) -> Self {
        let mut random = Seeded::new(seed, Source::RadioCalibration);
        let mut slope = [0.0; 4];
        for slope in &mut slope {
            // A linear fit over the eight elements: sum n_i eps_i / (pi sum n_i^2), with sum n_i^2 = 42.
            *slope = (0..8)
                .map(|i| (f64::from(i) - 3.5) * random.normal() * errors.element_phase_deg * DEG)
                .sum::<f64>()
                / (42.0 * PI);
        }
        let tilt_rad =
            core::array::from_fn(|_| core::array::from_fn(|_| random.normal() * errors.axis_deg * DEG));
        let delay_m = core::array::from_fn(|_| {
            random.normal() * errors.array_delay_ps * 1e-12 * SPEED_OF_LIGHT_M_PER_S
        });
        let face_bias =
            core::array::from_fn(|_| core::array::from_fn(|k| random.normal() * errors.face_bias[k]));
        let ripple = core::array::from_fn(|_| {
            core::array::from_fn(|_| {
                // Eight elements at half a wavelength resolve a quarter in cosine: half a wave over it at most.
                let (size, turn) = (random.between(3.0, 8.0), random.between(0.0, TAU));
                [
                    size * libm::cos(turn),
                    size * libm::sin(turn),
                    random.between(0.0, TAU),
                ]
            })
        });
        Self {
            errors,
            arrays: UavArrays::default(),
            faces: GmtArrays::default(),
            slope,
            tilt_rad,
            delay_m,
            face_bias,
            ripple,
        }
    }

    /// Measures a path of `length_m` that arrives from `arrival` (world, from the UAV) and left towards `departure`
    /// (world, from the GMT).
    pub fn measure(
        &self,
        link: &Ends,
        length_m: f64,
        arrival: &Vector3<f64>,
        departure: &Vector3<f64>,
        random: &mut Seeded,
    ) -> Option<PathMeasurement> {
        let errors = &self.errors;
        let u = Direction::<Body, f64>::from_vector(link.attitude.inverse() * arrival).ok()?;
        let (e1, e2) = u.tangents();
        let gains = self.arrays.amplitude(&u).map(|a| a * a);
        let (mut h, mut b) = (nalgebra::Matrix2::zeros(), nalgebra::Vector2::zeros());
        let (mut delay, mut total) = (0.0, 0.0);
        for (j, array) in self.arrays.arrays().iter().enumerate() {
            let dw = nalgebra::Vector2::new(array.axis.dot(&e1), array.axis.dot(&e2));
            let side = array.axis.cross(&array.normal);
            let wrong = self.slope[j]
                + array.normal.dot(u.vector()) * self.tilt_rad[j][0]
                + side.dot(u.vector()) * self.tilt_rad[j][1];
            h += dw * dw.transpose() * gains[j];
            b += dw * (gains[j] * wrong);
            delay += gains[j] * self.delay_m[j];
            total += gains[j];
        }
        let shift = h.try_inverse()? * b;
        let (delay_noise_m, aoa_noise_deg, departure_noise) = NOISE;
        // What a measurement claims, it errs by.
        let white = libm::hypot(
            libm::hypot(errors.aoa_white_deg[0], errors.aoa_white_deg[1]),
            aoa_noise_deg,
        ) * DEG;
        let delay_white_m = libm::hypot(errors.delay_white_m, delay_noise_m);
        let departure_white = libm::hypot(errors.departure_white, departure_noise);
        let seen =
            u.vector() + e1 * (shift.x + random.normal() * white) + e2 * (shift.y + random.normal() * white);
        let c_tau_m = length_m + link.clock_offset_m + delay / total + random.normal() * delay_white_m;
        let local = link.gmt_attitude.inverse() * departure;
        let face = (0..3).max_by(|&a, &b| {
            let along = |s: usize| self.faces.faces()[s].normal.dot(&local);
            along(a).total_cmp(&along(b))
        })?;
        let truth = [self.faces.faces()[face].tangent.dot(&local), local.z];
        let cosines = core::array::from_fn(|k| {
            let [kx, kz, phase] = self.ripple[face][k];
            let smooth = core::f64::consts::SQRT_2
                * errors.face_smooth[k]
                * libm::sin(kx * truth[0] + kz * truth[1] + phase);
            truth[k] + self.face_bias[face][k] + smooth + random.normal() * departure_white
        });
        Some(PathMeasurement {
            c_tau_m,
            c_tau_sigma_m: delay_noise_m,
            aoa: Direction::from_vector(seen).ok()?,
            aoa_sigma_rad: aoa_noise_deg * DEG,
            aoa_rise_sigma_rad: 0.0,
            departure: Some(FaceDirection {
                face,
                cosines,
                sigma: [departure_noise; 2],
            }),
        })
    }
}

/// Both ends of a link as far as a measurement depends on them.
#[derive(Clone, Copy, Debug)]
pub struct Ends {
    /// Attitude R_wb of the UAV.
    pub attitude: Rotation3<f64>,
    /// True attitude of the GMT's mast.
    pub gmt_attitude: Rotation3<f64>,
    /// UAV clock less GMT clock, m.
    pub clock_offset_m: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_measurement_errs_by_what_it_claims() {
        let perfect = RadioErrors {
            element_phase_deg: 0.0,
            axis_deg: 0.0,
            array_delay_ps: 0.0,
            face_bias: [0.0; 2],
            face_smooth: [0.0; 2],
            departure_white: 0.0,
            aoa_white_deg: [0.0; 2],
            delay_white_m: 0.0,
        };
        let (hardware, mut random) = (Hardware::new(perfect, 1), Seeded::new(1, Source::RadioNoise));
        let ends = Ends {
            attitude: Rotation3::identity(),
            gmt_attitude: Rotation3::identity(),
            clock_offset_m: 0.0,
        };
        let arrival = Vector3::new(-0.8, 0.6, 0.0);
        let mut squares = [0.0; 3];
        for _ in 0..4000 {
            let path = hardware
                .measure(&ends, 50.0, &arrival, &-arrival, &mut random)
                .expect("a direction");
            let departure = path.departure.expect("measured");
            let off = [
                (path.c_tau_m - 50.0) / path.c_tau_sigma_m,
                (path.aoa.vector() - arrival).norm() / path.aoa_sigma_rad / core::f64::consts::SQRT_2,
                departure.cosines[1] / departure.sigma[1],
            ];
            for (sum, off) in squares.iter_mut().zip(off) {
                *sum += off * off / 4000.0;
            }
        }
        for square in squares {
            assert!((square - 1.0).abs() < 0.1, "{squares:?}");
        }
    }
}

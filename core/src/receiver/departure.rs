//! Which way a path left the GMT: what the sweep's beams tell of it and what beam squint tells, as one.
//!
//! Both are short of the same thing, the errors of the arrays' elements, and each has a failing of its own: beams may take a sidelobe for
//! the path, and a symbol of beam squint hears all paths of its subcarrier. So the line of sight is listened to where the beams
//! leave its direction open, and where both tell one, each is weighed by its variance. Where they differ more than they claim, the mean is
//! as unsure as they differ (R. T. Birge, *The calculation of errors by the method of least squares*, Physical Review 40, 1932); where
//! they contradict each other, beam squint is taken, which has no sidelobes, and is as unsure.

use super::config::Departures;
use super::paths::MeasuredPath;
use crate::array::GmtArrays;
use crate::beam_squint::Bearing;
use crate::estimator::{FaceDirection, Transmitter};
use crate::geometry::{Direction, Gmt, World};
use crate::receiver::{Radio, Receiver};

/// Up to this standard deviation along a tangent beams need no help of beam squint, rad.
/// Measured: of 6297 lines of sight in 51 flights of `real` (tuning seeds), those whose beams claim so much err by 3.1 mrad (half) and
/// 8.6 (nine of ten), their beam squint by 3.6 and 11; of the others 3.9 and 24, and 4.9 and 17.
const OPEN_RAD: f32 = 2.5e-3;
/// Chi-square of two cosines beyond which two directions contradict each other.
/// Derived: one honest pair in 400 is beyond.
const CONTRARY: f64 = 12.0;
/// A direction that is contradicted is at most this much wider than it claims.
/// Derived: five times 2 mrad is a twelfth of a beam; what is further off shows in the filter's gate.
const WIDEST: f64 = 5.0;

impl<R: Radio, const VOXELS: usize, const STATES: usize> Receiver<'_, R, VOXELS, STATES> {
    /// Whether beam squint is to listen to this line of sight.
    pub(super) fn listens(&self, line: &MeasuredPath) -> bool {
        match self.config.departures {
            Departures::Beams => false,
            Departures::SquintPick | Departures::SquintParabola => true,
            Departures::SquintFit => {
                let told = line.estimated.path.aod;
                told.is_none_or(|departure| departure.sigma_rad > OPEN_RAD)
            }
        }
    }

    /// The direction of departure, with what beam squint told where it listened. `rise_sigma`: standard deviation that the upper cosine has by
    /// the beams alone, beside what they claim; beam squint tells the ground's bounce apart.
    pub(super) fn departure(
        &self,
        measured: &MeasuredPath,
        squint: Option<FaceDirection>,
        gmt: &Transmitter,
        rise_sigma: f64,
    ) -> Option<FaceDirection> {
        let beams = |face| {
            let mut beams = self.beam_departure(measured, gmt, face)?;
            beams.sigma[1] = libm::hypot(beams.sigma[1], rise_sigma);
            Some(beams)
        };
        let Some(squint) = squint else {
            return beams(self.face(measured.estimated.beam));
        };
        if self.config.departures != Departures::SquintFit {
            return Some(squint);
        }
        Some(beams(squint.face).map_or(squint, |beams| together(&squint, &beams)))
    }

    /// The direction of departure by the sweep's beams, as this face has it.
    fn beam_departure(
        &self,
        measured: &MeasuredPath,
        gmt: &Transmitter,
        face: usize,
    ) -> Option<FaceDirection> {
        let departure = measured.estimated.path.aod?;
        let left = Direction::<World, f64>::from_vector(departure.direction.vector().map(f64::from)).ok()?;
        let left: Direction<Gmt, f64> = gmt.attitude.inverse().apply(left);
        let cosines = GmtArrays::<f64>::cosines(self.radio.model().faces.get(face)?, &left);
        Some(FaceDirection::of_angle(
            face,
            cosines,
            f64::from(departure.sigma_rad),
        ))
    }
}

/// A bearing as the localizer takes it.
pub(super) fn face_direction(bearing: &Bearing) -> FaceDirection {
    let sigma = |variance: f32| libm::sqrt(f64::from(variance.max(0.0)));
    FaceDirection {
        face: bearing.face,
        cosines: bearing.cosines.map(f64::from),
        sigma: [sigma(bearing.covariance.m11), sigma(bearing.covariance.m22)],
    }
}

/// Beam squint and beams, of the same face.
fn together(squint: &FaceDirection, beams: &FaceDirection) -> FaceDirection {
    let mut both = *squint;
    let mut chi2 = 0.0;
    for (((cosine, sigma), other), other_sigma) in both
        .cosines
        .iter_mut()
        .zip(&mut both.sigma)
        .zip(beams.cosines)
        .zip(beams.sigma)
    {
        let (variance, other_variance) = (*sigma * *sigma, other_sigma * other_sigma);
        let sum = variance + other_variance;
        if sum <= 0.0 {
            return *squint;
        }
        let apart = other - *cosine;
        chi2 += apart * apart / sum;
        *cosine += apart * variance / sum;
        *sigma = libm::sqrt(variance * other_variance / sum);
    }
    if chi2 > CONTRARY {
        both = *squint;
    }
    // As wide as two directions differ, two numbers.
    let wider = libm::sqrt(0.5 * chi2).clamp(1.0, WIDEST);
    both.sigma = both.sigma.map(|sigma| sigma * wider);
    both
}

#[cfg(test)]
mod tests {
    use super::*;

    fn direction(cosines: [f64; 2], sigma: f64) -> FaceDirection {
        FaceDirection {
            face: 1,
            cosines,
            sigma: [sigma; 2],
        }
    }

    #[test]
    fn two_that_agree_are_weighed_by_their_variances() {
        let both = together(&direction([0.1, 0.2], 0.001), &direction([0.1015, 0.2], 0.002));
        assert!((both.cosines[0] - 0.1003).abs() < 1e-9 && (both.cosines[1] - 0.2).abs() < 1e-12);
        let alone = 0.001 * 0.002 / libm::sqrt(0.001 * 0.001 + 0.002 * 0.002);
        assert!(both.sigma.iter().all(|sigma| (sigma - alone).abs() < 1e-9));
        assert_eq!(both.face, 1);
    }

    #[test]
    fn the_mean_of_two_that_differ_is_as_unsure_as_they_differ() {
        // Three standard deviations of the difference in one cosine: chi-square 9 of two numbers.
        let apart = 3.0 * libm::sqrt(2.0) * 0.002;
        let both = together(
            &direction([0.1, 0.2], 0.002),
            &direction([0.1 + apart, 0.2], 0.002),
        );
        assert!((both.cosines[0] - 0.1 - 0.5 * apart).abs() < 1e-9);
        let expected = 0.002 / libm::sqrt(2.0) * libm::sqrt(4.5);
        assert!((both.sigma[0] - expected).abs() < 1e-9);
    }

    #[test]
    fn beams_that_took_a_sidelobe_do_not_move_beam_squint_but_make_it_unsure() {
        let squint = direction([0.1, 0.2], 0.002);
        let both = together(&squint, &direction([0.1, 0.5], 0.002));
        assert_eq!(both.cosines, squint.cosines);
        assert!(both.sigma.iter().all(|sigma| (sigma - 0.01).abs() < 1e-12));
    }

    #[test]
    fn a_direction_without_an_error_is_not_divided_by() {
        let squint = direction([0.1, 0.2], 0.0);
        assert_eq!(together(&squint, &squint), squint);
    }
}

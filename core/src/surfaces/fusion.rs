//! What a sighting tells of a plane when both err by the pose.
//!
//! Errors of the pose last for many sweeps: ten sightings from one wrong pose agree, and are as wrong as one. So the covariances of the plane and
//! of the sighting are split into what came from poses, of unknown correlation, and what is each one's own, and are fused by split covariance
//! intersection (S. Julier and J. Uhlmann, General decentralized data fusion with covariance intersection, 2001):
//!
//! ```text
//! P' = P_shared / w + P_own,  R' = R_shared / (1 - w) + R_own,  K = P' H' (H P' H' + R')^-1
//! ```
//! with the weight `w` that leaves the smallest determinant. Own errors average out, shared ones do not.

use crate::geometry::{Matrix3, Vector3};

/// Weights are looked for between this and one less this.
const LEAST_WEIGHT: f64 = 0.01;
/// Steps of the search: each leaves 0.618 of the interval, so the weight is known to 0.02.
const STEPS: usize = 8;
/// Golden section.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// A covariance and the part of it that poses share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Split {
    /// All of it.
    pub whole: Matrix3<f64>,
    /// The part from poses.
    pub shared: Matrix3<f64>,
}

/// What a fusion gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fused {
    /// Change of the plane: shift (m) and two tilts (rad).
    pub change: Vector3<f64>,
    /// Its covariance now.
    pub covariance: Split,
}

/// Fuses a plane with a sighting `z = H (plane's error) + noise` whose noise has the covariance `noise`. `None` when a matrix has no inverse.
#[must_use]
pub fn fuse(prior: &Split, h: &Matrix3<f64>, innovation: &Vector3<f64>, noise: &Split) -> Option<Fused> {
    let own = [prior.whole - prior.shared, noise.whole - noise.shared];
    let at = |weight: f64| Weighted::at(weight, prior, noise, &own, h);
    let (mut least, mut most) = (LEAST_WEIGHT, 1.0 - LEAST_WEIGHT);
    let inner = |least: f64, most: f64| [most - GOLDEN * (most - least), least + GOLDEN * (most - least)];
    let [mut a, mut b] = inner(least, most);
    let (mut of_a, mut of_b) = (at(a)?, at(b)?);
    for _ in 0..STEPS {
        if of_a.determinant < of_b.determinant {
            (most, b, of_b) = (b, a, of_a);
            [a, _] = inner(least, most);
            of_a = at(a)?;
        } else {
            (least, a, of_a) = (a, b, of_b);
            [_, b] = inner(least, most);
            of_b = at(b)?;
        }
    }
    let best = if of_a.determinant < of_b.determinant {
        of_a
    } else {
        of_b
    };
    let (gain, rest) = (best.gain, Matrix3::identity() - best.gain * h);
    let through = |prior: &Matrix3<f64>, noise: &Matrix3<f64>| {
        let sum = rest * prior * rest.transpose() + gain * noise * gain.transpose();
        (sum + sum.transpose()) * 0.5
    };
    let shared = through(&best.shared[0], &best.shared[1]);
    Some(Fused {
        change: gain * innovation,
        covariance: Split {
            whole: shared + through(&own[0], &own[1]),
            shared,
        },
    })
}

/// The fusion at one weight.
#[derive(Clone, Copy)]
struct Weighted {
    gain: Matrix3<f64>,
    /// What is shared, of plane and sighting, made larger.
    shared: [Matrix3<f64>; 2],
    determinant: f64,
}

impl Weighted {
    fn at(
        weight: f64,
        prior: &Split,
        noise: &Split,
        own: &[Matrix3<f64>; 2],
        h: &Matrix3<f64>,
    ) -> Option<Self> {
        let shared = [prior.shared / weight, noise.shared / (1.0 - weight)];
        let before = shared[0] + own[0];
        let spread = before * h.transpose();
        let gain = spread * (h * spread + shared[1] + own[1]).try_inverse()?;
        let after = before - gain * spread.transpose();
        Some(Self {
            gain,
            shared,
            determinant: after.determinant(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(shift_m: f64, tilt_rad: f64) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(
            shift_m * shift_m,
            tilt_rad * tilt_rad,
            tilt_rad * tilt_rad,
        ))
    }

    fn split(own: Matrix3<f64>, shared: Matrix3<f64>) -> Split {
        Split {
            whole: own + shared,
            shared,
        }
    }

    #[test]
    fn own_errors_average_out_as_in_a_kalman_filter() {
        let mut now = split(plane(0.3, 0.02), Matrix3::zeros());
        let noise = split(plane(0.1, 0.01), Matrix3::zeros());
        for _ in 0..20 {
            now = fuse(&now, &Matrix3::identity(), &Vector3::zeros(), &noise)
                .expect("regular")
                .covariance;
        }
        let expected = 1.0 / (1.0 / 0.09 + 20.0 / 0.01);
        assert!((now.whole.m11 / expected - 1.0).abs() < 1e-9 && now.shared.norm() == 0.0);
    }

    #[test]
    fn an_error_that_all_sightings_share_stays_in_the_covariance() {
        // The pose is off by 30 mm and 5 mrad, as it says, and the same each time; each path by 50 mm and 4 mrad of its own.
        let off = Vector3::new(0.03, 0.005, -0.005);
        let noise = split(plane(0.05, 0.004), plane(0.03, 0.005));
        let (mut now, mut at) = (split(plane(0.3, 0.02), Matrix3::zeros()), Vector3::zeros());
        for k in 0..200 {
            let of_path = if k % 2 == 0 { 1.0 } else { -1.0 } * Vector3::new(0.05, 0.004, -0.004);
            let fused = fuse(&now, &Matrix3::identity(), &(off + of_path - at), &noise).expect("regular");
            (at, now) = (at + fused.change, fused.covariance);
        }
        assert!((at - off).norm() < 0.01, "{at}");
        let normalised = at.dot(&(now.whole.try_inverse().expect("regular") * at));
        assert!(normalised < 9.0, "chi-square of 3: {normalised}");
        assert!(now.whole.m22 > 0.9 * 0.005 * 0.005 && now.whole.m22 < 1.3 * 0.005 * 0.005);
    }

    #[test]
    fn a_plane_from_a_poor_pose_gives_way_to_a_good_one() {
        let poor = split(plane(0.05, 0.003), plane(0.1, 0.03));
        let good = split(plane(0.05, 0.003), plane(0.03, 0.002));
        let (mut now, mut at) = (split(Matrix3::zeros(), plane(0.3, 0.05)), Vector3::zeros());
        for (noise, truth) in [(&poor, 0.04), (&good, 0.0)] {
            for _ in 0..30 {
                let innovation = Vector3::new(0.0, truth, 0.0) - at;
                let fused = fuse(&now, &Matrix3::identity(), &innovation, noise).expect("regular");
                (at, now) = (at + fused.change, fused.covariance);
            }
        }
        assert!(at.y.abs() < 0.004, "thirty agreeing wrong sightings: {at}");
    }

    #[test]
    fn a_row_that_sees_nothing_of_the_plane_tells_nothing() {
        let prior = split(plane(0.1, 0.01), plane(0.02, 0.002));
        let noise = split(plane(0.05, 0.004), plane(0.03, 0.005));
        let fused = fuse(&prior, &Matrix3::zeros(), &Vector3::new(1.0, 1.0, 1.0), &noise);
        let fused = fused.expect("regular");
        assert!(fused.change.norm() == 0.0 && fused.covariance.whole.m11 <= 1.02 * prior.whole.m11);
        let flat = split(Matrix3::zeros(), Matrix3::zeros());
        assert_eq!(fuse(&flat, &Matrix3::zeros(), &Vector3::zeros(), &flat), None);
    }
}

//! The UAV's own body before its arrays: arms and legs shade four sectors below, and every wave reaches each array a
//! second time, off the far side of the body.

use cslam_core::geometry::{Body, Direction};
use nalgebra::Vector3;

use crate::synthesis::Ray;

/// Azimuth between the arms, and of the first one, deg.
const ARM_STEP_DEG: f64 = 90.0;
const FIRST_ARM_DEG: f64 = 45.0;
/// Half the width of a shadow, deg.
const HALF_WIDTH_DEG: f64 = 6.0;
/// The shadow begins this far below the horizon and is full 10 deg further down.
const BELOW_DEG: f64 = 10.0;
const ONSET_DEG: f64 = 10.0;
/// Depth, dB.
const DEPTH_DB: f64 = 8.0;
/// The copy off the body: level, dB, and detour, m.
const COPY_DB: f64 = -22.0;
const DETOUR_M: f64 = 0.15;

/// Amplitude that arms and legs leave of a wave from `u`.
pub(crate) fn shadow(u: &Vector3<f64>) -> f64 {
    let azimuth_deg = libm::atan2(u.y, u.x).to_degrees();
    let arms = (azimuth_deg - FIRST_ARM_DEG) / ARM_STEP_DEG;
    let off_deg = (arms - libm::floor(arms + 0.5)).abs() * ARM_STEP_DEG;
    let down_deg = libm::asin((-u.z).clamp(-1.0, 1.0)).to_degrees();
    let depth =
        raised_cosine(off_deg / HALF_WIDTH_DEG) * raised_cosine(1.0 - (down_deg - BELOW_DEG) / ONSET_DEG);
    libm::exp10(-DEPTH_DB * depth / 20.0)
}

/// 1 at 0 and below, 0 at 1 and beyond, smooth in between.
fn raised_cosine(x: f64) -> f64 {
    0.5 + 0.5 * libm::cos(std::f64::consts::PI * x.clamp(0.0, 1.0))
}

/// The copies of rays that the body scatters, with the place of the ray: they come from the other side. Of rays more than
/// 20 dB under the strongest they would be more than 42 dB under it, and are left out.
pub(crate) fn copies(rays: &[Ray]) -> Vec<(usize, Ray)> {
    let power = |ray: &Ray| ray.amplitude.norm_sqr();
    let strongest = rays.iter().map(power).fold(0.0, f64::max);
    let copy = |(place, ray): (usize, &Ray)| {
        let u = ray.arrival.vector();
        let other_side = Vector3::new(-u.x, -u.y, u.z);
        let copy = Ray {
            amplitude: ray.amplitude * libm::exp10(COPY_DB / 20.0),
            delay_s: ray.delay_s + DETOUR_M / cslam_core::constants::SPEED_OF_LIGHT_M_PER_S,
            arrival: Direction::<Body, f64>::from_vector(other_side).ok()?,
            ..*ray
        };
        (power(ray) >= 0.01 * strongest).then_some((place, copy))
    };
    rays.iter().enumerate().filter_map(copy).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn towards(elevation_deg: f64, azimuth_deg: f64) -> Vector3<f64> {
        let (se, ce) = libm::sincos(elevation_deg.to_radians());
        let (sa, ca) = libm::sincos(azimuth_deg.to_radians());
        Vector3::new(ce * ca, ce * sa, se)
    }

    fn db(elevation_deg: f64, azimuth_deg: f64) -> f64 {
        20.0 * libm::log10(shadow(&towards(elevation_deg, azimuth_deg)))
    }

    #[test]
    fn arms_shade_four_sectors_below_by_8_db() {
        for arm in [45.0, 135.0, -135.0, -45.0] {
            assert!((db(-30.0, arm) + 8.0).abs() < 1e-9, "{}", db(-30.0, arm));
            assert!((db(-30.0, arm + 3.0) + 4.0).abs() < 1e-9);
            assert!((db(-30.0, arm - 3.0) + 4.0).abs() < 1e-9);
            assert!((db(-15.0, arm) + 4.0).abs() < 1e-9);
            for (elevation, azimuth) in [(-30.0, arm + 6.1), (-30.0, arm - 45.0), (-9.9, arm), (40.0, arm)] {
                assert!(db(elevation, azimuth).abs() < 1e-9, "{elevation} {azimuth}");
            }
        }
    }

    #[test]
    fn a_copy_comes_late_weak_and_from_the_other_side() {
        let ray = Ray {
            amplitude: crate::synthesis::C64::new(2e-5, 1e-5),
            across: crate::synthesis::C64::ZERO,
            delay_s: 1e-7,
            arrival: Direction::from_zenith_azimuth(1.7, 0.4).expect("angles"),
            departure: Direction::from_zenith_azimuth(1.5, 0.2).expect("angles"),
            doppler_hz: 120.0,
        };
        let weak = Ray {
            amplitude: ray.amplitude * 0.099,
            ..ray
        };
        let [(1, copy)] = copies(&[weak, ray])[..] else {
            panic!("one copy")
        };
        assert!((20.0 * libm::log10((copy.amplitude / ray.amplitude).norm()) + 22.0).abs() < 1e-9);
        assert!(((copy.delay_s - ray.delay_s) * 299_792_458.0 - 0.15).abs() < 1e-9);
        let expected = Direction::from_zenith_azimuth(1.7, 0.4 - std::f64::consts::PI).expect("angles");
        assert!(copy.arrival.angle_to_rad(&expected) < 1e-12);
        assert_eq!((copy.departure, copy.doppler_hz), (ray.departure, ray.doppler_hz));
    }
}

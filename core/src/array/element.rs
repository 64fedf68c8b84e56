//! Amplitude patterns of single antenna elements.

use crate::geometry::{Real, Vector3};

/// Amplitude of a half-wave dipole along z towards the unit vector `u`: `sqrt(1.643) cos(pi/2 cos th) / sin th`, 1.28
/// (2.15 dBi) in the horizontal plane, 0 along the axis. 1.643 is the customary figure; the exact directivity is 1.6409.
pub fn half_wave_dipole<T: Real>(u: &Vector3<T>) -> T {
    let sine = (u.x * u.x + u.y * u.y).sqrt();
    if sine < T::of(1e-6) {
        return T::zero();
    }
    // cos(pi/2 c) = sin(pi/2 (1 - |c|)), and 1 - |c| = s^2 / (1 + |c|): no cancellation near the axis.
    let from_axis = sine * sine / (T::one() + u.z.abs());
    let (numerator, _) = (T::frac_pi_2() * from_axis).sin_cos_libm();
    T::of(libm::sqrt(1.643)) * numerator / sine
}

/// Element of a UAV array: the dipole in front of a face that shades what is behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UavElement {
    /// Attenuation at 90 degrees off the face normal, dB; grows with the square of the angle up to there.
    pub side_attenuation_db: f64,
    /// Further attenuation between 90 and 180 degrees, dB; linear in the angle.
    pub rear_attenuation_db: f64,
    /// Power gain of the face in front, dB.
    pub front_gain_db: f64,
}

impl Default for UavElement {
    /// 6 dB aside, 18 dB behind; the front gain is a factor of two in power (sqrt(2) in amplitude).
    fn default() -> Self {
        Self {
            side_attenuation_db: 6.0,
            rear_attenuation_db: 12.0,
            front_gain_db: 10.0 * libm::log10(2.0),
        }
    }
}

impl UavElement {
    /// Amplitude towards the body-frame unit vector `u` of an element on the face with the given outward normal.
    pub fn amplitude<T: Real>(&self, u: &Vector3<T>, normal: &Vector3<T>) -> T {
        half_wave_dipole(u) * self.face_amplitude(u, normal)
    }

    /// The face's part of the amplitude, without the dipole.
    pub fn face_amplitude<T: Real>(&self, u: &Vector3<T>, normal: &Vector3<T>) -> T {
        // Angle off the normal in right angles, 0..2.
        let off = u.dot(normal).acos_libm() / T::frac_pi_2();
        let side = T::of(self.side_attenuation_db);
        let attenuation_db = if off <= T::one() {
            side * off * off
        } else {
            side + T::of(self.rear_attenuation_db) * (off - T::one())
        };
        ((T::of(self.front_gain_db) - attenuation_db) / T::of(20.0)).exp10_libm()
    }
}

/// Element of a GMT array: the dipole times the square root of the projected aperture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GmtElement {
    /// Least cosine of the angle off the face normal in front of the face.
    pub least_cosine: f64,
    /// Amplitude factor behind the face.
    pub rear_amplitude: f64,
}

impl Default for GmtElement {
    fn default() -> Self {
        Self {
            least_cosine: 0.05,
            rear_amplitude: 0.05,
        }
    }
}

impl GmtElement {
    /// Amplitude towards the GMT-frame unit vector `u` of an element on the face with the given outward normal.
    pub fn amplitude<T: Real>(&self, u: &Vector3<T>, normal: &Vector3<T>) -> T {
        half_wave_dipole(u) * self.face_amplitude(u, normal)
    }

    /// The face's part of the amplitude, without the dipole.
    pub fn face_amplitude<T: Real>(&self, u: &Vector3<T>, normal: &Vector3<T>) -> T {
        let cosine = u.dot(normal);
        if cosine < T::zero() {
            T::of(self.rear_amplitude)
        } else {
            cosine.max(T::of(self.least_cosine)).sqrt()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn towards(zenith_deg: f64, azimuth_deg: f64) -> Vector3<f64> {
        let (sz, cz) = zenith_deg.to_radians().sin_cos_libm();
        let (sa, ca) = azimuth_deg.to_radians().sin_cos_libm();
        Vector3::new(sz * ca, sz * sa, cz)
    }

    #[test]
    fn dipole_follows_its_formula_and_vanishes_on_its_axis() {
        for zenith_deg in [1.0, 20.0, 45.0, 90.0, 133.0, 179.0_f64] {
            let (sine, cosine) = zenith_deg.to_radians().sin_cos_libm();
            let (_, expected) = (core::f64::consts::FRAC_PI_2 * cosine).sin_cos_libm();
            let expected = libm::sqrt(1.643) * expected / sine;
            assert!((half_wave_dipole(&towards(zenith_deg, 40.0)) - expected).abs() < 1e-12);
        }
        assert_eq!(half_wave_dipole(&Vector3::<f64>::z()), 0.0);
        assert_eq!(half_wave_dipole(&-Vector3::<f32>::z()), 0.0);
        // Power averaged over the sphere: 1.643 over the exact directivity 4 / Cin(2 pi) = 1.64092.
        let steps = 20_000;
        let mean: f64 = (0..steps)
            .map(|i| {
                let z = (f64::from(i) + 0.5) * 2.0 / f64::from(steps) - 1.0;
                let a = half_wave_dipole(&Vector3::new((1.0 - z * z).sqrt(), 0.0, z));
                a * a / f64::from(steps)
            })
            .sum();
        assert!((mean - 1.643 / 1.640_92).abs() < 1e-5, "{mean}");
    }

    #[test]
    fn uav_face_shades_its_rear() {
        let element = UavElement::default();
        let db =
            |off_deg: f64| 20.0 * libm::log10(element.face_amplitude(&towards(90.0, off_deg), &Vector3::x()));
        assert!((db(0.0) - 3.0103).abs() < 1e-4);
        assert!((db(45.0) - (3.0103 - 1.5)).abs() < 1e-4);
        assert!((db(90.0) - (3.0103 - 6.0)).abs() < 1e-4);
        assert!((db(180.0) - (3.0103 - 18.0)).abs() < 1e-4);
    }

    #[test]
    fn gmt_face_follows_the_projected_aperture() {
        let element = GmtElement::default();
        let face = |off_deg: f64| element.face_amplitude(&towards(90.0, off_deg), &Vector3::x());
        assert!((face(60.0) - libm::sqrt(0.5)).abs() < 1e-12);
        assert!((face(89.0) - libm::sqrt(0.05)).abs() < 1e-12);
        assert!((face(91.0) - 0.05).abs() < 1e-12);
    }
}

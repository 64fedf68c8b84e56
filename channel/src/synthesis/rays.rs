//! From a link of the paths format to rays between isotropic, frame-fixed ends.

use std::fmt;

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{Body, Direction, Gmt, Rotation, Vector3, World};

use super::C64;
use super::antenna::element::half_wave_dipole;
use super::antenna::phasor;
use super::config::MotionConfig;
use crate::paths::{Link, LinkPath};

/// Attitude, motion and clock at the first beam of a sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instant {
    /// Time since both ends were switched on, s: what warms up or wanders depends on it.
    pub time_s: f64,
    /// Attitude of the UAV.
    pub attitude: Rotation<Body, World, f64>,
    /// Velocity of the UAV, m/s.
    pub velocity_m_per_s: Vector3<f64>,
    /// How fast the UAV turns, rad/s, body axes.
    pub turn_rad_per_s: Vector3<f64>,
    /// Attitude of the GMT.
    pub gmt_attitude: Rotation<Gmt, World, f64>,
    /// Velocity of the GMT, m/s.
    pub gmt_velocity_m_per_s: Vector3<f64>,
    /// Offset of the UAV's clock, s, on top of the one the impairments give.
    pub clock_offset_s: f64,
    /// Rate of that offset, s/s.
    pub clock_drift: f64,
}

impl Instant {
    /// Level, at rest, clocks aligned.
    pub fn at_rest() -> Self {
        Self {
            time_s: 0.0,
            attitude: Rotation::identity(),
            velocity_m_per_s: Vector3::zeros(),
            turn_rad_per_s: Vector3::zeros(),
            gmt_attitude: Rotation::identity(),
            gmt_velocity_m_per_s: Vector3::zeros(),
            clock_offset_s: 0.0,
            clock_drift: 0.0,
        }
    }

    /// As a checked configuration says; clocks aligned.
    ///
    /// # Errors
    /// What is no rotation.
    pub fn of(motion: &MotionConfig) -> Result<Self, cslam_core::geometry::GeometryError> {
        Ok(Self {
            attitude: Rotation::from_quaternion(motion.uav_quaternion_wb)?,
            velocity_m_per_s: motion.uav_velocity_m_per_s.into(),
            gmt_attitude: Rotation::from_yaw_pitch_roll(motion.gmt_heading_deg.to_radians(), 0.0, 0.0)?,
            gmt_velocity_m_per_s: motion.gmt_velocity_m_per_s.into(),
            ..Self::at_rest()
        })
    }
}

/// One propagation path as the two arrays see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Amplitude between isotropic ends (square root of the power ratio), polarisation match at the UAV's tilted dipoles
    /// and carrier phase included.
    pub amplitude: C64,
    /// Horizontal over vertical component of its field, in the axes of the UAV's tilted dipoles: what cross polarisation lets in.
    pub across: C64,
    /// Delay, s, without any clock offset.
    pub delay_s: f64,
    /// Where it comes from.
    pub arrival: Direction<Body, f64>,
    /// Where it leaves to.
    pub departure: Direction<Gmt, f64>,
    /// Frequency shift, Hz: growing when the ends approach along the path.
    pub doppler_hz: f64,
}

/// Why a path cannot be synthesised.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RayError {
    /// Place of the path in its link, from 0.
    pub path: usize,
    /// What is missing or wrong, and what was expected.
    pub message: String,
}

impl fmt::Display for RayError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "path {}: {}", self.path, self.message)
    }
}

impl std::error::Error for RayError {}

/// The format's dipoles are divided out; closer to their axis than this amplitude (0.1 degrees), where nothing is
/// radiated anyway, by this.
const LEAST_DIPOLE: f64 = 1.7e-3;

/// Longest delay of a path, s: 300 km.
const MAX_DELAY_S: f64 = 1e-3;
/// Greatest rate at which movers shorten or stretch a path, m/s.
const MAX_CLOSING_M_PER_S: f64 = 1000.0;
/// Greatest ratio of the components of a field.
const MAX_ACROSS: f64 = 10.0;
/// Greatest amplitude of a path.
const MAX_GAIN: f64 = 1.0;

/// The rays of a link at an instant.
///
/// # Errors
/// [`RayError`] when a path has no gain or no angle of departure, or a number in it is no valid one.
pub(super) fn rays(link: &Link, instant: &Instant, carrier_hz: f64) -> Result<Vec<Ray>, RayError> {
    let convert = |(path, p): (usize, &LinkPath)| {
        ray(p, instant, carrier_hz).map_err(|message| RayError { path, message })
    };
    link.paths.iter().enumerate().map(convert).collect()
}

fn ray(path: &LinkPath, instant: &Instant, carrier_hz: f64) -> Result<Ray, String> {
    let (gain, [zenith_rad, azimuth_rad]) = path.gain_and_departure()?;
    let departure = world(zenith_rad, azimuth_rad, "departure")?;
    let arrival = world(path.aoa_zenith_rad, path.aoa_azimuth_rad, "arrival")?;
    if !(0.0..=MAX_DELAY_S).contains(&path.delay_s) {
        return Err(format!(
            "`delay_s` is {}, expected 0 to {MAX_DELAY_S}",
            path.delay_s
        ));
    }
    for (key, component) in [("gain", Some(gain)), ("cross_gain", path.cross_gain)] {
        let magnitude = component.map_or(0.0, |[re, im]| libm::hypot(re, im));
        if !(0.0..=MAX_GAIN).contains(&magnitude) {
            return Err(format!(
                "`{key}` has the magnitude {magnitude}, expected up to {MAX_GAIN}: a path does not amplify"
            ));
        }
    }
    let to_body = instant.attitude.inverse();
    let body = to_body.apply(arrival);
    // Dipoles receive along the zenith tangent of their own frame.
    let match_ =
        zenith_tangent(arrival.vector()).dot(&instant.attitude.apply_vector(&zenith_tangent(body.vector())));
    let (vertical, across) = components(path, &arrival, &body, instant);
    // What the link tells of a horizontal component has its part in the vertical one of tilted dipoles.
    let (gain, match_) = match path.cross_gain {
        None => (C64::new(gain[0], gain[1]), match_),
        Some(_) => (vertical, 1.0),
    };
    let dipoles = [&departure, &arrival].map(|d| half_wave_dipole(d.vector()).max(LEAST_DIPOLE));
    let turns = carrier_hz * path.delay_s;
    let carrier = phasor(-std::f64::consts::TAU * (turns - turns.floor()));
    let of_movers_m_per_s = path.closing_m_per_s.unwrap_or(0.0);
    if of_movers_m_per_s.is_nan() || of_movers_m_per_s.abs() > MAX_CLOSING_M_PER_S {
        return Err(format!(
            "`closing_m_per_s` is {of_movers_m_per_s}, expected {} to {MAX_CLOSING_M_PER_S}",
            -MAX_CLOSING_M_PER_S
        ));
    }
    let closing_m_per_s = instant.velocity_m_per_s.dot(arrival.vector())
        + instant.gmt_velocity_m_per_s.dot(departure.vector())
        + of_movers_m_per_s;
    Ok(Ray {
        amplitude: gain * carrier * (match_ / (dipoles[0] * dipoles[1])),
        across,
        delay_s: path.delay_s,
        arrival: body,
        departure: instant.gmt_attitude.inverse().apply(departure),
        doppler_hz: carrier_hz / SPEED_OF_LIGHT_M_PER_S * closing_m_per_s,
    })
}

/// The field of a path along the vertical tangent of the UAV's frame, and that along the horizontal one over it, at most [`MAX_ACROSS`]: of
/// what the path tells, and of the UAV's tilt.
fn components(
    path: &LinkPath,
    arrival: &Direction<World, f64>,
    body: &Direction<Body, f64>,
    instant: &Instant,
) -> (C64, C64) {
    let tangents = |u: &Vector3<f64>| {
        let zenith = zenith_tangent(u);
        [zenith, u.cross(&zenith)]
    };
    let own = tangents(body.vector()).map(|tangent| instant.attitude.apply_vector(&tangent));
    let components = [path.gain, path.cross_gain].map(|c| c.map_or(C64::ZERO, |[re, im]| C64::new(re, im)));
    let along = |own: &Vector3<f64>| -> C64 {
        let told = tangents(arrival.vector()).into_iter().zip(components);
        told.map(|(tangent, component)| component * tangent.dot(own))
            .sum()
    };
    let [vertical, horizontal] = [along(&own[0]), along(&own[1])];
    let size = horizontal.norm();
    let across = if size == 0.0 {
        C64::ZERO
    } else if size <= MAX_ACROSS * vertical.norm() {
        horizontal / vertical
    } else {
        horizontal * (MAX_ACROSS / size)
    };
    (vertical, across)
}

fn world(zenith_rad: f64, azimuth_rad: f64, which: &str) -> Result<Direction<World, f64>, String> {
    Direction::from_zenith_azimuth(zenith_rad, azimuth_rad).map_err(|e| format!("angle of {which}: {e}"))
}

/// Unit tangent towards growing zenith angle; +x at the poles.
fn zenith_tangent(u: &Vector3<f64>) -> Vector3<f64> {
    let horizontal = (u.x * u.x + u.y * u.y).sqrt();
    if horizontal < 1e-9 {
        return Vector3::x() * u.z.signum();
    }
    Vector3::new(u.z * u.x / horizontal, u.z * u.y / horizontal, -horizontal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_horizontal_component_is_that_of_tilt_and_of_the_path() {
        let level = Instant::at_rest();
        let rolled = |angle: f64| Instant {
            attitude: Rotation::from_yaw_pitch_roll(0.0, 0.0, angle).expect("angles"),
            ..Instant::at_rest()
        };
        // From straight ahead on the horizon, a roll turns the polarisation by its angle.
        let mut link =
            crate::synthesis::probe::one_path(30.0, [std::f64::consts::FRAC_PI_2, 0.0], [1.6, -2.8]);
        let one = |link: &Link, instant: &Instant| rays(link, instant, 30e9).expect("complete")[0];
        assert!(one(&link, &level).across.norm() < 1e-15);
        for angle in [0.0873, -0.3] {
            let ray = one(&link, &rolled(angle));
            assert!((ray.across.norm() - libm::tan(angle).abs()).abs() < 1e-9 && ray.across.im.abs() < 1e-12);
            assert!(
                (ray.amplitude.norm() / one(&link, &level).amplitude.norm() - libm::cos(angle)).abs() < 1e-9
            );
        }
        // 5 degrees, through elements of 18 dB: -39 dB.
        let through_db = 20.0 * libm::log10(one(&link, &rolled(0.0873)).across.norm()) - 18.0;
        assert!((through_db + 39.2).abs() < 0.1, "{through_db}");
        // The field as a whole stays what it is.
        let [re, im] = link.paths[0].gain.expect("given");
        link.paths[0].cross_gain = Some([0.4 * re, 0.4 * im]);
        let size = |ray: &Ray| ray.amplitude.norm() * (1.0 + ray.across.norm_sqr()).sqrt();
        let (straight, turned) = (one(&link, &level), one(&link, &rolled(0.5)));
        assert!((straight.across - 0.4).norm() < 1e-9);
        assert!((size(&straight) / size(&turned) - 1.0).abs() < 1e-9);
        // It may be all that there is; the ratio ends at ten.
        link.paths[0].cross_gain = Some([100.0 * re, 0.0]);
        assert!((one(&link, &level).across.norm() - 10.0).abs() < 1e-9);
        link.paths[0].cross_gain = Some([2.0, 0.0]);
        let error = rays(&link, &level, 30e9).expect_err("amplifies").to_string();
        assert!(error.contains("`cross_gain` has the magnitude 2"), "{error}");
    }

    #[test]
    fn movers_add_to_the_frequency_shift_of_the_ends() {
        let mut link = crate::synthesis::probe::one_path(30.0, [1.5, 0.3], [1.6, -2.8]);
        let instant = Instant {
            velocity_m_per_s: Vector3::new(3.0, -1.0, 0.5),
            ..Instant::at_rest()
        };
        let shift_hz = |link: &Link| rays(link, &instant, 30e9).map(|rays| rays[0].doppler_hz);
        let still_hz = shift_hz(&link).expect("complete");
        link.paths[0].closing_m_per_s = Some(7.0);
        let moving_hz = shift_hz(&link).expect("complete");
        let expected_hz = 7.0 * 30e9 / SPEED_OF_LIGHT_M_PER_S;
        assert!((moving_hz - still_hz - expected_hz).abs() < 1e-6);
        link.paths[0].closing_m_per_s = Some(-1001.0);
        let error = shift_hz(&link).expect_err("too fast").to_string();
        assert_eq!(
            error,
            "path 0: `closing_m_per_s` is -1001, expected -1000 to 1000"
        );
    }
}

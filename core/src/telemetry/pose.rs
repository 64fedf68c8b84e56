//! Where the UAV is, ten times per second.

use super::bits::{BitReader, BitWriter};
use super::scale::CLOCK_OFFSET;
use crate::constants::SPEED_OF_LIGHT_M_PER_S;
use crate::estimator::{Health, Pose};
use crate::geometry::{Body, Matrix3, Rotation, World};

/// A symmetric 3 x 3 covariance as standard deviations and correlations.
///
/// Decoded, a standard deviation is off by 4.5 % at most within its scale (0.0001 to 390 000) and a correlation by 1/254.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Standard deviation of each component, m, m/s or rad.
    pub sigma: [f32; 3],
    /// Correlation of x with y, x with z, y with z.
    pub correlation: [f32; 3],
}

impl Spread {
    /// Of a covariance. A variance below zero counts as none.
    #[must_use]
    pub fn new(covariance: &Matrix3<f32>) -> Self {
        let c = covariance;
        let sigma = [c.m11, c.m22, c.m33].map(|variance| libm::sqrtf(variance.max(0.0)));
        let [x, y, z] = sigma;
        let correlation = |covariance: f32, scale: f32| {
            if scale > 0.0 {
                (covariance / scale).clamp(-1.0, 1.0)
            } else {
                0.0
            }
        };
        Self {
            sigma,
            correlation: [
                correlation(c.m12, x * y),
                correlation(c.m13, x * z),
                correlation(c.m23, y * z),
            ],
        }
    }

    /// The covariance.
    #[must_use]
    pub fn matrix(&self) -> Matrix3<f32> {
        let [x, y, z] = self.sigma;
        let [xy, xz, yz] = self.correlation;
        let (xy, xz, yz) = (xy * x * y, xz * x * z, yz * y * z);
        Matrix3::new(x * x, xy, xz, xy, y * y, yz, xz, yz, z * z)
    }

    fn write(&self, to: &mut BitWriter<'_>) {
        for sigma in self.sigma {
            to.put_sigma(sigma);
        }
        for correlation in self.correlation {
            to.put_linear(f64::from(correlation), 127.0, 8);
        }
    }

    fn read(from: &mut BitReader<'_>) -> Option<Self> {
        let mut spread = Self::default();
        for sigma in &mut spread.sigma {
            *sigma = from.take_sigma()?;
        }
        for correlation in &mut spread.correlation {
            *correlation = from.take_linear(127.0, 8)? as f32;
            if correlation.abs() > 1.0 {
                return None;
            }
        }
        Some(spread)
    }
}

/// The UAV's clock against the GMT's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClockReport {
    /// UAV clock less GMT clock, s, up to 90 000 s (25 hours); sent in steps of 10 ps.
    pub offset_s: f64,
    /// Standard deviation of that, as a length, m.
    pub sigma_m: f32,
}

/// Position, velocity, attitude and clock at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseReport {
    /// UAV clock, ns; sent in whole microseconds, rounded down, up to 8.9 years.
    pub time_ns: u64,
    /// Body origin in the world, m, up to 2147 km; sent in steps of 1 mm.
    pub position_m: [f64; 3],
    /// Velocity in the world, m/s, up to 327 m/s; sent in steps of 1 cm/s.
    pub velocity_m_per_s: [f32; 3],
    /// Attitude R_wb as a unit quaternion w, x, y, z; decoded, the rotation is off by 4e-5 rad at most.
    pub quaternion_wb: [f32; 4],
    /// The clock, when two-way timing tells it.
    pub clock: Option<ClockReport>,
    /// Uncertainty of the position, m.
    pub position: Spread,
    /// Uncertainty of the velocity, m/s.
    pub velocity: Spread,
    /// Uncertainty of the attitude as a small rotation vector in world axes, rad.
    pub attitude: Spread,
    /// Rises by one, and wraps, whenever the pose was set anew instead of corrected.
    pub resets: u8,
    /// Flags of the filter.
    pub health: Health,
    /// Whether the last sweep had a line of sight that was taken.
    pub line_of_sight: bool,
}

/// Bits of a position coordinate, in mm, and of a velocity, in cm/s.
const POSITION: (f64, u32) = (1000.0, 32);
const VELOCITY: (f64, u32) = (100.0, 16);

impl PoseReport {
    /// Of a pose. `clock_offset_m` has the whole delay periods ([`crate::receiver::Receiver::clock_offset_m`]).
    #[must_use]
    pub fn new(pose: &Pose, clock_offset_m: Option<f64>, health: Health, line_of_sight: bool) -> Self {
        Self {
            time_ns: pose.time_ns,
            position_m: pose.position.to_array(),
            velocity_m_per_s: pose.velocity_m_per_s.into(),
            quaternion_wb: quaternion(&pose.attitude),
            clock: clock_offset_m.map(|offset_m| ClockReport {
                offset_s: offset_m / SPEED_OF_LIGHT_M_PER_S,
                sigma_m: pose.clock.offset_sigma_m,
            }),
            position: Spread::new(&pose.position_covariance_m2),
            velocity: Spread::new(&pose.velocity_covariance_m2_per_s2),
            attitude: Spread::new(&pose.attitude_covariance_rad2),
            resets: (pose.resets & 0xff) as u8,
            health,
            line_of_sight,
        }
    }

    pub(super) fn write(&self, to: &mut BitWriter<'_>) {
        put_time(to, self.time_ns);
        for coordinate in self.position_m {
            to.put_linear(coordinate, POSITION.0, POSITION.1);
        }
        for component in self.velocity_m_per_s {
            to.put_linear(f64::from(component), VELOCITY.0, VELOCITY.1);
        }
        to.put_quaternion(self.quaternion_wb);
        to.put_bit(self.clock.is_some());
        if let Some(clock) = self.clock {
            to.put_linear(clock.offset_s, CLOCK_OFFSET.0, CLOCK_OFFSET.1);
            to.put_sigma(clock.sigma_m);
        }
        for spread in [self.position, self.velocity, self.attitude] {
            spread.write(to);
        }
        to.put(u64::from(self.resets), 8);
        put_health(to, &self.health);
        to.put_bit(self.line_of_sight);
    }

    pub(super) fn read(from: &mut BitReader<'_>) -> Option<Self> {
        let time_ns = take_time(from)?;
        let mut position_m = [0.0; 3];
        for coordinate in &mut position_m {
            *coordinate = from.take_linear(POSITION.0, POSITION.1)?;
        }
        let mut velocity_m_per_s = [0.0; 3];
        for component in &mut velocity_m_per_s {
            *component = from.take_linear(VELOCITY.0, VELOCITY.1)? as f32;
        }
        let quaternion_wb = from.take_quaternion()?;
        let clock = if from.take_bit()? {
            Some(ClockReport {
                offset_s: from.take_linear(CLOCK_OFFSET.0, CLOCK_OFFSET.1)?,
                sigma_m: from.take_sigma()?,
            })
        } else {
            None
        };
        Some(Self {
            time_ns,
            position_m,
            velocity_m_per_s,
            quaternion_wb,
            clock,
            position: Spread::read(from)?,
            velocity: Spread::read(from)?,
            attitude: Spread::read(from)?,
            resets: from.take_u8(8)?,
            health: take_health(from)?,
            line_of_sight: from.take_bit()?,
        })
    }
}

/// Appends a time of the UAV clock: whole microseconds in 48 bits, no later than these can say.
pub(super) fn put_time(to: &mut BitWriter<'_>, time_ns: u64) {
    to.put((time_ns / 1000).min((1 << 48) - 1), 48);
}

/// What [`put_time`] wrote, ns.
pub(super) fn take_time(from: &mut BitReader<'_>) -> Option<u64> {
    Some(from.take(48)? * 1000)
}

/// Appends the filter's flags, a bit each.
pub(super) fn put_health(to: &mut BitWriter<'_>, health: &Health) {
    for flag in [
        health.starting,
        health.contested,
        health.clock_contested,
        health.beacon_implausible,
        health.inertial_missing,
        health.dead_reckoning,
        health.lost,
        health.attitude_lost,
    ] {
        to.put_bit(flag);
    }
}

/// What [`put_health`] wrote.
pub(super) fn take_health(from: &mut BitReader<'_>) -> Option<Health> {
    Some(Health {
        starting: from.take_bit()?,
        contested: from.take_bit()?,
        clock_contested: from.take_bit()?,
        beacon_implausible: from.take_bit()?,
        inertial_missing: from.take_bit()?,
        dead_reckoning: from.take_bit()?,
        lost: from.take_bit()?,
        attitude_lost: from.take_bit()?,
    })
}

/// Unit quaternion of a rotation, w, x, y, z (Shepperd's method: the largest component first).
fn quaternion(rotation: &Rotation<Body, World>) -> [f32; 4] {
    let m = rotation.matrix();
    let squares = [
        1.0 + m.m11 + m.m22 + m.m33,
        1.0 + m.m11 - m.m22 - m.m33,
        1.0 - m.m11 + m.m22 - m.m33,
        1.0 - m.m11 - m.m22 + m.m33,
    ];
    let (a, b, c) = (m.m32 - m.m23, m.m13 - m.m31, m.m21 - m.m12);
    let (d, e, f) = (m.m21 + m.m12, m.m13 + m.m31, m.m32 + m.m23);
    let [w, x, y, z] = squares;
    let (square, q) = if w >= x && w >= y && w >= z {
        (w, [w, a, b, c])
    } else if x >= y && x >= z {
        (x, [a, x, d, e])
    } else if y >= z {
        (y, [b, d, y, f])
    } else {
        (z, [c, e, f, z])
    };
    let scale = 0.5 / libm::sqrtf(square);
    q.map(|component| component * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quaternion_is_that_of_its_rotation() {
        for q in [
            [1.0_f32, 0.0, 0.0, 0.0],
            [0.5, 0.5, 0.5, 0.5],
            [0.1, 0.9, -0.3, 0.3],
            [0.1, 0.3, -0.9, 0.3],
            [0.0, 0.3, 0.1, -0.95],
        ] {
            let rotation = Rotation::<Body, World>::from_quaternion(q).expect("a rotation");
            let found = quaternion(&rotation);
            let back = Rotation::<Body, World>::from_quaternion(found).expect("a rotation");
            assert!(
                (rotation.matrix() - back.matrix()).abs().max() < 1e-6,
                "{q:?} became {found:?}"
            );
        }
    }
}

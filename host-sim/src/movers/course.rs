//! A straight line that is gone back and forth, in closed form.

use crate::scene::{Placement, Vec3};

/// Back and forth on a straight line: from rest to a speed, and to rest again before each turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Course {
    from: Vec3,
    along: Vec3,
    length_m: f64,
    /// Reached between the turns, m/s; 0 for one that stands.
    speed_m_per_s: f64,
    acceleration_m_per_s2: f64,
    /// Time since the last start from `from` at time 0, s.
    begun_s: f64,
}

impl Course {
    /// Stands at a point, turned along a horizontal unit vector.
    pub(super) fn standing(at: Vec3, along: Vec3) -> Self {
        Self {
            from: at,
            along,
            length_m: 0.0,
            speed_m_per_s: 0.0,
            acceleration_m_per_s2: 1.0,
            begun_s: 0.0,
        }
    }

    /// Goes from a point along a horizontal unit vector, m, no faster than a speed; a share of the whole way there and back, 0 to 1, is
    /// behind it at time 0.
    pub(super) fn going(
        from: Vec3,
        along: Vec3,
        length_m: f64,
        [speed_m_per_s, acceleration_m_per_s2]: [f64; 2],
        share: f64,
    ) -> Self {
        // A short line is over before the speed is reached.
        let speed_m_per_s = speed_m_per_s.min((length_m * acceleration_m_per_s2).sqrt());
        let mut course = Self {
            from,
            along,
            length_m,
            speed_m_per_s,
            acceleration_m_per_s2,
            begun_s: 0.0,
        };
        if speed_m_per_s > 0.0 {
            course.begun_s = share * 2.0 * course.ride_s();
        }
        course
    }

    /// Takes it to where a scene stands.
    pub(super) fn place(&mut self, placement: &Placement) {
        self.from = placement.place(&self.from);
        self.along = placement.rotation() * self.along;
    }

    /// Direction of the line, a horizontal unit vector.
    pub fn along(&self) -> Vec3 {
        self.along
    }

    /// Middle of the line, m, and half of its length, m.
    pub(super) fn middle(&self) -> (Vec3, f64) {
        let half_m = 0.5 * self.length_m;
        (self.from + self.along * half_m, half_m)
    }

    /// From one turn to the other, s.
    fn ride_s(&self) -> f64 {
        self.length_m / self.speed_m_per_s + self.speed_m_per_s / self.acceleration_m_per_s2
    }

    /// Place, m, and velocity, m/s.
    pub fn at(&self, time_s: f64) -> (Vec3, Vec3) {
        if self.speed_m_per_s <= 0.0 {
            return (self.from, Vec3::zeros());
        }
        let ride_s = self.ride_s();
        let since_s = (time_s + self.begun_s).rem_euclid(2.0 * ride_s);
        // The way back is the way there in reverse.
        let (at_s, sign) = if since_s < ride_s {
            (since_s, 1.0)
        } else {
            (2.0 * ride_s - since_s, -1.0)
        };
        let (acceleration, speed) = (self.acceleration_m_per_s2, self.speed_m_per_s);
        let (ramp_s, left_s) = (speed / acceleration, ride_s - at_s);
        let (gone_m, rate) = if at_s < ramp_s {
            (0.5 * acceleration * at_s * at_s, acceleration * at_s)
        } else if left_s > ramp_s {
            (speed * (at_s - 0.5 * ramp_s), speed)
        } else {
            let left_m = 0.5 * acceleration * left_s * left_s;
            (self.length_m - left_m, acceleration * left_s)
        };
        (self.from + self.along * gone_m, self.along * (sign * rate))
    }
}

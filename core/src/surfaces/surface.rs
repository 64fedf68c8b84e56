//! One surface: plane, existence, and where it was seen.

use super::SurfaceConfig;
use super::evidence::Evidence;
use crate::geometry::{Matrix3, Plane, Position, Real, Vector3};

/// What kind of surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Kind {
    /// The ground: it exists, and it is everywhere.
    Ground,
    /// Upright, or nearer to that than to level.
    Wall,
    /// A roof, a ceiling, a floor.
    Level,
}

/// Whether it is believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Status {
    /// It reaches neither map nor pose.
    Tentative,
    /// It exists, and it is known well.
    Confirmed,
}

/// A surface that reflects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Number: never used again for another one. The ground is 0.
    pub id: u16,
    /// What kind.
    pub kind: Kind,
    /// Mean and covariance. The centre is kept at the middle of what was seen; the ground's under the last reflection.
    pub plane: Plane,
    /// Log-odds of existence.
    pub log_odds: f32,
    /// Whether it is believed, with hysteresis.
    pub status: Status,
    /// Least and largest coordinate of its reflections along each tangent ([`Plane::tangents`]), from the centre, m.
    pub extent_m: [[f32; 2]; 2],
    /// What its log-odds were counted from.
    pub evidence: Evidence,
}

impl Surface {
    /// Probability that it exists.
    #[must_use]
    pub fn existence(&self) -> f32 {
        1.0 / (1.0 + libm::expf(-self.log_odds))
    }

    /// Whether it is confirmed.
    #[must_use]
    pub fn is_confirmed(&self) -> bool {
        self.status == Status::Confirmed
    }

    /// How far a point of the plane lies outside what was seen of it, m; 0 inside, and everywhere on the ground.
    #[must_use]
    pub fn outside_m<T: Real>(&self, point_m: &Vector3<T>) -> f32 {
        if self.kind == Kind::Ground {
            return 0.0;
        }
        let away = point_m.map(|c| c.to_f64() as f32) - self.plane.centre.vector();
        let (t1, t2) = self.plane.tangents();
        let [one, two] = &self.extent_m;
        let beyond = |[least, most]: &[f32; 2], x: f32| (least - x).max(x - most).max(0.0);
        libm::hypotf(beyond(one, t1.dot(&away)), beyond(two, t2.dot(&away)))
    }

    /// Whether what was seen of it stands in the straight way between two points, both clear of it by so much, m.
    #[must_use]
    #[inline(never)]
    pub fn stands_between(&self, from_m: &Vector3<f64>, to_m: &Vector3<f64>, clear_m: f32) -> bool {
        let [from, to] = [from_m, to_m].map(|end| end.map(|c| c as f32));
        let [over, under] = [&from, &to].map(|end| self.plane.height_m(end));
        if over * under >= 0.0 || over.abs().min(under.abs()) <= clear_m {
            return false;
        }
        self.outside_m(&(from + (to - from) * (over / (over - under)))) <= 0.0
    }

    /// Takes a reflection on it into what was seen, and moves the centre there. The plane stays where it is.
    #[inline(never)]
    pub fn extend(&mut self, point_m: &Vector3<f64>) {
        let away = point_m.map(|c| c as f32) - self.plane.centre.vector();
        let (t1, t2) = self.plane.tangents();
        let seen = [t1.dot(&away), t2.dot(&away)];
        let move_by = if self.kind == Kind::Ground {
            seen
        } else {
            let mut middle = [0.0; 2];
            for ((range, x), middle) in self.extent_m.iter_mut().zip(seen).zip(&mut middle) {
                *range = [range[0].min(x), range[1].max(x)];
                *middle = 0.5 * (range[0] + range[1]);
            }
            middle
        };
        self.recentre(move_by);
    }

    /// Moves the centre along the tangents, m. With it the shift's meaning changes: at `(a, b)` it is that at the old centre less
    /// `a` times the first tilt and `b` times the second. The plane is the same.
    pub fn recentre(&mut self, [a, b]: [f32; 2]) {
        let (t1, t2) = self.plane.tangents();
        let Ok(centre) = Position::from_vector(self.plane.centre.vector() + t1 * a + t2 * b) else {
            return;
        };
        let lever = Matrix3::new(1.0, -a, -b, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        self.plane.centre = centre;
        self.plane.covariance = lever * self.plane.covariance * lever.transpose();
        for (range, by) in self.extent_m.iter_mut().zip([a, b]) {
            *range = range.map(|x| x - by);
        }
    }

    /// Takes a plane over that was corrected elsewhere, whose centre may be another. What was seen stays where it is.
    pub fn replace_plane(&mut self, plane: &Plane) {
        let away = self.plane.centre.vector() - plane.centre.vector();
        let (t1, t2) = plane.tangents();
        let back = [t1.dot(&away), t2.dot(&away)];
        for (range, by) in self.extent_m.iter_mut().zip(back) {
            *range = range.map(|x| x + by);
        }
        self.plane = *plane;
        self.recentre(back);
    }

    /// Keeps the covariance above what all sightings share.
    pub fn floor_covariance(&mut self, config: &SurfaceConfig) {
        let covariance = &mut self.plane.covariance;
        let [shift, tilt] = [config.least_shift_m, config.least_tilt_rad].map(|sigma| sigma * sigma);
        covariance.m11 = covariance.m11.max(shift);
        covariance.m22 = covariance.m22.max(tilt);
        covariance.m33 = covariance.m33.max(tilt);
    }

    /// Counts log-odds in. Those of the ground do not change: it exists.
    pub fn add_log_odds(&mut self, by: f32, config: &SurfaceConfig) {
        if self.kind != Kind::Ground && by.is_finite() {
            self.log_odds = (self.log_odds + by).min(config.most_log_odds());
        }
    }

    /// The status that log-odds and covariance give: confirmed from a high existence, tentative again below an even one.
    #[must_use]
    pub fn next_status(&self, config: &SurfaceConfig) -> Status {
        let known = self.plane.covariance.m11 < config.same_m * config.same_m;
        match self.status {
            Status::Tentative if known && self.log_odds > config.confirmed_log_odds() => Status::Confirmed,
            Status::Confirmed if self.log_odds < 0.0 => Status::Tentative,
            same => same,
        }
    }

    /// Whether it is as good as refuted.
    #[must_use]
    pub fn is_dead(&self, config: &SurfaceConfig) -> bool {
        self.log_odds < config.dead_log_odds()
    }

    /// Whether another plane is parallel to this one and each lies in the other, to within `within_m`.
    #[must_use]
    #[inline(never)]
    pub fn is_along(&self, other: &Plane, within_m: f32, config: &SurfaceConfig) -> bool {
        // Cosines of small angles have no digits left in f32; the chord has.
        (self.plane.normal.vector() - other.normal.vector()).norm() < config.same_rad()
            && self.plane.height_m(other.centre.vector()).abs() < within_m
            && other.height_m(self.plane.centre.vector()).abs() < within_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Direction;

    pub(super) fn wall() -> Surface {
        Surface {
            id: 3,
            kind: Kind::Wall,
            plane: Plane {
                normal: Direction::from_vector(Vector3::new(-1.0, 0.1, 0.0)).expect("not zero"),
                centre: Position::new(20.0, 5.0, 4.0).expect("finite"),
                covariance: Matrix3::from_diagonal(&Vector3::new(0.01, 1e-4, 2.5e-5)),
            },
            log_odds: 0.0,
            status: Status::Tentative,
            extent_m: [[-3.0, 4.0], [-1.0, 2.0]],
            evidence: Evidence::default(),
        }
    }

    #[test]
    fn outside_is_measured_from_the_box_and_the_ground_is_everywhere() {
        let mut wall = wall();
        let (t1, t2) = wall.plane.tangents();
        let at = |a: f32, b: f32| wall.plane.centre.vector() + t1 * a + t2 * b;
        assert_eq!(wall.outside_m(&at(3.9, -0.9)), 0.0);
        assert!((wall.outside_m(&at(7.0, 6.0)) - 5.0).abs() < 1e-4);
        let far = at(7.0, 6.0);
        wall.kind = Kind::Ground;
        assert_eq!(wall.outside_m(&far), 0.0);
    }

    #[test]
    fn recentring_changes_neither_plane_nor_its_error_anywhere() {
        let before = wall();
        let mut after = before;
        after.recentre([2.5, -1.5]);
        let (t1, t2) = before.plane.tangents();
        let point = before.plane.centre.vector() + t1 * 9.0 + t2 * 4.0;
        assert!(after.plane.height_m(&point).abs() < 1e-4);
        assert!((after.outside_m(&point) - before.outside_m(&point)).abs() < 1e-4);
        // Variance of the plane's height over a point of it.
        let variance = |surface: &Surface| {
            let away = point - surface.plane.centre.vector();
            let lever = Vector3::new(1.0, -t1.dot(&away), -t2.dot(&away));
            lever.dot(&(surface.plane.covariance * lever))
        };
        assert!((variance(&after) - variance(&before)).abs() < 1e-5);
        // And that is how a tilt moves it.
        let tilted = before.plane.corrected([0.0, 1e-3, 0.0], before.plane.covariance);
        assert!((tilted.expect("finite").height_m(&point) - 9.0e-3).abs() < 1e-4);
    }

    #[test]
    fn the_centre_stays_in_the_middle_of_what_was_seen() {
        let mut wall = wall();
        let (t1, _) = wall.plane.tangents();
        let far = (wall.plane.centre.vector() + t1 * 10.0).map(f64::from);
        wall.extend(&far);
        assert!((wall.extent_m[0][0] + 6.5).abs() < 1e-5 && (wall.extent_m[0][1] - 6.5).abs() < 1e-5);
        assert!((wall.extent_m[1][0] + 1.5).abs() < 1e-5);
        assert!(wall.outside_m(&far) < 1e-5);
    }

    #[test]
    fn it_stands_in_ways_through_what_was_seen_of_it() {
        let wall = wall();
        let between = |from: [f64; 3], to: [f64; 3]| wall.stands_between(&from.into(), &to.into(), 0.6);
        assert!(between([10.0, 5.0, 4.0], [30.0, 5.0, 4.0]));
        assert!(!between([10.0, 5.0, 4.0], [19.0, 5.0, 4.0]), "before it");
        assert!(!between([10.0, 15.0, 4.0], [30.0, 15.0, 4.0]), "past it");
        assert!(
            !between([10.0, 5.0, 4.0], [20.5, 5.0, 4.0]),
            "from a corner of it"
        );
    }

    #[test]
    fn a_surface_is_confirmed_with_hysteresis() {
        let config = SurfaceConfig::default();
        let mut wall = wall();
        wall.log_odds = config.confirmed_log_odds() - 0.01;
        assert_eq!(wall.next_status(&config), Status::Tentative);
        wall.log_odds = config.confirmed_log_odds() + 0.01;
        assert_eq!(wall.next_status(&config), Status::Confirmed);
        wall.plane.covariance.m11 = 0.2;
        assert_eq!(wall.next_status(&config), Status::Tentative, "known too poorly");
        wall.status = Status::Confirmed;
        wall.log_odds = 0.1;
        assert_eq!(wall.next_status(&config), Status::Confirmed);
        wall.log_odds = -0.1;
        assert_eq!(wall.next_status(&config), Status::Tentative);
        assert!(!wall.is_dead(&config));
        wall.log_odds = -config.confirmed_log_odds() - 0.01;
        assert!(wall.is_dead(&config));
    }

    #[test]
    fn the_ground_exists_whatever_is_said() {
        let config = SurfaceConfig::default();
        let mut surface = wall();
        surface.add_log_odds(100.0, &config);
        assert!((surface.log_odds - config.most_log_odds()).abs() < 1e-6);
        surface.kind = Kind::Ground;
        surface.add_log_odds(-3.0, &config);
        assert!((surface.log_odds - config.most_log_odds()).abs() < 1e-6);
    }
}

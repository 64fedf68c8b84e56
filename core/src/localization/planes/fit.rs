//! Weighted least-squares fit of a plane to points, with what is known of built things: walls stand, floors lie.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::plane::Plane;
use super::plane::tangents;
use crate::geometry::{Direction, Position};
use crate::map::MapPoint;

/// How a plane stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Orientation {
    /// A wall: its normal is horizontal.
    Vertical,
    /// A floor or a roof: its normal is vertical.
    Horizontal,
}

/// What errors the fit reckons with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneNoise {
    /// Standard deviation by which walls lean and floors slope, rad.
    pub plumb_sigma_rad: f32,
    /// Error of a point along the normal beside its own variance, m.
    pub point_sigma_m: f32,
    /// Error that all points of a plane share, such as the pose's and the clock's: a shift, m, and a tilt, rad. It does
    /// not average out.
    pub shared_sigma_m: f32,
    /// See [`Self::shared_sigma_m`].
    pub shared_tilt_rad: f32,
}

impl Default for PlaneNoise {
    /// 0.3 degrees out of plumb, 6 cm of a point, 5 cm and 0.1 degrees of all points.
    fn default() -> Self {
        Self {
            plumb_sigma_rad: 0.005,
            point_sigma_m: 0.06,
            shared_sigma_m: 0.05,
            shared_tilt_rad: 0.0017,
        }
    }
}

impl PlaneNoise {
    /// Variance of a point along the normal of the plane that it lies on, m^2.
    ///
    /// The point's covariance is known by its trace, and most of that lies in the plane: an error of the angle moves
    /// the point along the ellipsoid of equal delay, which the mirror touches. A twentieth is left for the normal.
    pub(super) fn variance_m2(&self, point: &MapPoint) -> f32 {
        self.point_sigma_m * self.point_sigma_m + point.variance_m2 / 20.0
    }
}

/// Result of a fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fitted {
    pub(super) plane: Plane,
    /// Least and largest coordinate of the points along each tangent, from the centre, m.
    pub(super) extent_m: [[f32; 2]; 2],
    pub(super) support: u16,
}

/// Sums over the points of one plane.
#[derive(Clone, Copy, Debug)]
struct Sums {
    matrix: Matrix3<f32>,
    vector: Vector3<f32>,
    squares: f32,
    extent_m: [[f32; 2]; 2],
    support: u16,
}

/// Fits a plane to points, starting from one near it: one linear step. None of less than three points or of points in a
/// heap.
///
/// `points` is gone through twice: for the centre, then for the fit about it.
pub(super) fn fit<'a>(
    points: impl Iterator<Item = &'a MapPoint> + Clone,
    start: &Plane,
    orientation: Orientation,
    noise: &PlaneNoise,
) -> Option<Fitted> {
    let n = *start.normal.vector();
    let (t1, t2) = tangents(&n);
    let (mut total, mut centre) = (0.0, Vector3::zeros());
    for point in points.clone() {
        let weight = 1.0 / noise.variance_m2(point);
        total += weight;
        // From the start's centre: far from the world's origin sums of places would lose millimetres.
        centre += (point.position.vector() - start.centre.vector()) * weight;
    }
    let centre = start.centre.vector() + centre / total;
    let mut sums = Sums {
        matrix: Matrix3::zeros(),
        vector: Vector3::zeros(),
        squares: 0.0,
        extent_m: [[f32::INFINITY, f32::NEG_INFINITY]; 2],
        support: 0,
    };
    for point in points {
        let away = point.position.vector() - centre;
        let (height, along) = (n.dot(&away), Vector2::new(t1.dot(&away), t2.dot(&away)));
        let weight = 1.0 / noise.variance_m2(point);
        // Height over a plane that is shifted by s and tilted by a: h - s + a . along.
        let column = Vector3::new(1.0, -along.x, -along.y);
        sums.matrix += column * column.transpose() * weight;
        sums.vector += column * (height * weight);
        sums.squares += height * height * weight;
        for ([least, most], x) in sums.extent_m.iter_mut().zip([along.x, along.y]) {
            *least = least.min(x);
            *most = most.max(x);
        }
        sums.support = sums.support.saturating_add(1);
    }
    if sums.support < 3 {
        return None;
    }
    // Walls stand, floors lie: a tilt that makes them plumb is expected, with this information.
    let plumb = 1.0 / (noise.plumb_sigma_rad * noise.plumb_sigma_rad);
    let (mut matrix, mut vector) = (sums.matrix, sums.vector);
    let mut expect = |axis: usize, tilt: f32| {
        if let (Some(m), Some(v)) = (matrix.get_mut((axis, axis)), vector.get_mut(axis)) {
            *m += plumb;
            *v += plumb * tilt;
        }
    };
    match orientation {
        // t2 of a wall is nearly up.
        Orientation::Vertical => expect(2, -n.z / t2.z),
        Orientation::Horizontal => {
            let up = Vector3::z() * libm::copysignf(1.0, n.z);
            expect(1, t1.dot(&(up - n)));
            expect(2, t2.dot(&(up - n)));
        }
    }
    let spread = matrix.try_inverse()?;
    let solved = spread * vector;
    // What the points scatter beyond their own variances; never taken for better than half of what they claim.
    let residual = sums.squares - solved.dot(&sums.vector);
    let freedom = f32::from(sums.support.saturating_sub(2)).max(1.0);
    let scale = (residual / freedom).max(0.25);
    let mut covariance = spread * scale;
    let shared = [noise.shared_sigma_m, noise.shared_tilt_rad, noise.shared_tilt_rad];
    for (i, sigma) in shared.into_iter().enumerate() {
        if let Some(variance) = covariance.get_mut((i, i)) {
            *variance += sigma * sigma;
        }
    }
    let [shift, a1, a2]: [f32; 3] = solved.into();
    let plane = Plane {
        centre: Position::from_vector(centre).ok()?,
        ..*start
    }
    .corrected([shift, a1, a2], covariance)?;
    Some(Fitted {
        plane,
        extent_m: sums.extent_m,
        support: sums.support,
    })
}

/// An upright plane through two points, or a level one through the first where there is no second. None of points over
/// each other.
pub(super) fn through(a: &MapPoint, b: Option<&MapPoint>) -> Option<Plane> {
    let normal = match b {
        None => Vector3::z(),
        Some(b) => {
            let along = b.position.from_origin(&a.position);
            Vector3::new(-along.y, along.x, 0.0)
        }
    };
    Some(Plane {
        normal: Direction::from_vector(normal).ok()?,
        centre: a.position,
        covariance: Matrix3::zeros(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f32, y: f32, z: f32) -> MapPoint {
        MapPoint {
            position: Position::new(x, y, z).expect("finite"),
            variance_m2: 0.03,
            hits: 1,
        }
    }

    /// A wall at y = 4 + slope (x - 20) with points over 12 m x 6 m, `rough` m of scatter.
    fn wall(slope: f32, lean: f32, rough: f32) -> [MapPoint; 40] {
        core::array::from_fn(|i| {
            let (x, z) = (
                14.0 + 12.0 * ((i as f32 * 0.618_034) % 1.0),
                6.0 * ((i as f32 * 0.414_214) % 1.0),
            );
            let off = rough * (((i as f32 * 0.733_1) % 1.0) - 0.5) * 3.46;
            point(x, 4.0 + slope * (x - 20.0) + lean * (z - 3.0) + off, z)
        })
    }

    #[test]
    fn a_plane_through_points_is_found_from_a_crude_start() {
        let points = wall(0.1, 0.0, 0.0);
        let mut plane = through(&points[0], Some(&points[5])).expect("apart");
        for _ in 0..3 {
            plane = fit(
                points.iter(),
                &plane,
                Orientation::Vertical,
                &PlaneNoise::default(),
            )
            .expect("sound")
            .plane;
        }
        let expected = Vector3::new(-0.1, 1.0, 0.0).normalize();
        assert!(plane.normal.vector().cross(&expected).norm() < 1e-5);
        assert!(
            points
                .iter()
                .all(|p| plane.height_m(p.position.vector()).abs() < 1e-4)
        );
    }

    #[test]
    fn walls_are_expected_to_stand_and_evidence_overrules_it() {
        let lean = |points: &[MapPoint], plumb_sigma_rad| {
            let noise = PlaneNoise {
                plumb_sigma_rad,
                ..PlaneNoise::default()
            };
            let start = through(&points[0], Some(&points[7])).expect("apart");
            let once = fit(points.iter(), &start, Orientation::Vertical, &noise)
                .expect("sound")
                .plane;
            let fitted = fit(points.iter(), &once, Orientation::Vertical, &noise).expect("sound");
            fitted.plane.normal.vector().z.abs()
        };
        let points = wall(0.0, 0.02, 0.0);
        // The points alone know it to 0.01 rad.
        assert!(lean(&points, 1.0) > 0.019);
        let stiff = lean(&points, 0.005);
        assert!((0.001..0.01).contains(&stiff), "{stiff}");
    }

    #[test]
    fn a_floor_lies() {
        let points: [MapPoint; 30] = core::array::from_fn(|i| {
            point(
                10.0 * ((i as f32 * 0.618_034) % 1.0),
                10.0 * ((i as f32 * 0.414_214) % 1.0),
                2.0,
            )
        });
        let start = through(&points[0], None).expect("level");
        let fitted = fit(
            points.iter(),
            &start,
            Orientation::Horizontal,
            &PlaneNoise::default(),
        )
        .expect("sound");
        assert!((fitted.plane.normal.vector() - Vector3::z()).norm() < 1e-5);
        assert!((fitted.plane.offset_m() - 2.0).abs() < 1e-5 && fitted.support == 30);
    }

    #[test]
    fn scatter_beyond_the_variances_widens_the_covariance() {
        let noise = PlaneNoise {
            shared_sigma_m: 0.0,
            shared_tilt_rad: 0.0,
            ..PlaneNoise::default()
        };
        let shift_variance = |rough| {
            let points = wall(0.0, 0.0, rough);
            let start = through(&points[0], Some(&points[7])).expect("apart");
            let once = fit(points.iter(), &start, Orientation::Vertical, &noise)
                .expect("sound")
                .plane;
            fit(points.iter(), &once, Orientation::Vertical, &noise)
                .expect("sound")
                .plane
                .covariance
                .m11
        };
        let (smooth, rough) = (shift_variance(0.0), shift_variance(0.4));
        assert!(rough > 8.0 * smooth, "{rough} against {smooth}");
        // 0.0714 m of a point; 40 points.
        assert!((libm::sqrtf(smooth) / (0.5 * 0.0714 / libm::sqrtf(40.0)) - 1.0).abs() < 0.05);
    }

    #[test]
    fn two_points_are_no_plane() {
        let points = [point(0.0, 0.0, 0.0), point(3.0, 0.0, 1.0)];
        let start = through(&points[0], Some(&points[1])).expect("apart");
        assert!(
            fit(
                points.iter(),
                &start,
                Orientation::Vertical,
                &PlaneNoise::default()
            )
            .is_none()
        );
        assert!(through(&points[0], Some(&point(0.0, 0.0, 5.0))).is_none());
    }
}

//! What a planner asks of a world, and whether a body of some size fits through it.

use nalgebra::Vector3;

/// A world with solids in it. Coordinates in m, world frame.
pub trait Obstacles {
    /// Whether something stands between two points.
    fn blocked(&self, from: [f64; 3], to: [f64; 3]) -> bool;
    /// Whether a wave gets from one point to another by one reflection. A world that knows nothing of mirrors says yes.
    fn reflected(&self, _from: [f64; 3], _to: [f64; 3]) -> bool {
        true
    }
    /// Whether a point lies inside a solid.
    fn inside_solid(&self, point: [f64; 3]) -> bool;
    /// Height of the ground under or over a place, over its level, m. A world of level ground has none.
    fn relief_m(&self, _place: [f64; 3]) -> f64 {
        0.0
    }
    /// Lowest and highest corner of the world.
    fn bounds(&self) -> ([f64; 3], [f64; 3]);
}

/// A tube around a line, probed by lines parallel to its axis: 24 around at 1.4 times the clearance, where a wedge of
/// 60 deg or more that reaches into the clearance is wider than the gap between two of them; twelve at 0.6 of that
/// radius and the axis itself, longer than the line by the clearance, for what is thin or lies ahead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tube {
    clearance_m: f64,
    shape: Shape,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    /// Round, for what flies.
    Round,
    /// Upright, from the ground to the mast, for what drives: (lowest, highest probe) below the axis, m.
    Upright { down_m: f64 },
}

/// Probes lie this much farther out than the clearance they guarantee.
const PROBE_RATIO: f64 = 1.4;
/// Lowest probe of a vehicle above the ground, m: kerbs below do not stop it.
const KERB_M: f64 = 0.3;

impl Tube {
    /// A tube that keeps `clearance_m` on all sides.
    pub fn round(clearance_m: f64) -> Self {
        Self {
            clearance_m,
            shape: Shape::Round,
        }
    }

    /// The way of a vehicle with a mast of `mast_m`: `clearance_m` on both sides, from a kerb's height to the top.
    pub fn upright(clearance_m: f64, mast_m: f64) -> Self {
        Self {
            clearance_m,
            shape: Shape::Upright {
                down_m: (mast_m - KERB_M).max(0.0),
            },
        }
    }

    /// Whether the tube along a segment is free, and the room before and behind its ends.
    pub fn is_free(&self, world: &dyn Obstacles, from: &Vector3<f64>, to: &Vector3<f64>) -> bool {
        let axis = (to - from).try_normalize(1e-12).unwrap_or_else(Vector3::x);
        let (side, up) = across(&axis);
        self.probes(&side, &up).iter().all(|(offset, beyond_m)| {
            let ahead = axis * *beyond_m;
            let (start, end): ([f64; 3], [f64; 3]) =
                ((from + offset - ahead).into(), (to + offset + ahead).into());
            !world.inside_solid(start)
                && !world.blocked(start, end)
                && !world.blocked((*from).into(), start)
                && !world.blocked((*to).into(), end)
        })
    }

    /// Whether the body fits at a point.
    pub fn fits(&self, world: &dyn Obstacles, at: &Vector3<f64>) -> bool {
        [Vector3::x(), Vector3::y()]
            .iter()
            .all(|axis| self.is_free(world, at, &(at + axis * 1e-6)))
    }

    /// Lines to probe: offset from the axis, and how far beyond the ends.
    fn probes(&self, side: &Vector3<f64>, up: &Vector3<f64>) -> Vec<(Vector3<f64>, f64)> {
        let reach = self.clearance_m * PROBE_RATIO;
        let mut probes = vec![(Vector3::zeros(), reach)];
        match self.shape {
            Shape::Round => {
                for (count, share, beyond_m) in [(24, 1.0, 0.0), (12, 0.6, self.clearance_m)] {
                    for k in 0..count {
                        let angle = core::f64::consts::TAU * f64::from(k) / f64::from(count);
                        let (sin, cos) = libm::sincos(angle);
                        probes.push(((side * cos + up * sin) * (share * reach), beyond_m));
                    }
                }
            }
            Shape::Upright { down_m } => {
                for (lateral, beyond_m) in
                    [(-1.0, 0.0), (-0.5, reach), (0.0, reach), (0.5, reach), (1.0, 0.0)]
                {
                    for height in [0.0, 0.5, 1.0] {
                        let offset = side * (lateral * reach) - Vector3::z() * (height * down_m);
                        probes.push((offset, beyond_m));
                    }
                }
            }
        }
        probes
    }
}

/// Two unit vectors across an axis: one horizontal, one completing the frame. Any pair for a vertical axis.
fn across(axis: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let side = Vector3::z()
        .cross(axis)
        .try_normalize(1e-9)
        .unwrap_or_else(Vector3::x);
    let up = axis.cross(&side).try_normalize(1e-9).unwrap_or_else(Vector3::y);
    (side, up)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A world of boxes on flat ground at z = 0.
    pub(crate) struct Boxes {
        pub(crate) solids: Vec<([f64; 3], [f64; 3])>,
        pub(crate) bounds: ([f64; 3], [f64; 3]),
    }

    impl Boxes {
        /// Distance of a point to the nearest box or the ground; zero or negative inside.
        pub(crate) fn distance_m(&self, p: &Vector3<f64>) -> f64 {
            self.solids.iter().fold(p.z, |least, (low, high)| {
                let outside = Vector3::from_fn(|i, _| (low[i] - p[i]).max(p[i] - high[i]));
                let distance = if outside.max() <= 0.0 {
                    outside.max()
                } else {
                    outside.map(|d| d.max(0.0)).norm()
                };
                least.min(distance)
            })
        }

        /// Streets and blocks: nine buildings of several heights on 100 x 100 m.
        pub(crate) fn town() -> Self {
            let mut solids = Vec::new();
            for (k, height) in [18.0, 7.0, 20.0, 12.0, 19.0, 5.0, 20.0, 16.0, 9.0]
                .into_iter()
                .enumerate()
            {
                let (x, y) = (-38.0 + 30.0 * (k % 3) as f64, -38.0 + 30.0 * (k / 3) as f64);
                solids.push(([x, y, 0.0], [x + 16.0 + (k % 2) as f64 * 3.0, y + 17.0, height]));
            }
            Self {
                solids,
                bounds: ([-50.0, -50.0, 0.0], [50.0, 50.0, 20.0]),
            }
        }

        /// Two rooms of 8 x 8 m with a doorway of 1.2 m between them.
        pub(crate) fn two_rooms() -> Self {
            Self {
                solids: vec![
                    ([-0.1, -4.0, 0.0], [0.1, 1.0, 4.0]),
                    ([-0.1, 2.2, 0.0], [0.1, 4.0, 4.0]),
                    ([-8.2, -4.2, 0.0], [8.2, -4.0, 4.0]),
                    ([-8.2, 4.0, 0.0], [8.2, 4.2, 4.0]),
                    ([-8.2, -4.0, 0.0], [-8.0, 4.0, 4.0]),
                    ([8.0, -4.0, 0.0], [8.2, 4.0, 4.0]),
                ],
                bounds: ([-8.0, -4.0, 0.0], [8.0, 4.0, 4.0]),
            }
        }
    }

    impl Obstacles for Boxes {
        fn blocked(&self, from: [f64; 3], to: [f64; 3]) -> bool {
            let ground = (from[2] < 0.0) != (to[2] < 0.0);
            ground
                || self.solids.iter().any(|(low, high)| {
                    // Slab test over the segment's parameter 0..1.
                    let (mut enter, mut leave) = (0.0f64, 1.0f64);
                    for i in 0..3 {
                        let step = to[i] - from[i];
                        if step == 0.0 {
                            if from[i] < low[i] || from[i] > high[i] {
                                return false;
                            }
                            continue;
                        }
                        let (a, b) = ((low[i] - from[i]) / step, (high[i] - from[i]) / step);
                        enter = enter.max(a.min(b));
                        leave = leave.min(a.max(b));
                    }
                    enter <= leave
                })
        }

        fn inside_solid(&self, p: [f64; 3]) -> bool {
            self.distance_m(&Vector3::from(p)) < 0.0
        }

        fn bounds(&self) -> ([f64; 3], [f64; 3]) {
            self.bounds
        }
    }

    #[test]
    fn a_tube_that_is_free_keeps_its_clearance() {
        let town = Boxes::town();
        let tube = Tube::round(1.5);
        let mut random = crate::seeded::Seeded::new(4, crate::seeded::Source::UavRoute);
        let (mut free, mut refused) = (0, 0);
        while free < 300 {
            let mut point = || {
                Vector3::new(
                    random.between(-49.0, 49.0),
                    random.between(-49.0, 49.0),
                    random.between(1.0, 22.0),
                )
            };
            let (from, to) = (point(), point());
            if !tube.is_free(&town, &from, &to) {
                refused += 1;
                continue;
            }
            free += 1;
            for k in 0..=400 {
                let p = from + (to - from) * (f64::from(k) / 400.0);
                assert!(town.distance_m(&p) > 1.5, "{} m at {p:?}", town.distance_m(&p));
            }
        }
        assert!(refused > 300, "a town must be in the way of something: {refused}");
    }

    #[test]
    fn a_vehicle_does_not_fit_under_a_low_bar_or_into_a_wall() {
        let world = Boxes {
            solids: vec![
                ([-5.0, 5.0, 0.0], [5.0, 6.0, 0.5]),
                ([-5.0, -6.0, 1.2], [5.0, -5.0, 1.4]),
            ],
            bounds: ([-10.0, -10.0, 0.0], [10.0, 10.0, 10.0]),
        };
        let tube = Tube::upright(1.0, 1.5);
        let at = |x, y| Vector3::new(x, y, 1.5);
        assert!(tube.fits(&world, &at(0.0, 0.0)));
        assert!(tube.is_free(&world, &at(-5.0, 0.0), &at(5.0, 0.0)));
        // A low box, though the antenna itself passes above it.
        assert!(!tube.is_free(&world, &at(0.0, 0.0), &at(0.0, 9.0)));
        assert!(!tube.fits(&world, &at(0.0, 5.5)));
    }
}

//! Facades: walls cut into panels, each a little off the wall's plane, some of them windows.

use super::relief::Shape;
use super::{Face, Vec3};
use crate::seeded::{Seeded, Source};

/// Side of a panel, m.
pub(crate) const PANEL_M: f64 = 3.0;
/// Standard deviation of a panel's offset along the normal, m.
pub(crate) const OFFSET_M: f64 = 0.03;
/// Standard deviation of a panel's tilt about each of its axes, rad: 0.15 degrees.
pub(crate) const TILT_RAD: f64 = 0.15 * core::f64::consts::PI / 180.0;
/// Share of panels that are windows.
pub(crate) const WINDOW_SHARE: f64 = 0.4;
/// How far back the glass of a window is set, m.
pub(crate) const RECESS_M: f64 = 0.1;
/// Thickness of the glass, m.
pub(crate) const PANE_M: f64 = 0.006;

/// What a wall may be wider than whole panels without another one, m: rounding, which a turned scene has and another has not.
const ROUNDING_M: f64 = 1e-6;

/// One panel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Panel {
    /// Middle of the panel, along the face's axes from its corner, m.
    middle_m: [f64; 2],
    /// Height of the middle over the plane of the face, m; the recess of a window included.
    pub(crate) offset_m: f64,
    /// Slopes along the face's axes.
    pub(crate) slope: [f64; 2],
    /// Whether it is a window.
    pub(crate) window: bool,
}

/// A wall in panels.
#[derive(Clone, Debug)]
pub(crate) struct Facade {
    /// Corner that panels are counted from: along the face's axes, from its first vertex, m.
    corner_m: [f64; 2],
    origin: Vec3,
    axes: [Vec3; 2],
    counts: [usize; 2],
    /// Row by row.
    panels: Vec<Panel>,
}

impl Facade {
    /// Cuts a face: the panels of `seed` and its number in the scene.
    pub(crate) fn draw(face: &Face, number: u32, seed: u64) -> Self {
        let (origin, axes) = (face.vertices()[0], face.axes());
        let along = |v: &Vec3| axes.map(|axis| (v - origin).dot(&axis));
        let (mut low, mut high) = ([0.0; 2], [0.0; 2]);
        for place in face.vertices().iter().map(along) {
            low = [0, 1].map(|i| f64::min(low[i], place[i]));
            high = [0, 1].map(|i| f64::max(high[i], place[i]));
        }
        let count = |i: usize| (((high[i] - low[i] - ROUNDING_M) / PANEL_M).ceil() as usize).max(1);
        let counts = [count(0), count(1)];
        let mut random = Seeded::numbered(seed, Source::Panels, number);
        let panels = (0..counts[0] * counts[1]).map(|k| {
            let offset_m = random.normal() * OFFSET_M;
            let slope = [0, 1].map(|_| libm::tan(random.normal() * TILT_RAD));
            let window = random.uniform() < WINDOW_SHARE;
            Panel {
                middle_m: [k % counts[0], k / counts[0]].map(|cell| (cell as f64 + 0.5) * PANEL_M),
                offset_m: offset_m - if window { RECESS_M } else { 0.0 },
                slope,
                window,
            }
        });
        Self {
            panels: panels.collect(),
            corner_m: low,
            origin,
            axes,
            counts,
        }
    }

    /// Place of a point of the plane along the axes from the corner, m.
    fn place_m(&self, foot: &Vec3) -> [f64; 2] {
        [0, 1].map(|i| (foot - self.origin).dot(&self.axes[i]) - self.corner_m[i])
    }

    /// The panel at a point of the plane; the nearest one beyond its rim.
    pub(crate) fn panel(&self, foot: &Vec3) -> &Panel {
        let place = self.place_m(foot);
        let cell = |i: usize| ((place[i] / PANEL_M).max(0.0) as usize).min(self.counts[i] - 1);
        &self.panels[cell(1) * self.counts[0] + cell(0)]
    }

    /// The plane of a panel of this facade at a point of the face's.
    pub(crate) fn shape(&self, panel: &Panel, foot: &Vec3) -> Shape {
        let place = self.place_m(foot);
        let [across, up] = [0, 1].map(|i| panel.slope[i] * (place[i] - panel.middle_m[i]));
        Shape {
            height_m: panel.offset_m + across + up,
            slope: panel.slope,
            bend_per_m: [0.0; 3],
        }
    }

    /// All panels.
    pub(crate) fn panels(&self) -> &[Panel] {
        &self.panels
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::RawFace;

    /// A wall of 60 x 30 m that looks south.
    fn wall() -> Face {
        let raw = RawFace {
            vertices: vec![
                [0.0, 5.0, 0.0],
                [60.0, 5.0, 0.0],
                [60.0, 5.0, 30.0],
                [0.0, 5.0, 30.0],
            ],
            ..RawFace::default()
        };
        Face::new(&raw).expect("a wall")
    }

    #[test]
    fn panels_are_off_by_what_they_should_be() {
        let all: Vec<Panel> = (0..40)
            .flat_map(|seed| Facade::draw(&wall(), 3, seed).panels().to_vec())
            .collect();
        assert_eq!(all.len(), 40 * 200);
        let n = all.len() as f64;
        let windows = all.iter().filter(|panel| panel.window).count() as f64 / n;
        assert!((windows - WINDOW_SHARE).abs() < 0.02, "{windows}");
        let off = |panel: &Panel| panel.offset_m + if panel.window { RECESS_M } else { 0.0 };
        let rms = |of: &dyn Fn(&Panel) -> f64| (all.iter().map(|p| of(p) * of(p)).sum::<f64>() / n).sqrt();
        assert!((rms(&off) / OFFSET_M - 1.0).abs() < 0.04, "{}", rms(&off));
        for axis in 0..2 {
            let tilt = rms(&|panel| panel.slope[axis]);
            assert!((tilt / TILT_RAD - 1.0).abs() < 0.04, "{tilt}");
        }
    }

    #[test]
    fn a_panel_is_where_its_cell_is_and_lies_on_its_own_plane() {
        let (face, facade) = (wall(), Facade::draw(&wall(), 3, 9));
        let at = |x: f64, z: f64| Vec3::new(x, 5.0, z);
        assert_eq!(facade.panel(&at(0.1, 0.1)), facade.panel(&at(2.9, 2.9)));
        assert_ne!(facade.panel(&at(2.9, 0.1)), facade.panel(&at(3.1, 0.1)));
        assert_ne!(facade.panel(&at(0.1, 2.9)), facade.panel(&at(0.1, 3.1)));
        // Beyond the rim, the nearest.
        assert_eq!(facade.panel(&at(61.0, 31.0)), facade.panel(&at(59.0, 29.0)));
        let panel = facade.panel(&at(1.0, 1.0));
        let height = |x: f64, z: f64| facade.shape(panel, &at(x, z)).height_m;
        assert!((height(1.5, 1.5) - panel.offset_m).abs() < 1e-15);
        let [u, v] = face.axes();
        let rise = height(1.5 + u.x, 1.5) - panel.offset_m;
        assert!((rise - panel.slope[0]).abs() < 1e-15 && v == Vec3::z());
        let rise = height(1.5, 2.5) - panel.offset_m;
        assert!((rise - panel.slope[1]).abs() < 1e-15);
        // Another face has panels of its own.
        assert_ne!(Facade::draw(&face, 4, 9).panels(), facade.panels());
    }
}

//! Surfaces that are no planes: ground with relief, facades of panels. The faces stay what they are; this says how far off them the
//! surface lies.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use super::kinds::{FaceKind, Kinds};
use super::panels::{Facade, PANE_M, Panel};
use super::relief::{Relief, Shape};
use super::{Face, Material, Placement, Scene, Vec3};
use crate::input::{InputError, within};

/// How far the surfaces of a scene are off their faces. The default is not at all. Under a roof ground and walls are level in any case.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Unevenness {
    /// Seed of the surfaces: the same place in every flight.
    pub surface_seed: u64,
    /// Standard deviation of the ground's height about its mean, m; 0 to 1.
    pub ground_relief_rms_m: f64,
    /// Distance at which its correlation is 1/e, m; 5 to 1000.
    pub ground_relief_length_m: f64,
    /// Whether walls are panels, each off the wall's plane by a little, some of them windows.
    pub panels: bool,
}

impl Default for Unevenness {
    fn default() -> Self {
        Self {
            surface_seed: 1,
            ground_relief_rms_m: 0.0,
            ground_relief_length_m: 12.0,
            panels: false,
        }
    }
}

impl Unevenness {
    /// Ground of 0.15 m rms, which is a slope of one degree, and facades of panels.
    pub fn real() -> Self {
        Self {
            ground_relief_rms_m: 0.15,
            panels: true,
            ..Self::default()
        }
    }

    /// Whether it leaves all surfaces in the planes of their faces.
    pub fn is_none(&self) -> bool {
        self.ground_relief_rms_m == 0.0 && !self.panels
    }

    /// Checks the figures.
    ///
    /// # Errors
    /// [`InputError`] naming the key and what was expected.
    pub fn check(&self) -> Result<(), InputError> {
        within(&[
            ("ground_relief_rms_m", self.ground_relief_rms_m, 0.0, 1.0),
            ("ground_relief_length_m", self.ground_relief_length_m, 5.0, 1000.0),
        ])
    }
}

/// The surface of a face.
#[derive(Clone, Debug)]
enum Surface {
    /// The face itself.
    Even,
    /// Ground, with the scene's relief.
    Ground,
    /// A facade.
    Facade(Facade),
}

/// The surfaces of a scene that is uneven.
#[derive(Clone, Debug)]
pub(crate) struct Uneven {
    told: Unevenness,
    relief: Option<Relief>,
    /// Where the scene stands: its relief goes with it.
    placement: Placement,
    /// One for each face.
    surfaces: Vec<Surface>,
}

impl Uneven {
    /// Draws the surfaces of faces that stand somewhere; `None` when nothing is uneven.
    fn draw(told: Unevenness, faces: &[Face], placement: Placement) -> Option<Self> {
        let kinds = Kinds::of(faces);
        if told.is_none() || kinds.indoors() {
            return None;
        }
        let relief = Relief::draw(
            told.ground_relief_rms_m,
            told.ground_relief_length_m,
            told.surface_seed,
        );
        let surface = |(number, face): (u32, &Face)| match kinds.of_face(face) {
            FaceKind::Ground if relief.is_some() => Surface::Ground,
            FaceKind::Wall if told.panels => Surface::Facade(Facade::draw(face, number, told.surface_seed)),
            _ => Surface::Even,
        };
        let surfaces = (0..).zip(faces).map(surface).collect();
        Some(Self {
            told,
            relief,
            placement,
            surfaces,
        })
    }

    /// The same surfaces on the faces of the scene where it stands now.
    pub(super) fn moved(&self, faces: &[Face], placement: Placement) -> Option<Self> {
        Self::draw(self.told, faces, placement)
    }

    /// The part of a face's surface around a point of its plane.
    pub(crate) fn patch(&self, face: u32, foot: &Vec3) -> Patch<'_> {
        match (&self.surfaces[face as usize], &self.relief) {
            (Surface::Facade(facade), _) => Patch::Panel(facade, facade.panel(foot)),
            (Surface::Ground, Some(relief)) => Patch::Ground(relief, &self.placement),
            _ => Patch::Even,
        }
    }

    /// Whether the surface of a face is another one than its plane.
    pub(crate) fn is_off(&self, face: u32) -> bool {
        !matches!(self.surfaces[face as usize], Surface::Even)
    }

    /// Height of the surface of a face over a point of its plane, along the normal, m.
    pub(crate) fn height_m(&self, face: u32, foot: &Vec3) -> f64 {
        match self.patch(face, foot) {
            Patch::Even => 0.0,
            Patch::Ground(relief, placement) => relief.height_m(placement.back(foot).xy().into()),
            Patch::Panel(facade, panel) => facade.shape(panel, foot).height_m,
        }
    }

    /// The surface of a face is nowhere farther off its plane, m.
    pub(crate) fn greatest_m(&self, face: u32) -> f64 {
        match (&self.surfaces[face as usize], &self.relief) {
            (Surface::Ground, Some(relief)) => relief.greatest_m(),
            (Surface::Facade(facade), _) => {
                let reach = |panel: &Panel| {
                    let tilt = panel.slope[0].abs() + panel.slope[1].abs();
                    panel.offset_m.abs() + tilt * super::panels::PANEL_M
                };
                facade.panels().iter().map(reach).fold(0.0, f64::max)
            }
            _ => 0.0,
        }
    }

    /// Height of the ground over its mean at a place in the world, m.
    pub(crate) fn relief_m(&self, place_m: &Vec3) -> f64 {
        let height = |relief: &Relief| relief.height_m(self.placement.back(place_m).xy().into());
        self.relief.as_ref().map_or(0.0, height)
    }
}

/// A smooth part of a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Patch<'u> {
    /// The plane of the face.
    Even,
    /// Relief of a scene that stands somewhere.
    Ground(&'u Relief, &'u Placement),
    /// A panel, its plane continued beyond its rim.
    Panel(&'u Facade, &'u Panel),
}

impl Patch<'_> {
    /// The surface over a point of the face's plane, along the face's [`Face::axes`].
    pub(crate) fn shape(&self, foot: &Vec3, axes: &[Vec3; 2]) -> Shape {
        match self {
            Self::Even => Shape::default(),
            Self::Panel(facade, panel) => facade.shape(panel, foot),
            Self::Ground(relief, placement) => {
                let shape = relief.at(placement.back(foot).xy().into());
                let turn = placement.rotation().inverse();
                let [u, v] = axes.map(|axis| (turn * axis).xy());
                let [xx, xy, yy] = shape.bend_per_m;
                let slope = |a: &Vector2<f64>| shape.slope[0] * a.x + shape.slope[1] * a.y;
                let bend = |a: &Vector2<f64>, b: &Vector2<f64>| {
                    xx * a.x * b.x + xy * (a.x * b.y + a.y * b.x) + yy * a.y * b.y
                };
                Shape {
                    height_m: shape.height_m,
                    slope: [slope(&u), slope(&v)],
                    bend_per_m: [bend(&u, &u), bend(&u, &v), bend(&v, &v)],
                }
            }
        }
    }

    /// Whether it is a window.
    pub(crate) fn is_window(&self) -> bool {
        matches!(self, Self::Panel(_, panel) if panel.window)
    }

    /// Whether both are the same part: the relief is one, panels are many.
    pub(crate) fn is(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Panel(_, a), Self::Panel(_, b)) => core::ptr::eq(*a, *b),
            _ => true,
        }
    }
}

impl Scene {
    /// The same scene with surfaces that are off their faces. Which waves get where is still decided by the faces.
    #[must_use]
    pub fn with_unevenness(mut self, unevenness: Unevenness) -> Self {
        self.uneven = Uneven::draw(unevenness, self.faces(), self.placement());
        self
    }

    /// Its surfaces, if they are off their faces.
    pub(crate) fn uneven(&self) -> Option<&Uneven> {
        self.uneven.as_ref()
    }

    /// What the panes of its windows are of.
    pub(crate) fn pane() -> Option<Material> {
        Material::named("glass")?.slab(PANE_M)
    }
}

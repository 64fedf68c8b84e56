//! How waves travel in a world: what the tracer follows, and what walls are made of.

use serde::{Deserialize, Serialize};

use crate::input::{InputError, within};
use crate::movers::MoversConfig;
use crate::tracer::{DEFAULT_MAX_ORDER, Diffraction, Diffuse, MAX_ORDER, Propagation};
use crate::vegetation::VegetationConfig;

/// Who says what the faces of a scene are made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Materials {
    /// The scene; the built-in ones are all of the paper's material.
    #[default]
    Scene,
    /// Where the scene says nothing, a material of ITU-R P.2040 for each building, ground and room
    /// ([`Scene::with_drawn_materials`](crate::scene::Scene::with_drawn_materials)).
    Drawn,
}

/// What waves do on their way. The default follows specular reflections alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PropagationConfig {
    /// Greatest number of reflections of a path.
    pub max_order: u32,
    /// What walls are made of.
    pub materials: Materials,
    /// Whether the grain of rough materials weakens their reflections.
    pub roughness: bool,
    /// Whether edges diffract, beside at most one reflection.
    pub diffraction: bool,
    /// Weaker diffracted paths are dropped: gain between vertical half-wave dipoles, dB.
    pub diffraction_least_gain_db: f64,
    /// No more diffracted paths than so many, the strongest.
    pub diffraction_most_paths: u32,
    /// Whether faces scatter diffusely.
    pub diffuse: bool,
    /// No more scattered paths than so many.
    pub diffuse_most_paths: u32,
    /// Tiles this much under the link's strongest path are gathered to one path a face, dB.
    pub diffuse_range_db: f64,
    /// Whether thin walls let a part of the waves through: boards instead of solid plaster.
    pub transmission: bool,
    /// Whether waves have a horizontal component, which reflections make of the vertical one.
    pub cross_polarisation: bool,
    /// Cars and people.
    pub movers: MoversConfig,
    /// Trees.
    pub vegetation: VegetationConfig,
}

impl Default for PropagationConfig {
    fn default() -> Self {
        let (diffraction, diffuse) = (Diffraction::default(), Diffuse::default());
        Self {
            max_order: DEFAULT_MAX_ORDER as u32,
            materials: Materials::Scene,
            roughness: false,
            diffraction: false,
            diffraction_least_gain_db: diffraction.least_gain_db,
            diffraction_most_paths: diffraction.most_paths as u32,
            diffuse: false,
            diffuse_most_paths: diffuse.most_paths as u32,
            diffuse_range_db: diffuse.range_db,
            transmission: false,
            cross_polarisation: false,
            movers: MoversConfig::default(),
            vegetation: VegetationConfig::default(),
        }
    }
}

impl PropagationConfig {
    /// All that the tracer can follow, walls of their own materials, trees, cars and people.
    pub(super) fn real() -> Self {
        Self {
            materials: Materials::Drawn,
            roughness: true,
            diffraction: true,
            diffuse: true,
            diffuse_most_paths: 128,
            transmission: true,
            cross_polarisation: true,
            movers: MoversConfig::real(),
            vegetation: VegetationConfig::real(),
            ..Self::default()
        }
    }

    /// Whether materials are drawn.
    pub(super) fn draws_materials(&self) -> bool {
        self.materials == Materials::Drawn
    }

    /// Greatest number of reflections.
    pub(super) fn max_order(&self) -> usize {
        self.max_order as usize
    }

    /// What the tracer follows; `seed` draws the phases of scattered waves.
    pub(super) fn of_tracer(&self, seed: u64) -> Propagation {
        Propagation {
            diffraction: self.diffraction.then(|| Diffraction {
                least_gain_db: self.diffraction_least_gain_db,
                most_paths: self.diffraction_most_paths as usize,
                ..Diffraction::default()
            }),
            roughness: self.roughness,
            diffuse: self.diffuse.then(|| Diffuse {
                seed,
                most_paths: self.diffuse_most_paths as usize,
                range_db: self.diffuse_range_db,
                ..Diffuse::default()
            }),
            cross_polarisation: self.cross_polarisation,
        }
    }

    /// Checks every figure; the error names the key.
    pub(super) fn check(&self) -> Result<(), InputError> {
        within(&[
            ("max_order", f64::from(self.max_order), 0.0, MAX_ORDER as f64),
            (
                "diffraction_least_gain_db",
                self.diffraction_least_gain_db,
                -300.0,
                0.0,
            ),
            (
                "diffraction_most_paths",
                f64::from(self.diffraction_most_paths),
                1.0,
                1000.0,
            ),
            (
                "diffuse_most_paths",
                f64::from(self.diffuse_most_paths),
                1.0,
                1000.0,
            ),
            ("diffuse_range_db", self.diffuse_range_db, 0.0, 200.0),
        ])?;
        self.movers.check().map_err(|error| error.under("movers"))?;
        self.vegetation.check().map_err(|error| error.under("vegetation"))
    }
}

//! The link state classifiers: links of all kinds, the trees and networks that come with the crate, networks of random weights, and digests
//! of everything between a measured path and its probabilities. Equal digests of two kernels, or of two machines, mean equal
//! bits.

use cslam_core::geometry::{Direction, GeometryError, Matrix3, Position, World};
use cslam_core::kernels::{Kernels, Native};
use cslam_core::link_state::{
    Activations, Description, GEOMETRIC_INPUTS, GEOMETRIC_WITH_DEPARTURE_INPUTS, InferenceError, InputScale,
    Kind, LinkGeometry, Model, ModelError, Network, Outputs, PathClassifier, Received, Rows, Shape,
    WriteError, models, paper_inputs, write,
};
use cslam_core::path::{Departure, Path, diagonal_covariance};
use cslam_core::reflection::{Ends, InputError};
use cslam_core::signal::Waveform;

use crate::digest::Digest;
use crate::random::Random;

/// Number of different links.
pub const LINKS: u32 = 1000;
/// Most paths of a link, and the paths that the paper's network takes.
pub const PATHS: usize = 9;
/// Inputs of the paper's network.
pub const PAPER_INPUTS: usize = 3 * PATHS;

/// Room for a model of this module.
#[derive(Clone, Debug)]
#[repr(align(4))]
pub struct ModelFile([u8; 20 * 1024]);

impl ModelFile {
    /// Without a model.
    pub const EMPTY: Self = Self([0; 20 * 1024]);

    /// The model of random weights, written here.
    ///
    /// # Errors
    /// [`WriteError`], none for the networks of this module.
    pub fn random(&mut self, which: Which) -> Result<Model<'_>, WriteError> {
        let length = random_model(which, &mut self.0)?;
        Model::parse(self.0.get(..length).unwrap_or(&[])).map_err(WriteError::Model)
    }
}

/// Which network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// Geometric, every path by itself, with the angle of departure.
    WithDeparture,
    /// Geometric, every path by itself, without the angle of departure.
    WithoutDeparture,
    /// The paper's, [`PATHS`] paths at once.
    Paper,
}

impl Which {
    /// Its topology.
    pub fn shape(self) -> Option<Shape> {
        match self {
            Self::WithDeparture => Shape::new(Kind::Geometric, GEOMETRIC_WITH_DEPARTURE_INPUTS, &[48, 32, 3]),
            Self::WithoutDeparture => Shape::new(Kind::Geometric, GEOMETRIC_INPUTS, &[48, 32, 3]),
            Self::Paper => Shape::new(Kind::Paper, PAPER_INPUTS, &[10, 50, 100, 3]),
        }
    }

    /// Value that becomes 0 and steps a unit of an input, so that most links stay within +-127.
    fn scale(self, input: usize) -> InputScale {
        let (offset, steps) = match (self, input % 3) {
            (Self::Paper, 0) => (100.0, 0.6),
            (Self::Paper, 1) => (1.57, 80.0),
            (Self::Paper, _) => (0.0, 40.0),
            _ => (0.5, 20.0),
        };
        InputScale { offset, steps }
    }
}

/// Writes the model of random weights to `file`.
fn random_model(which: Which, file: &mut [u8]) -> Result<usize, WriteError> {
    const NAMES: &str = "x,x,x,x,x,x,x,x,x,x,x,x,x,x,x,x,x,x,x,x,x,x,x,x,x,x,x";
    let shape = which.shape().ok_or(WriteError::Parts)?;
    let mut random = Random::new(which as u64 + 1);
    let mut weights = [0; 8 * 1024];
    weights.fill_with(|| random.below(255) as i8);
    weights.iter_mut().filter(|w| **w == i8::MIN).for_each(|w| *w = 0);
    let mut biases = [0; 128];
    biases.fill_with(|| random.below(40_000) as i32 - 20_000);
    // A sum of 64 products of about 73 and 50 is near 30 000, its output near 40.
    let mut multipliers = [0; 128];
    multipliers.fill_with(|| random.below(6_000_000) as i32 + 3_000_000);
    let mut inputs = [which.scale(0); PAPER_INPUTS];
    for (index, input) in inputs.iter_mut().enumerate() {
        *input = which.scale(index);
    }
    let mut rest = weights.as_slice();
    let mut layers = [Rows {
        weights: &[],
        biases: &[],
        outputs: Outputs::Logits(&[1e-4, 1.1e-4, 0.9e-4]),
    }; 4];
    for (index, layer) in layers.iter_mut().enumerate().take(shape.layers()) {
        let rows = shape.outputs(index);
        (layer.weights, rest) = rest
            .split_at_checked(rows * shape.columns(index))
            .ok_or(WriteError::Parts)?;
        layer.biases = biases.get(..rows).ok_or(WriteError::Parts)?;
        if index + 1 < shape.layers() {
            layer.outputs = Outputs::Requantised(multipliers.get(..rows).ok_or(WriteError::Parts)?);
        }
    }
    let description = Description {
        shape,
        temperature: 1.25,
        names: NAMES.get(..2 * shape.inputs() - 1).ok_or(WriteError::Parts)?,
        inputs: inputs.get(..shape.inputs()).ok_or(WriteError::Parts)?,
        layers: layers.get(..shape.layers()).ok_or(WriteError::Parts)?,
    };
    write(&description, file)
}

/// A link: its ends and what was measured.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    ends: Ends,
    paths: [Received; PATHS],
    count: usize,
}

impl Link {
    /// Link `index`, 0 to [`LINKS`]. One to nine paths, from before the line of sight to far behind it; some without angle
    /// of departure, some without power. Every ninth has all the paths.
    ///
    /// # Errors
    /// None for the numbers drawn here.
    pub fn random(index: u32) -> Result<Self, GeometryError> {
        let mut random = Random::new(0x1000 + u64::from(index));
        let mut position = |height: f32| {
            let mut within = |limit: f32| random.unit() * limit;
            Position::<World>::new(within(120.0), within(120.0), 1.0 + within(height))
        };
        let ends = Ends {
            uav: position(20.0)?,
            gmt: position(1.0)?,
            uav_covariance: Matrix3::identity() * 0.09,
        };
        let baseline_m = ends.uav.distance_m(&ends.gmt);
        let mut path = || {
            // Squared, so that small excesses are common; a fifth of the paths arrives early.
            let excess_m =
                random.unit() * random.unit() * 100.0 - if random.below(5) == 0 { 100.0 } else { 0.0 };
            let mut direction = || {
                let zenith_rad = random.unit() * core::f32::consts::PI;
                Direction::<World>::from_zenith_azimuth(
                    zenith_rad,
                    (random.unit() - 0.5) * core::f32::consts::TAU,
                )
            };
            let (aoa, departs) = (direction()?, direction()?);
            let sigma_rad = 0.01 + 0.05 * random.unit();
            let aod = Departure {
                direction: departs,
                sigma_rad,
            };
            Ok(Received {
                path: Path {
                    c_tau_m: (baseline_m + excess_m).max(0.5),
                    aoa,
                    aod: (random.below(8) != 0).then_some(aod),
                    covariance: diagonal_covariance(0.2, 0.0087),
                },
                gain_db: (random.below(8) != 0).then_some(-80.0 - 60.0 * random.unit()),
            })
        };
        let first = path()?;
        let mut paths = [first; PATHS];
        for place in &mut paths {
            *place = path()?;
        }
        Ok(Self {
            ends,
            paths,
            count: PATHS - index as usize % PATHS,
        })
    }

    /// Its ends.
    pub fn ends(&self) -> &Ends {
        &self.ends
    }

    /// Its paths.
    pub fn paths(&self) -> &[Received] {
        self.paths.get(..self.count).unwrap_or(&[])
    }

    /// Its geometry, by the default waveform.
    ///
    /// # Errors
    /// [`InputError`]: none for the links of this module.
    pub fn geometry(&self) -> Result<LinkGeometry<'_>, InputError> {
        LinkGeometry::new(self.ends(), self.paths(), &Waveform::default())
    }
}

/// The three networks on a kernel.
#[derive(Clone, Copy, Debug)]
pub struct Networks<'m, K = Native> {
    /// See [`Which::WithDeparture`].
    pub with_departure: Network<'m, K>,
    /// See [`Which::WithoutDeparture`].
    pub without_departure: Network<'m, K>,
    /// See [`Which::Paper`].
    pub paper: Network<'m, K>,
}

impl<'m, K: Kernels> Networks<'m, K> {
    /// Networks of three models in the order of [`Which`].
    pub fn new([with_departure, without_departure, paper]: [Model<'m>; 3]) -> Self {
        Self {
            with_departure: Network::new(with_departure),
            without_departure: Network::new(without_departure),
            paper: Network::new(paper),
        }
    }

    /// The networks that fly.
    ///
    /// # Errors
    /// None in a sound build.
    pub fn shipped() -> Result<Self, ModelError> {
        Ok(Self::new([
            models::geometric()?,
            models::geometric_without_departure()?,
            models::paper()?,
        ]))
    }

    /// Digest of a link: bits of every path's features, and sums, logits and probabilities of each network.
    ///
    /// # Errors
    /// None for the links of this module.
    pub fn digest(&self, link: &Link, work: &mut Activations) -> Result<u64, InferenceError> {
        let mut digest = Digest::new();
        if let Ok(geometry) = link.geometry() {
            for path in link.paths() {
                let Ok(features) = geometry.features(path) else {
                    digest.add(1);
                    continue;
                };
                if let Some(inputs) = features.with_departure() {
                    add_network(&mut digest, &self.with_departure, inputs, work)?;
                }
                add_network(
                    &mut digest,
                    &self.without_departure,
                    features.without_departure(),
                    work,
                )?;
            }
        }
        let mut inputs = [0.0; PAPER_INPUTS];
        paper_inputs(link.paths(), &mut inputs);
        add_network(&mut digest, &self.paper, &inputs, work)?;
        Ok(digest.value())
    }
}

/// Digest of a link by the trees that fly: bits of every path's inputs, and sums and probabilities.
///
/// # Errors
/// None for the links of this module.
pub fn trees_digest(classifier: &PathClassifier<'_>, link: &Link) -> Result<u64, InferenceError> {
    let mut digest = Digest::new();
    if let Ok(geometry) = link.geometry() {
        for path in link.paths() {
            let Ok(inputs) = geometry.tree_inputs(path) else {
                digest.add(1);
                continue;
            };
            inputs.iter().for_each(|x| digest.add_bits(*x));
            let sums = classifier.trees().sums(&inputs)?;
            sums.iter().for_each(|&sum| digest.add(u64::from(sum as u32)));
            let p = classifier.trees().classify(&inputs)?;
            [p.los, p.first_order, p.higher_order, p.artefact]
                .iter()
                .for_each(|p| digest.add_bits(*p));
        }
    }
    Ok(digest.value())
}

/// Takes in all that a network makes of its inputs.
fn add_network<K: Kernels>(
    digest: &mut Digest,
    network: &Network<'_, K>,
    inputs: &[f32],
    work: &mut Activations,
) -> Result<(), InferenceError> {
    inputs.iter().for_each(|x| digest.add_bits(*x));
    let sums = network.sums(inputs, work)?;
    sums.iter().for_each(|&sum| digest.add(u64::from(sum as u32)));
    let logits = network.logits(inputs, work)?;
    logits.iter().for_each(|z| digest.add_bits(*z));
    let probabilities = network.classify(inputs, work)?.to_array();
    probabilities.iter().for_each(|p| digest.add_bits(*p));
    Ok(())
}

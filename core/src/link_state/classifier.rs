//! The models at work: the state of a link, and how probable it is of every path that it was reflected once.
//!
//! Three ways. [`PathClassifier`] looks at each path of a flight, its errors and what stands beside it, but not at its departure, which data
//! association weighs. [`Classifier`] looks at each path of any list, through the geometric network that has its inputs: with angle of
//! departure where the path shows one, without where not. [`PaperClassifier`] looks at the strongest paths of a link
//! together and tells the state of the link, as the paper does; of single paths it knows nothing but that the strongest
//! one has that state. A link without a path is a state of its own, not an error: a UAV behind a house hears nothing.

use core::fmt;

use super::features::{LinkGeometry, PAPER_INPUTS_PER_PATH, Received, paper_inputs, tree_names};
use super::network::{Activations, InferenceError, Network};
use super::probability::Probabilities;
use super::shape::MAX_INPUTS;
use super::trees::Trees;
use super::{GEOMETRIC_INPUTS, GEOMETRIC_WITH_DEPARTURE_INPUTS, Kind, Model, ModelError};
use crate::reflection::InputError;

/// State of a link: the number of reflections of its strongest path. Numbers as in files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LinkState {
    /// No path was heard.
    #[default]
    Outage = 0,
    /// Line of sight.
    LineOfSight = 1,
    /// One reflection.
    FirstOrder = 2,
    /// Two reflections or more.
    HigherOrder = 3,
}

impl Probabilities {
    /// The most probable state, artefacts aside; the lower order where two are equal.
    #[must_use]
    pub fn state(&self) -> LinkState {
        if self.los >= self.first_order && self.los >= self.higher_order {
            LinkState::LineOfSight
        } else if self.first_order >= self.higher_order {
            LinkState::FirstOrder
        } else {
            LinkState::HigherOrder
        }
    }

    /// Whether first order is the most probable state, and at least so probable. A probability that is no number reaches nothing.
    #[must_use]
    pub fn is_first_order(&self, least: f32) -> bool {
        self.state() == LinkState::FirstOrder && self.first_order >= least
    }
}

/// Why a path or a link has no probabilities.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ClassifyError {
    /// The path is no measurement.
    Input(InputError),
    /// The network refused its features.
    Inference(InferenceError),
}

impl fmt::Display for ClassifyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(error) => error.fmt(f),
            Self::Inference(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for ClassifyError {}

impl From<InputError> for ClassifyError {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}

impl From<InferenceError> for ClassifyError {
    fn from(error: InferenceError) -> Self {
        Self::Inference(error)
    }
}

/// A model that cannot take the part it was given: what the part needs, and what the model is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WrongModel {
    /// Kind that is needed.
    pub expected_kind: Kind,
    /// Inputs that are needed: a multiple of three for the paper's.
    pub expected_inputs: usize,
    /// Kind of the model.
    pub kind: Kind,
    /// Inputs of the model.
    pub inputs: usize,
}

impl fmt::Display for WrongModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            expected_kind,
            expected_inputs,
            kind,
            inputs,
        } = self;
        write!(
            f,
            "a {kind:?} model of {inputs} inputs, expected {expected_kind:?} of {expected_inputs}"
        )
    }
}

impl core::error::Error for WrongModel {}

/// Classifies every path by its geometry.
#[derive(Clone, Copy, Debug)]
pub struct Classifier<'m> {
    with_departure: Network<'m>,
    without_departure: Network<'m>,
}

impl<'m> Classifier<'m> {
    /// A classifier of two geometric models: for paths with angle of departure, and without.
    ///
    /// # Errors
    /// [`WrongModel`] when one is not geometric, or takes another number of inputs.
    pub fn new(with_departure: Model<'m>, without_departure: Model<'m>) -> Result<Self, WrongModel> {
        let check = |model: &Model<'m>, expected_inputs: usize| {
            let (kind, inputs) = (model.kind(), model.shape().inputs());
            if kind == Kind::Geometric && inputs == expected_inputs {
                return Ok(());
            }
            Err(WrongModel {
                expected_kind: Kind::Geometric,
                expected_inputs,
                kind,
                inputs,
            })
        };
        check(&with_departure, GEOMETRIC_WITH_DEPARTURE_INPUTS)?;
        check(&without_departure, GEOMETRIC_INPUTS)?;
        Ok(Self {
            with_departure: Network::new(with_departure),
            without_departure: Network::new(without_departure),
        })
    }

    /// Probabilities of one path of a link.
    ///
    /// # Errors
    /// [`ClassifyError`] for a path that is no measurement.
    pub fn path(&self, link: &LinkGeometry<'_>, received: &Received) -> Result<Probabilities, ClassifyError> {
        let features = link.features(received)?;
        let work = &mut Activations::new();
        Ok(match features.with_departure() {
            Some(inputs) => self.with_departure.classify(inputs, work)?,
            None => self
                .without_departure
                .classify(features.without_departure(), work)?,
        })
    }
}

/// Classifies every path by its geometry, its errors and what stands beside it, without its departure: for data association, which
/// weighs the departure itself.
#[derive(Clone, Copy, Debug)]
pub struct PathClassifier<'m> {
    trees: Trees<'m>,
}

impl<'m> PathClassifier<'m> {
    /// A classifier of trees that take the inputs that [`tree_names`] names.
    ///
    /// # Errors
    /// [`ModelError::Inputs`] when they take others.
    pub fn new(trees: Trees<'m>) -> Result<Self, ModelError> {
        let same = trees.input_names().eq(tree_names());
        same.then_some(Self { trees }).ok_or(ModelError::Inputs)
    }

    /// Its trees.
    #[must_use]
    pub fn trees(&self) -> &Trees<'m> {
        &self.trees
    }

    /// Probabilities of one path of a link.
    ///
    /// # Errors
    /// [`ClassifyError`] for a path that is no measurement.
    pub fn path(&self, link: &LinkGeometry<'_>, received: &Received) -> Result<Probabilities, ClassifyError> {
        Ok(self.trees.classify(&link.tree_inputs(received)?)?)
    }
}

/// Classifies a link by its strongest paths, as the paper does.
#[derive(Clone, Copy, Debug)]
pub struct PaperClassifier<'m> {
    network: Network<'m>,
}

impl<'m> PaperClassifier<'m> {
    /// A classifier of one model of the paper's kind. Its inputs say how many paths it takes, K.
    ///
    /// # Errors
    /// [`WrongModel`] when it is of another kind, or its inputs are not whole paths.
    pub fn new(model: Model<'m>) -> Result<Self, WrongModel> {
        let (kind, inputs) = (model.kind(), model.shape().inputs());
        if kind != Kind::Paper || inputs == 0 || !inputs.is_multiple_of(PAPER_INPUTS_PER_PATH) {
            return Err(WrongModel {
                expected_kind: Kind::Paper,
                expected_inputs: inputs
                    .next_multiple_of(PAPER_INPUTS_PER_PATH)
                    .max(PAPER_INPUTS_PER_PATH),
                kind,
                inputs,
            });
        }
        Ok(Self {
            network: Network::new(model),
        })
    }

    /// Paths that it looks at.
    #[must_use]
    pub fn paths(&self) -> usize {
        self.network.model().shape().inputs() / PAPER_INPUTS_PER_PATH
    }

    /// Probabilities of a link from its paths, strongest first. `None` in an outage.
    ///
    /// # Errors
    /// [`ClassifyError::Inference`] for a delay that is not finite.
    pub fn link(&self, paths: &[Received]) -> Result<Option<Probabilities>, ClassifyError> {
        if paths.is_empty() {
            return Ok(None);
        }
        let mut inputs = [0.0; MAX_INPUTS];
        let count = self.network.model().shape().inputs();
        let inputs = inputs.get_mut(..count).unwrap_or(&mut []);
        paper_inputs(paths, inputs);
        Ok(Some(self.network.classify(inputs, &mut Activations::new())?))
    }
}

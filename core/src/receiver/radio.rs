//! The part of the receiver that knows how many arrays, elements, faces and beams there are.
//!
//! Everything behind it takes [`RadioModel`], in whose type no count stands. A radio is a name for its counts: a module of
//! [`crate::profile`] gives them to [`Antennas`] once.

use core::fmt;
use core::marker::PhantomData;

use heapless::Vec;
use nalgebra::Vector3;

use super::PATHS;
use super::config::{Config, ConfigError, Departures};
use super::gain::LinkBudget;
use crate::array::{Codebook, UavArrays};
use crate::beam_squint::{BeamSquint, BeamSquintConfig, Bearing, Refusal, Sighting};
use crate::geometry::{Gmt, Rotation, World};
use crate::paths::{BeamReport, EstimatedPath, PathEstimator};
use crate::radio::{RadioConfig, RadioModel};
use crate::signal::BeamBlock;

/// A radio as [`Receiver`](super::Receiver) and its [`Memory`](super::Memory) take it: [`Antennas`] with the counts filled in.
pub trait Radio {
    /// Its description, a [`RadioConfig`].
    type Description: Clone + fmt::Debug;
    /// Path estimation.
    type Estimator;
    /// Beam squint, a [`BeamSquint`].
    type Squint;
    /// Samples of a beam or of a squint symbol, a [`BeamBlock`] of as many channels.
    type Block<'a>;

    /// The radio of a description.
    fn new(description: &Self::Description) -> Self;

    /// The same without its counts.
    fn model(&self) -> &RadioModel;

    /// Face of the GMT that sends a beam; `None` beyond the codebook.
    fn face(&self, beam: u16) -> Option<usize>;

    /// Power gain of a path between vertical half-wave dipoles, dB, as [`LinkBudget::path_gain_db`] has it.
    fn path_gain_db(
        &self,
        budget: &LinkBudget,
        path: &EstimatedPath<World>,
        gmt_attitude: &Rotation<Gmt, World>,
    ) -> Option<f32>;

    /// Number of the beam or of the squint symbol that a block holds.
    fn number(block: &Self::Block<'_>) -> u16;

    /// Takes a transmit beam into the sweep.
    fn push_beam(estimator: &mut Self::Estimator, block: Self::Block<'_>) -> BeamReport;

    /// Takes a pilot of the sweep whose paths these are.
    fn push_pilot(
        estimator: &mut Self::Estimator,
        block: Self::Block<'_>,
        turn_rad_per_s: &Vector3<f32>,
        paths: &mut [EstimatedPath],
    );

    /// Ends the beams: the paths of the sweep, strongest first.
    fn finish(estimator: &mut Self::Estimator) -> Vec<EstimatedPath, PATHS>;

    /// Beam squint with these errors; `None` where the counts are not the description's.
    fn beam_squint(description: &Self::Description, errors: BeamSquintConfig) -> Option<Self::Squint>;

    /// Lets beam squint listen to a path.
    ///
    /// # Errors
    /// Those of [`BeamSquint::begin`].
    fn listen(squint: &mut Self::Squint, sighting: &Sighting) -> Result<(), Refusal>;

    /// Takes a squint symbol, through the front end of path estimation.
    fn push_symbol(squint: &mut Self::Squint, estimator: &mut Self::Estimator, block: Self::Block<'_>);

    /// What the squint symbols tell, read in this way.
    ///
    /// # Errors
    /// Those of the reading; [`Refusal::NotBegun`] where [`Departures::Beams`] reads none.
    fn bearing(squint: &Self::Squint, departures: Departures) -> Result<Bearing, Refusal>;
}

impl<Description> Config<'_, Description> {
    /// Beam squint of the radio `R` as this configuration has it, for [`super::Memory`].
    ///
    /// # Errors
    /// [`ConfigError::Squint`].
    pub fn beam_squint<R: Radio<Description = Description>>(&self) -> Result<R::Squint, ConfigError> {
        R::beam_squint(&self.radio, self.beam_squint).ok_or(ConfigError::Squint)
    }
}

/// The antennas of both ends, and by their type the counts of a radio and the path estimator `Estimator`: `A` receive arrays of `E` elements
/// (`C` channels), `FACES` transmit faces of `X` x `Z` elements, `ELEVATIONS` of the codebook, azimuth and elevation sweeps of the squint
/// symbols, `SYMBOLS` of those a face, `ACTIVE` subcarriers.
#[derive(Debug)]
pub struct Antennas<
    Estimator,
    const A: usize,
    const E: usize,
    const C: usize,
    const FACES: usize,
    const X: usize,
    const Z: usize,
    const ELEVATIONS: usize,
    const AZIMUTH_SWEEPS: usize,
    const ELEVATION_SWEEPS: usize,
    const SYMBOLS: usize,
    const ACTIVE: usize,
> {
    arrays: UavArrays<f32, A, E>,
    codebook: Codebook<f32, FACES, X, Z, ELEVATIONS>,
    model: RadioModel,
    estimator: PhantomData<fn() -> Estimator>,
}

impl<
    Estimator: PathEstimator<C, PATHS>,
    const A: usize,
    const E: usize,
    const C: usize,
    const FACES: usize,
    const X: usize,
    const Z: usize,
    const ELEVATIONS: usize,
    const AZIMUTH_SWEEPS: usize,
    const ELEVATION_SWEEPS: usize,
    const SYMBOLS: usize,
    const ACTIVE: usize,
> Radio
    for Antennas<
        Estimator,
        A,
        E,
        C,
        FACES,
        X,
        Z,
        ELEVATIONS,
        AZIMUTH_SWEEPS,
        ELEVATION_SWEEPS,
        SYMBOLS,
        ACTIVE,
    >
{
    type Description = RadioConfig<ELEVATIONS, AZIMUTH_SWEEPS, ELEVATION_SWEEPS>;
    type Estimator = Estimator;
    type Squint = BeamSquint<SYMBOLS, A, E, C, X, Z, ACTIVE>;
    type Block<'a> = BeamBlock<'a, C>;

    fn new(description: &Self::Description) -> Self {
        Self {
            arrays: description.uav_arrays(),
            codebook: description.codebook(),
            model: description.model::<A, E, FACES, X, Z>(),
            estimator: PhantomData,
        }
    }

    fn model(&self) -> &RadioModel {
        &self.model
    }

    fn face(&self, beam: u16) -> Option<usize> {
        self.codebook.beam(usize::from(beam)).map(|beam| beam.face)
    }

    fn path_gain_db(
        &self,
        budget: &LinkBudget,
        path: &EstimatedPath<World>,
        gmt_attitude: &Rotation<Gmt, World>,
    ) -> Option<f32> {
        let waveform = &self.model.waveform;
        budget.path_gain_db(path, &self.arrays, &self.codebook, waveform, gmt_attitude)
    }

    fn number(block: &BeamBlock<'_, C>) -> u16 {
        block.beam
    }

    fn push_beam(estimator: &mut Estimator, block: BeamBlock<'_, C>) -> BeamReport {
        estimator.push_beam(block)
    }

    fn push_pilot(
        estimator: &mut Estimator,
        block: BeamBlock<'_, C>,
        turn_rad_per_s: &Vector3<f32>,
        paths: &mut [EstimatedPath],
    ) {
        estimator.push_pilot(block, turn_rad_per_s, paths);
    }

    fn finish(estimator: &mut Estimator) -> Vec<EstimatedPath, PATHS> {
        estimator.finish()
    }

    fn beam_squint(description: &Self::Description, errors: BeamSquintConfig) -> Option<Self::Squint> {
        BeamSquint::new(errors, description, FACES)
    }

    fn listen(squint: &mut Self::Squint, sighting: &Sighting) -> Result<(), Refusal> {
        squint.begin(sighting)
    }

    fn push_symbol(squint: &mut Self::Squint, estimator: &mut Estimator, block: BeamBlock<'_, C>) {
        let (correlator, work) = estimator.front_end();
        squint.push(block, correlator, work);
    }

    fn bearing(squint: &Self::Squint, departures: Departures) -> Result<Bearing, Refusal> {
        match departures {
            Departures::SquintFit => squint.fit(),
            Departures::SquintParabola => squint.parabola(),
            Departures::SquintPick => squint.pick(),
            Departures::Beams => Err(Refusal::NotBegun),
        }
    }
}

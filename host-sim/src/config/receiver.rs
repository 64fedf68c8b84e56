//! The receiver: whose methods it uses, stage by stage, and what it is told before a flight.

use std::path::PathBuf;

use clap::ValueEnum;
use cslam_core::estimator::Setup;
use cslam_core::inertial::MagneticField;
use cslam_firmware::storage::{self, GmtPlace};
use serde::{Deserialize, Serialize};

use super::{AssociationFigures, BaselineFigures, FilterFigures, ResidualFigures, SurfaceFigures};
use crate::estimate;
use crate::input::{InputError, within};
use crate::sensors::MagnetometerConfig;

/// Farthest that the ground is from the world frame's origin, m.
const HIGHEST_M: f64 = 100e3;

/// Table `[receiver]`. A stage that is left out is that of the mode.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReceiverConfig {
    /// Whose methods.
    pub mode: Mode,
    /// Path estimation.
    pub estimator: Option<estimate::Mode>,
    /// Link state.
    pub link_state: Option<LinkStateChoice>,
    /// Trees of one's own (`cslam train --kind trees`), where link states are those of trees.
    pub link_state_model: Option<PathBuf>,
    /// Localization.
    pub localization: Option<LocalizationChoice>,
    /// Direction of departure of the line of sight.
    pub departures: Option<DepartureChoice>,
    /// Paths that may become points.
    pub mapped: Option<MappedChoice>,
    /// Where the GMT was set up.
    pub gmt_setup: GmtSetup,
    /// The earth's field where the UAV flies.
    pub magnetic_field: Option<EarthField>,
    /// Height of the ground, m, world frame.
    pub ground_z_m: Option<f64>,
    /// What calibration leaves in a path.
    pub residuals: ResidualFigures,
    /// The error-state filter.
    pub filter: FilterFigures,
    /// The paper's localization.
    pub baseline: BaselineFigures,
    /// Data association.
    pub association: AssociationFigures,
    /// The surfaces that it associates with.
    pub surfaces: SurfaceFigures,
}

impl ReceiverConfig {
    /// The methods of a mode in every stage.
    pub fn of(mode: Mode) -> Self {
        Self {
            mode,
            ..Self::default()
        }
    }

    /// Checks every figure.
    ///
    /// # Errors
    /// [`InputError`] naming the key and what was expected.
    pub fn check(&self) -> Result<(), InputError> {
        self.gmt_setup.check().map_err(|error| error.under("gmt_setup"))?;
        if let Some(z_m) = self.ground_z_m
            && !(-HIGHEST_M..=HIGHEST_M).contains(&z_m)
        {
            let message = format!("is {z_m}, expected -{HIGHEST_M} to {HIGHEST_M}");
            return Err(InputError::at_key("ground_z_m", message));
        }
        if let Some(field) = &self.magnetic_field {
            field.check().map_err(|error| error.under("magnetic_field"))?;
        }
        self.residuals.check().map_err(|error| error.under("residuals"))?;
        self.filter.check().map_err(|error| error.under("filter"))?;
        self.baseline.check().map_err(|error| error.under("baseline"))?;
        self.association
            .check()
            .map_err(|error| error.under("association"))?;
        self.surfaces.check().map_err(|error| error.under("surfaces"))
    }
}

/// Whose methods.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Ours in every stage
    #[default]
    Best,
    /// The paper's in every stage
    Paper,
}

impl Mode {
    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Best => "best",
            Self::Paper => "paper",
        }
    }
}

/// Who says what a path is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LinkStateChoice {
    /// Trees, every path, by all but its departure: where data association weighs that
    Trees,
    /// Geometric networks, every path, with its departure: the default where paths are mapped one by one
    Geometric,
    /// The paper's network, the strongest path
    Paper,
    /// Rules of geometry, every path
    Rules,
}

/// Where the pose comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LocalizationChoice {
    /// Error-state filter
    Filter,
    /// The same without the growth of paths from sweep to sweep
    FilterNoDeltaRanges,
    /// The same without how fast paths grow by their pilots
    FilterNoRangeRates,
    /// The paper's periodic calibration, velocity from the fixes, gated by the paper's network
    Baseline,
    /// The same to the letter, velocity running free
    BaselineLiteral,
}

/// Where the direction in which the line of sight left the GMT comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DepartureChoice {
    /// The sweep's beams, together with beam squint (maximum likelihood) where they leave it open
    Fit,
    /// Beam squint, parabola
    Parabola,
    /// Beam squint, strongest subcarrier
    Pick,
    /// The sweep's beams
    Beams,
}

impl DepartureChoice {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fit => "fit",
            Self::Parabola => "parabola",
            Self::Pick => "pick",
            Self::Beams => "beams",
        }
    }
}

/// Which paths may become points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MappedChoice {
    /// Every path, of several reflections where confirmed surfaces explain it
    Every,
    /// Paths of one reflection
    FirstOrder,
    /// The strongest path
    Strongest,
}

/// Table `[receiver.gmt_setup]`: where whoever set the GMT up says that its antenna is. A first beacon further off is refused.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GmtSetup {
    /// Place of the antenna, [x, y, z] in m, world frame. Without one a simulation takes where its GMT truly stands at first, and
    /// a board does not ask.
    pub position_m: Option<[f64; 3]>,
    /// How far from there the first beacon may be, m.
    pub within_m: f64,
}

impl Default for GmtSetup {
    /// A metre: a place that was paced off from a mark of the world frame.
    fn default() -> Self {
        Self {
            position_m: None,
            within_m: 1.0,
        }
    }
}

/// World coordinates of a GMT's antenna, m either way: beyond, the world frame is no plane.
const FARTHEST_M: f64 = 100_000.0;

impl GmtSetup {
    /// For the flight code, with another place where none is said; `None` when there is neither.
    pub fn or_at(&self, position_m: Option<[f64; 3]>) -> Option<Setup> {
        Some(Setup {
            position_m: self.position_m.or(position_m)?.into(),
            within_m: self.within_m,
        })
    }

    /// For the settings of a board, in whole millimetres.
    pub fn for_board(&self) -> Option<GmtPlace> {
        // In range: checked.
        let position_mm = self.position_m?.map(|c| (c * 1e3).round() as i32);
        GmtPlace::new(position_mm, (self.within_m * 1e3).ceil() as u32)
    }

    fn check(&self) -> Result<(), InputError> {
        let beyond = |c: &&f64| !(-FARTHEST_M..=FARTHEST_M).contains(*c);
        if let Some(c) = self.position_m.iter().flatten().find(beyond) {
            let message = format!("holds {c}, expected -{FARTHEST_M} to {FARTHEST_M}");
            return Err(InputError::at_key("position_m", message));
        }
        if !(0.001..=FARTHEST_M).contains(&self.within_m) {
            let message = format!("is {}, expected 0.001 to {FARTHEST_M}", self.within_m);
            return Err(InputError::at_key("within_m", message));
        }
        Ok(())
    }
}

/// Table `[receiver.magnetic_field]`: the earth's field where the UAV flies. All three or none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EarthField {
    /// Strength, uT.
    pub strength_ut: f64,
    /// Angle below the horizon, deg.
    pub inclination_deg: f64,
    /// Angle of magnetic north east of true north, deg.
    pub declination_deg: f64,
}

impl From<&MagnetometerConfig> for EarthField {
    /// The field of a simulated flight.
    fn from(earth: &MagnetometerConfig) -> Self {
        Self {
            strength_ut: earth.field_ut,
            inclination_deg: earth.inclination_deg,
            declination_deg: earth.declination_deg,
        }
    }
}

impl EarthField {
    /// For the flight code.
    pub fn config(&self) -> MagneticField {
        MagneticField::new(
            self.strength_ut as f32,
            self.inclination_deg.to_radians() as f32,
            self.declination_deg.to_radians() as f32,
        )
    }

    /// For the settings of a board, in nT and thousandths of a degree.
    pub fn for_board(&self) -> Option<storage::EarthField> {
        // In range: checked.
        let [strength_nt, inclination_mdeg, declination_mdeg] =
            [self.strength_ut, self.inclination_deg, self.declination_deg].map(|c| (c * 1e3).round() as i32);
        storage::EarthField::new(strength_nt, inclination_mdeg, declination_mdeg)
    }

    fn check(&self) -> Result<(), InputError> {
        // The earth's is 22 to 67 uT.
        within(&[
            ("strength_ut", self.strength_ut, 1.0, 100.0),
            ("inclination_deg", self.inclination_deg, -90.0, 90.0),
            ("declination_deg", self.declination_deg, -180.0, 180.0),
        ])
    }
}

//! What the receiver is set to: which method each stage uses.
//!
//! Every stage has the paper's method and ours, and each can be switched alone, so that an ablation is a change of one
//! field. [`Config::best`] and [`Config::paper`] are the two whole modes of docs/signal-model.md, "Default configuration"; path estimation
//! itself is chosen by type, see [`super::Receiver`].

use core::num::NonZeroU32;

use super::SURFACES;
use super::gain::LinkBudget;
use super::receive::Residuals;
use super::rules::Rules;
use crate::association::AssociationConfig;
use crate::beam_squint::BeamSquintConfig;
use crate::estimator::baseline;
use crate::estimator::{self, FilterConfig};
use crate::field::{FieldError, Range, all_in, wide};
use crate::geometry::Position;
use crate::inertial::{ImuConfig, MagneticField, RestConfig};
use crate::link_state::{AcceptGate, Classifier, PaperClassifier, PathClassifier};
use crate::radio::RadioConfig;
use crate::reflection::{Form, Gates};
use crate::surfaces::{SurfaceConfig, Surfaces};

/// How the pose is found, and with it what a path must be to correct it.
#[derive(Clone, Copy, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "there is no heap, and a receiver has one"
)]
pub enum Localization<'m> {
    /// Error-state filter. The first path corrects it where length, direction and strength are those of a line of sight.
    Filter(FilterConfig),
    /// The paper's periodic calibration. The strongest path corrects it where this network says that the link state is line
    /// of sight; what the pose says of the path does not count, for nothing tells this pose that it has drifted.
    Baseline(BaselineConfig, PaperClassifier<'m>),
}

impl Localization<'_> {
    /// The filter's gates.
    pub(super) fn gates(&self) -> Option<estimator::Gates> {
        match self {
            Self::Filter(config) => Some(config.gates),
            Self::Baseline(..) => None,
        }
    }
}

/// Figures of the paper's localization.
/// Given: the paper's method, a baseline, and what the gates need of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaselineConfig {
    /// Where the velocity between fixes comes from.
    pub mode: baseline::Mode,
    /// Sweeps between fixes: the paper's T_c.
    pub interval_sweeps: NonZeroU32,
    /// Standard deviation that is claimed for its position, m per axis: HPC has none of its own, the gates need one.
    pub position_sigma_m: f32,
    /// The same of its attitude, rad per axis.
    pub attitude_sigma_rad: f32,
}

impl Default for BaselineConfig {
    /// A fix every second sweep (docs/signal-model.md, "Default configuration"); 0.3 m and 0.5 degrees.
    fn default() -> Self {
        Self {
            mode: baseline::Mode::default(),
            interval_sweeps: NonZeroU32::new(2).unwrap_or(NonZeroU32::MIN),
            position_sigma_m: 0.3,
            attitude_sigma_rad: 0.009,
        }
    }
}

impl BaselineConfig {
    /// Whether every number can be.
    ///
    /// # Errors
    /// [`FieldError`] naming the first one that cannot.
    pub fn check(&self) -> Result<(), FieldError> {
        let above = [
            ("position_sigma_m", self.position_sigma_m),
            ("attitude_sigma_rad", self.attitude_sigma_rad),
        ];
        all_in(Range::AboveZero, &above.map(wide))
    }
}

/// Where the direction in which the line of sight left the GMT comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Departures {
    /// The sweep's beams; where they leave it open, together with beam squint, maximum likelihood.
    #[default]
    SquintFit,
    /// Beam squint, parabola on the log power.
    SquintParabola,
    /// Beam squint, strongest subcarrier: the paper's rule.
    SquintPick,
    /// The sweep's beams alone.
    Beams,
}

/// Of which sweeps the pilots are read: how fast paths grow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Pilots {
    /// Of none: how fast paths grow is not used, whoever tells it.
    Unread,
    /// Of those in which there is a pose and more than one path, where the filter uses them.
    #[default]
    WithPose,
    /// Of every sweep: for whoever keeps paths, to fly them with another receiver.
    EverySweep,
}

/// Which paths are used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Mapped {
    /// Every path that confirmed surfaces explain ([`crate::association`]): a point for each of its reflections.
    #[default]
    Every,
    /// Every path that the network takes for one reflection: the closed form's point.
    FirstOrder,
    /// The same of the strongest path only, as the paper does.
    Strongest,
}

/// Everything that is set before a flight.
#[derive(Clone, Debug)]
pub struct Config<'m, Description = RadioConfig> {
    /// The radio. Nothing of it is checked here ([`RadioConfig::check`]).
    pub radio: Description,
    /// Link budget.
    pub budget: LinkBudget,
    /// What calibration leaves in a path.
    pub residuals: Residuals,
    /// Inertial sensor.
    pub imu: ImuConfig,
    /// Alignment at rest.
    pub rest: RestConfig,
    /// The earth's field, whose heading a start must not contradict; `None` leaves the magnetometer unused.
    pub magnetic_field: Option<MagneticField>,
    /// Pose.
    pub localization: Localization<'m>,
    /// Direction of departure of the line of sight.
    pub departures: Departures,
    /// Errors that beam squint reckons with.
    pub beam_squint: BeamSquintConfig,
    /// What each path is.
    pub link_states: LinkStates<'m>,
    /// When a path alone is taken for one reflection, where data association is not asked; and the ground's height at the start,
    /// where that is known.
    pub accept: AcceptGate,
    /// Paths that are used.
    pub mapped: Mapped,
    /// Closed form of the reflection point, where data association is not asked.
    pub form: Form,
    /// Data association.
    pub association: AssociationConfig,
    /// Surfaces that paths are associated with.
    pub surfaces: SurfaceConfig,
    /// Whether reflections off confirmed surfaces hold the pose without line of sight.
    pub map_aided: bool,
    /// Whether the growth of paths from sweep to sweep holds the velocity without line of sight. Range rates do in either case, where pilots are read ([`Self::pilots`]).
    pub delta_ranges: bool,
    /// Of which sweeps the pilots are read: how fast paths grow tells the velocity.
    pub pilots: Pilots,
}

/// Who says what a path is.
#[derive(Clone, Copy, Debug)]
pub enum LinkStates<'m> {
    /// Trees, path by path: without departures, which data association weighs ([`Mapped::Every`]).
    Trees(PathClassifier<'m>),
    /// The geometric networks, path by path.
    Geometric(Classifier<'m>),
    /// The paper's network, for the strongest path.
    Paper(PaperClassifier<'m>),
    /// Rules of geometry, path by path.
    Rules(Rules),
}

/// What a configuration cannot be: the field, in the words of [`ConfigError::field`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ConfigError {
    /// `radio.squint_scheme` has not as many symbols a face as the receiver's type says, or the waveform not as many subcarriers.
    Squint,
}

impl ConfigError {
    /// Name of the field that is wrong.
    #[must_use]
    pub fn field(self) -> &'static str {
        match self {
            Self::Squint => "radio.squint_scheme",
        }
    }

    /// What was expected of it.
    #[must_use]
    pub fn expected(self) -> &'static str {
        match self {
            Self::Squint => "as many symbols a face, on as many subcarriers, as the receiver's type says",
        }
    }
}

impl core::fmt::Display for ConfigError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}: expected {}", self.field(), self.expected())
    }
}

impl core::error::Error for ConfigError {}

impl<'m, Description> Config<'m, Description> {
    /// Surfaces before anything is known of them: the ground alone, where its height is.
    #[must_use]
    pub fn no_surfaces(&self) -> Surfaces<SURFACES> {
        let ground_z_m = self.accept.point.ground_z_m;
        let beneath = ground_z_m.and_then(|z_m| Position::new(0.0, 0.0, z_m).ok());
        beneath.map_or_else(
            || Surfaces::new(self.surfaces),
            |beneath| Surfaces::with_ground(self.surfaces, beneath),
        )
    }

    /// Whether every number behind the radio can be ([`RadioConfig::check`] is the radio's).
    ///
    /// # Errors
    /// [`FieldError`] naming the first one that cannot, with the part that it stands in.
    pub fn check(&self) -> Result<(), FieldError> {
        self.residuals.check().map_err(|error| error.under("residuals"))?;
        self.imu.check().map_err(|error| error.under("imu"))?;
        self.rest.check().map_err(|error| error.under("rest"))?;
        match &self.localization {
            Localization::Filter(filter) => filter.check(),
            Localization::Baseline(baseline, _) => baseline.check(),
        }
        .map_err(|error| error.under("localization"))?;
        self.beam_squint
            .check()
            .map_err(|error| error.under("beam_squint"))?;
        self.association
            .check()
            .map_err(|error| error.under("association"))?;
        self.surfaces.check().map_err(|error| error.under("surfaces"))
    }

    /// Our methods throughout, for a radio of one's own.
    #[must_use]
    pub fn of(radio: Description, link_states: LinkStates<'m>) -> Self {
        Self {
            radio,
            budget: LinkBudget::default(),
            residuals: Residuals::default(),
            imu: ImuConfig::default(),
            rest: RestConfig::default(),
            magnetic_field: None,
            localization: Localization::Filter(FilterConfig::default()),
            departures: Departures::SquintFit,
            beam_squint: BeamSquintConfig::default(),
            link_states,
            accept: AcceptGate {
                point: Gates {
                    // Paths of a whole sweep are known several times better than those that the classifier is made for, and
                    // nine points of ten to 0.5 m: the few that are no better only blur the map.
                    max_sigma_m: 0.5,
                    ground_z_m: Some(0.0),
                    ..AcceptGate::default().point
                },
                ..AcceptGate::default()
            },
            mapped: Mapped::Every,
            form: Form::Vector,
            association: AssociationConfig::default(),
            surfaces: SurfaceConfig::default(),
            map_aided: true,
            delta_ranges: true,
            pilots: Pilots::default(),
        }
    }
}

impl<'m> Config<'m> {
    /// Our methods throughout.
    #[must_use]
    pub fn best(link_states: LinkStates<'m>) -> Self {
        Self::of(RadioConfig::default(), link_states)
    }

    /// The paper's methods in every stage but path estimation, which is a type: its network on the strongest path, its closed
    /// form without our gates, its calibration with the strongest subcarrier, gated by its network.
    #[must_use]
    pub fn paper(network: PaperClassifier<'m>) -> Self {
        Self {
            localization: Localization::Baseline(BaselineConfig::default(), network),
            departures: Departures::SquintPick,
            accept: AcceptGate {
                min_probability: 0.0,
                point: Gates::open(),
            },
            mapped: Mapped::Strongest,
            form: Form::Paper,
            ..Self::best(LinkStates::Paper(network))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_receiver_can_reckon_with_is_named_with_its_part() {
        let config = Config::best(LinkStates::Rules(Rules::default()));
        assert_eq!(config.check(), Ok(()));
        let wrong = |change: fn(&mut Config<'_>)| {
            let mut config = config.clone();
            change(&mut config);
            config.check().map_err(|error| (error.table, error.field))
        };
        let of = |table, field| Err((Some(table), field));
        assert_eq!(wrong(|c| c.residuals.delay_m = 0.0), of("residuals", "delay_m"));
        assert_eq!(wrong(|c| c.imu.step_ns = 0), of("imu", "step_ns"));
        assert_eq!(wrong(|c| c.rest.blocks = 0), of("rest", "blocks"));
        let filter = |c: &mut Config<'_>| {
            if let Localization::Filter(filter) = &mut c.localization {
                filter.gates.one = f64::NAN;
            }
        };
        assert_eq!(wrong(filter), of("localization", "gates.one"));
        assert_eq!(
            wrong(|c| c.beam_squint.delay_sigma_m = -1.0),
            of("beam_squint", "delay_sigma_m")
        );
        assert_eq!(
            wrong(|c| c.association.explained = 1.0),
            of("association", "explained")
        );
        assert_eq!(wrong(|c| c.surfaces.detection = 0.0), of("surfaces", "detection"));
    }
}

//! What can be set about a world besides its scene and its seed, and the three worlds that have names.

use clap::ValueEnum;
use cslam_core::profile::quad_4x8_gmt_72::{BEAMS, CHANNELS};
use serde::{Deserialize, Serialize};

use super::{PropagationConfig, SceneConfig};
use crate::channel::ChannelConfig;
use crate::flight::FlightConfig;
use crate::input::InputError;
use crate::scene::Scene;
use crate::sensors::{ImuConfig, SensorsConfig};

/// A world by name: the defaults of every figure of a [`WorldConfig`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Profile {
    /// The paper's: specular reflections off one material, no errors but thermal noise. For checking equations
    Ideal,
    /// Specular reflections off one material; arrays and sensors err as the receiver's error budget says
    Budget,
    /// Diffraction, diffuse scattering and a material for each wall; errors that the receiver has no model of
    // The default of every command and program: what the receiver does where its assumptions hold says little of what it will do.
    #[default]
    Real,
}

impl Profile {
    /// Its name, as in a configuration.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ideal => "ideal",
            Self::Budget => "budget",
            Self::Real => "real",
        }
    }
}

/// Everything that can be set about a world besides its scene and its seed. The default is that of the default profile.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WorldConfig {
    /// Whose defaults fill what is not said.
    pub profile: Profile,
    /// What becomes of the scene.
    pub scene: SceneConfig,
    /// How waves travel.
    pub propagation: PropagationConfig,
    /// What the flight is like.
    pub flight: FlightConfig,
    /// Errors of the sensors.
    pub sensors: SensorsConfig,
    /// Errors of the arrays and the front end. Attitude, motion and clock come from the flight.
    pub channel: ChannelConfig,
}

impl Default for WorldConfig {
    fn default() -> Self {
        Self::of(Profile::default())
    }
}

impl WorldConfig {
    /// The figures of a profile. The parts of a configuration begin with those of [`Profile::Budget`], from which the others differ.
    pub fn of(profile: Profile) -> Self {
        let budget = Self {
            profile,
            scene: SceneConfig::default(),
            propagation: PropagationConfig::default(),
            flight: FlightConfig::default(),
            sensors: SensorsConfig::default(),
            channel: ChannelConfig::default(),
        };
        match profile {
            Profile::Budget => budget,
            Profile::Ideal => Self {
                sensors: SensorsConfig {
                    imu: noise_alone(&budget.sensors.imu),
                    ..SensorsConfig::ideal()
                },
                channel: ChannelConfig::ideal(),
                ..budget
            },
            Profile::Real => Self {
                scene: SceneConfig::real(),
                propagation: PropagationConfig::real(),
                flight: FlightConfig::real(),
                sensors: SensorsConfig::real(),
                channel: ChannelConfig::real(),
                profile,
            },
        }
    }

    /// Loads a scene ([`Scene::load`]) as this world has it: with a material for each wall, if these are to be drawn, with thin
    /// walls, its surfaces off its faces, and where it shall stand.
    ///
    /// # Errors
    /// [`InputError`] naming the name or the file, and what was expected.
    pub fn scene(&self, name_or_file: &str) -> Result<Scene, InputError> {
        let mut scene = Scene::load(name_or_file)?;
        if self.propagation.draws_materials() {
            scene = scene.with_drawn_materials();
        }
        if self.propagation.transmission {
            scene = scene.with_sheets();
        }
        self.scene.applied(scene)
    }

    /// Checks every figure, for a world of the default radio.
    ///
    /// # Errors
    /// [`InputError`] naming the key and what was expected.
    pub fn check(&self) -> Result<(), InputError> {
        self.check_with(CHANNELS, BEAMS)
    }

    /// The same for a radio of so many channels and beams.
    pub(super) fn check_with(&self, channels: usize, beams: usize) -> Result<(), InputError> {
        self.scene.check().map_err(|error| error.under("scene"))?;
        self.propagation
            .check()
            .map_err(|error| error.under("propagation"))?;
        self.flight.check()?;
        self.sensors.check().map_err(|error| error.under("sensors"))?;
        self.channel
            .check_with(channels, beams)
            .map_err(|error| error.under("channel"))
    }
}

/// An inertial sensor without an error but its white noise: one whose values stand still at rest is broken for a receiver.
fn noise_alone(imu: &ImuConfig) -> ImuConfig {
    ImuConfig {
        gyro_noise_mdps_per_sqrt_hz: imu.gyro_noise_mdps_per_sqrt_hz,
        accel_noise_ug_per_sqrt_hz: imu.accel_noise_ug_per_sqrt_hz,
        ..ImuConfig::ideal()
    }
}

//! The UAV's sensors and the GMT's beacon: what the receiver gets besides radio samples.
//!
//! Each sensor has a configuration (defaults at the budget of design section 6, `ideal()` for none of the errors) and a
//! small state. [`SensedFlight`] joins them with a planned flight: its [`events`](SensedFlight::events) are all that a
//! receiver may see, in order and stamped by the UAV clock; its [`truth`](SensedFlight::truth) is for the channel and
//! for evaluation. What fails in a flight is configured too: [`faults`].

mod air;
mod barometer;
mod beacon;
mod clock;
mod config;
mod drift;
mod events;
pub mod faults;
mod g_sensitivity;
mod imu;
mod imu_chip;
mod low_pass;
mod magnetometer;
mod mounting;
mod sampling;
mod sensed_flight;
mod site;
mod static_run;
mod temperature;
mod timing;
mod vibration;
mod wall_iron;

pub use air::{OverAir, WordLink, WordPath, WordRadio};
pub use barometer::{Barometer, BarometerConfig, BarometerSample, PRESSURE_PER_CODE_PA};
pub use beacon::{Beacon, BeaconConfig, Beacons, true_gmt_attitude};
pub use clock::{Clock, ClockConfig};
pub use config::SensorsConfig;
use config::{at_most_one, divides_a_second, not_negative};
pub use drift::BiasDrift;
pub(crate) use events::KINDS;
pub use events::{Event, Events, Stamped};
pub use faults::{BeaconFault, ClockStep, FaultsConfig, Faulty, TimingFault};
pub use g_sensitivity::GSensitivityConfig;
pub use imu::{DPS_RAD_PER_S, Imu, ImuConfig, MICRO_G_M_PER_S2};
pub use imu_chip::{ChipSample, ImuChip, ImuChipConfig};
pub use magnetometer::{
    FIELD_CODE_MAX, FIELD_PER_CODE_UT, Magnetometer, MagnetometerConfig, MagnetometerSample,
};
pub use mounting::MountingConfig;
pub use sampling::SamplingConfig;
pub use sensed_flight::{SensedFlight, Truth};
pub use site::Site;
pub use static_run::{Characterisation, static_run};
pub use temperature::TemperatureConfig;
pub use timing::{Timing, TimingConfig, TimingSample};
pub use vibration::VibrationConfig;
pub use wall_iron::WallIron;

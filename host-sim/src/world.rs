//! The world around a receiver: a scene with a flight through it, heard through channel and front end.
//!
//! This is where the parts meet: the flight says where the two ends are, the tracer which paths there are between them,
//! the channel what the front end makes of these. Each sweep depends on the world and its number only, so sweeps may be
//! made in any order, on any thread.

use cslam_core::array::SquintScheme;
use cslam_core::geometry::{GeometryError, Rotation};
use serde::{Deserialize, Serialize};

use crate::channel::{ChannelConfig, Instant, Simulator, Sweep};
use crate::flight::{FlightConfig, FlightPlan};
use crate::input::InputError;
use crate::paths::Link;
use crate::scene::Scene;
use crate::sensors::{SensedFlight, SensorsConfig, Truth};
use crate::tracer::{DEFAULT_MAX_ORDER, Tracer};

/// Everything that can be set about a world besides its scene and its seed. The default has every error at the budget.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WorldConfig {
    /// What the flight is like.
    pub flight: FlightConfig,
    /// Errors of the sensors.
    pub sensors: SensorsConfig,
    /// Errors of the arrays and the front end. Attitude, motion and clock come from the flight.
    pub channel: ChannelConfig,
}

impl WorldConfig {
    /// Checks every figure.
    ///
    /// # Errors
    /// [`InputError`] naming the key and what was expected.
    pub fn check(&self) -> Result<(), InputError> {
        self.flight.check()?;
        self.sensors.check()?;
        self.channel
            .check()
            .map_err(|message| InputError::new(format!("channel.{message}")))
    }
}

/// A scene with a flight through it.
#[derive(Debug)]
pub struct World<'s> {
    tracer: Tracer<'s>,
    flight: SensedFlight,
    simulator: Simulator,
}

/// What one sweep of the transmit beams left at the receiver, and the truth behind it.
#[derive(Clone, Debug)]
pub struct HeardSweep {
    /// Number of the sweep.
    pub number: u32,
    /// Blocks of the transmit beams.
    pub beams: Sweep,
    /// Blocks of the beam squint symbols that follow them (sequential scheme).
    pub squint: Sweep,
    /// The world at the first beam: not for the receiver.
    pub truth: Truth,
    /// The true paths: not for the receiver.
    pub link: Link,
}

impl<'s> World<'s> {
    /// Plans a flight through a scene and sets up its sensors and its channel; `seed` decides all of it.
    ///
    /// # Errors
    /// [`InputError`] naming a figure of the configuration that is out of range, or saying that no flight was found.
    pub fn new(scene: &'s Scene, config: WorldConfig, seed: u64) -> Result<Self, InputError> {
        config.check()?;
        let tracer = Tracer::new(scene, DEFAULT_MAX_ORDER)
            .ok_or_else(|| InputError::new("more reflections are asked for than the tracer can follow"))?;
        let plan = FlightPlan::plan(scene, &config.flight, seed)?;
        Ok(Self {
            tracer,
            flight: SensedFlight::new(plan, config.sensors, seed)?,
            simulator: Simulator::new(config.channel, seed),
        })
    }

    /// The flight with its sensors.
    pub fn flight(&self) -> &SensedFlight {
        &self.flight
    }

    /// Number of sweeps.
    pub fn sweeps(&self) -> u32 {
        self.flight.plan().sweeps()
    }

    /// Traces, synthesises and digitises a sweep.
    ///
    /// # Errors
    /// [`InputError`] naming the sweep when a path cannot be synthesised.
    pub fn sweep(&self, sweep: u32) -> Result<HeardSweep, InputError> {
        let truth = self.flight.sweep_truth(sweep);
        let failed = |reason: String| InputError::new(format!("sweep {sweep}: {reason}"));
        let tree = self.tracer.transmitter(truth.gmt_position_m.into());
        let rx_m: [f64; 3] = truth.uav.position_m.into();
        let link = tree.to_link(rx_m, &tree.trace(rx_m));
        let instant = instant(&truth).map_err(|e| failed(e.to_string()))?;
        let beams = self
            .simulator
            .sweep(&link, &instant, sweep)
            .map_err(|e| failed(e.to_string()))?;
        let squint = self
            .simulator
            .squint(&link, &instant, sweep, SquintScheme::Sequential)
            .map_err(|e| failed(e.to_string()))?;
        Ok(HeardSweep {
            number: sweep,
            beams,
            squint,
            truth,
            link,
        })
    }
}

/// The truth as the channel takes it.
///
/// # Errors
/// [`GeometryError`] for an attitude that is no rotation: none that a flight gives.
pub fn instant(truth: &Truth) -> Result<Instant, GeometryError> {
    let gmt = nalgebra::UnitQuaternion::from_rotation_matrix(&truth.gmt_attitude);
    Ok(Instant {
        attitude: Rotation::from_quaternion(truth.uav.quaternion_wb())?,
        velocity_m_per_s: truth.uav.velocity_m_per_s,
        gmt_attitude: Rotation::from_quaternion([gmt.w, gmt.i, gmt.j, gmt.k])?,
        gmt_velocity_m_per_s: truth.gmt_velocity_m_per_s,
        clock_offset_s: truth.clock_offset_s,
        clock_drift: truth.clock_drift,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two seconds in a small room: four sweeps.
    fn short() -> WorldConfig {
        let flight = FlightConfig {
            duration_s: 2.0,
            rest_s: 0.5,
            ..FlightConfig::default()
        };
        WorldConfig {
            flight,
            ..WorldConfig::default()
        }
    }

    #[test]
    fn a_sweep_depends_on_the_world_and_its_number_only() {
        let scene = Scene::load("outdoor").expect("built in");
        let world = World::new(&scene, short(), 3).expect("a flight");
        let again = World::new(&scene, short(), 3).expect("a flight");
        assert_eq!(world.sweeps(), 4);
        let late = world.sweep(3).expect("sound");
        let _ = again.sweep(0).expect("sound");
        let same = again.sweep(3).expect("sound");
        assert_eq!(
            (&late.beams, &late.squint, &late.link),
            (&same.beams, &same.squint, &same.link)
        );
        assert_eq!((late.beams.blocks.len(), late.squint.blocks.len()), (72, 33));
        let other = World::new(&scene, short(), 4)
            .expect("a flight")
            .sweep(3)
            .expect("sound");
        assert_ne!(late.beams, other.beams);
    }

    #[test]
    fn both_ends_are_where_the_flight_says() {
        let scene = Scene::load("outdoor").expect("built in");
        let world = World::new(&scene, short(), 3).expect("a flight");
        let heard = world.sweep(2).expect("sound");
        let truth = world.flight().sweep_truth(2);
        assert_eq!(heard.link.rx, <[f64; 3]>::from(truth.uav.position_m));
        assert_eq!(heard.link.tx, <[f64; 3]>::from(truth.gmt_position_m));
        let instant = instant(&truth).expect("sound");
        assert!((instant.attitude.matrix() - truth.uav.attitude.matrix()).norm() < 1e-12);
        assert!((instant.gmt_attitude.matrix() - truth.gmt_attitude.matrix()).norm() < 1e-12);
    }

    #[test]
    fn a_wrong_figure_is_named() {
        let scene = Scene::load("outdoor").expect("built in");
        let mut config = short();
        config.channel.front_end.adc_bits = 3;
        let error = World::new(&scene, config, 1)
            .expect_err("out of range")
            .to_string();
        assert!(
            error.contains("channel.") && error.contains("adc_bits"),
            "{error}"
        );
    }
}

//! What stands and moves around a flight beside the scene, and the links that it leaves.

use super::PropagationConfig;
use crate::flight::FlightPlan;
use crate::input::InputError;
use crate::movers::Movers;
use crate::paths::Link;
use crate::scene::Scene;
use crate::sensors::Truth;
use crate::tracer::{Bodies, Tracer};

/// Movers around a flight.
#[derive(Clone, Debug, Default)]
pub(super) struct Surroundings {
    movers: Movers,
}

impl Surroundings {
    /// Finds places for them.
    ///
    /// # Errors
    /// [`InputError`] naming a given mover that has no room.
    pub(super) fn place(
        scene: &Scene,
        config: &PropagationConfig,
        plan: &FlightPlan,
        seed: u64,
    ) -> Result<Self, InputError> {
        Ok(Self {
            movers: Movers::place(scene, &config.movers, plan, seed)?,
        })
    }

    /// The link between both ends at an instant.
    pub(super) fn link(&self, tracer: &Tracer<'_>, truth: &Truth) -> Link {
        let tree = tracer.transmitter(truth.gmt_position_m.into());
        let rx_m: [f64; 3] = truth.uav.position_m.into();
        let mut paths = tree.trace(rx_m);
        if !self.movers.is_empty() {
            let bodies = self.movers.at(truth.time_s);
            let bodies = Bodies::new(&bodies, tracer.scene(), tracer.propagation());
            paths = bodies.among(&tree, rx_m, paths);
        }
        tree.to_link(rx_m, &paths)
    }
}

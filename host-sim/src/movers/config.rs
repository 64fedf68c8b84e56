//! What can be set about movers: how many are drawn, and which ones are given.

use serde::{Deserialize, Serialize};

use super::BodyKind;
use crate::input::{InputError, within};
use crate::scene::MAX_COORDINATE_M;

/// Most movers for each unit of ground.
const MOST_DENSE: f64 = 100.0;

/// Movers of a world. The default is none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MoversConfig {
    /// Cars that stand, for each hectare of a scene under the sky.
    pub parked_cars_per_ha: f64,
    /// Cars that drive, for each hectare of a scene under the sky.
    pub moving_cars_per_ha: f64,
    /// People, for each hectare of a scene under the sky.
    pub people_per_ha: f64,
    /// People, for each 100 m^2 of a scene under a roof.
    pub people_per_100_m2: f64,
    /// Movers on lines of their own, beside those that are drawn.
    pub given: Vec<GivenMover>,
}

/// A mover that goes back and forth between two places.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GivenMover {
    /// What it is.
    pub kind: BodyKind,
    /// Where its middle turns, and stands at the start of the flight: x and y, m, frame of the scene's file.
    pub from_m: [f64; 2],
    /// Where it turns next; the same place for one that stands.
    pub to_m: [f64; 2],
    /// Speed between the turns, m/s.
    pub speed_m_per_s: f64,
}

impl MoversConfig {
    /// 8 parked and 4 moving cars and 10 people a hectare; 6 people for 100 m^2 indoors.
    pub fn real() -> Self {
        Self {
            parked_cars_per_ha: 8.0,
            moving_cars_per_ha: 4.0,
            people_per_ha: 10.0,
            people_per_100_m2: 6.0,
            given: Vec::new(),
        }
    }

    /// Checks every figure.
    ///
    /// # Errors
    /// [`InputError`] naming the key and what was expected.
    pub fn check(&self) -> Result<(), InputError> {
        let densities = [
            ("parked_cars_per_ha", self.parked_cars_per_ha),
            ("moving_cars_per_ha", self.moving_cars_per_ha),
            ("people_per_ha", self.people_per_ha),
            ("people_per_100_m2", self.people_per_100_m2),
        ];
        for (key, value) in densities {
            within(&[(key, value, 0.0, MOST_DENSE)])?;
        }
        for (place, mover) in self.given.iter().enumerate() {
            let table = format!("given[{place}]");
            let ends = [("from_m", mover.from_m), ("to_m", mover.to_m)];
            let check = || {
                for (key, ends) in ends {
                    for value in ends {
                        within(&[(key, value, -MAX_COORDINATE_M, MAX_COORDINATE_M)])?;
                    }
                }
                within(&[("speed_m_per_s", mover.speed_m_per_s, 0.0, 60.0)])
            };
            check().map_err(|error| error.under(&table))?;
        }
        Ok(())
    }
}

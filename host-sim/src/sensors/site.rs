//! What the place of a flight does to sensors.

use super::WallIron;

/// Ground and walls around a flight. By default level ground at 0, and no iron.
#[derive(Clone, Debug, Default)]
pub struct Site {
    /// Mean height of the ground, m, world frame: what is over it presses air against it.
    pub ground_z_m: f64,
    /// Iron in the walls.
    pub iron: WallIron,
}

//! Boards instead of solid plaster: walls that waves go through.

use super::{Material, Scene};

/// Thickness of a plasterboard, m. A wall is two of them with air between.
const BOARD_M: f64 = 0.0125;

impl Scene {
    /// Makes every face of plasterboard without a thickness a board of 12.5 mm: a wall of two faces is two boards.
    #[must_use]
    pub fn with_sheets(mut self) -> Self {
        let plaster = Material::named("plasterboard");
        for material in &mut self.materials {
            if Some(*material) == plaster
                && let Some(board) = material.slab(BOARD_M)
            {
                *material = board;
            }
        }
        self
    }
}

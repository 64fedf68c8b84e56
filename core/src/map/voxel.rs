//! Cubes of space with integer coordinates.

use core::fmt;

use crate::geometry::{Position, World};

/// Integer coordinates of a cube of space: `floor(coordinate / edge)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Voxel([i16; 3]);

/// A point that no voxel can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum VoxelError {
    /// The point is more than 32 767 voxels from the origin.
    OutOfRange,
}

impl fmt::Display for VoxelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the point is more than 32767 voxels from the origin")
    }
}

impl core::error::Error for VoxelError {}

impl Voxel {
    /// The voxel of a position, for cubes of the given edge length.
    ///
    /// # Errors
    /// [`VoxelError::OutOfRange`] when a coordinate does not fit 16 bits: at the default edge of 0.25 m, 8 km from the
    /// origin.
    pub fn containing(position: &Position<World>, edge_m: f32) -> Result<Self, VoxelError> {
        let mut coordinates = [0; 3];
        for (coordinate, value) in coordinates.iter_mut().zip(position.to_array()) {
            let cell = libm::floorf(value / edge_m);
            // Written so that NaN fails as well.
            if !(cell >= f32::from(i16::MIN) && cell <= f32::from(i16::MAX)) {
                return Err(VoxelError::OutOfRange);
            }
            *coordinate = cell as i16;
        }
        Ok(Self(coordinates))
    }

    /// A well-mixed 32-bit hash: neighbouring voxels must not share a chain.
    pub(super) fn hash(self) -> u32 {
        let mut h = 0_u32;
        for c in self.0 {
            h = (h ^ u32::from(c.cast_unsigned())).wrapping_mul(0x9e37_79b1);
            h ^= h >> 15;
        }
        h
    }
}

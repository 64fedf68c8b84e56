//! Points in a frame.

use core::marker::PhantomData;

use nalgebra::Vector3;

use super::{Frame, GeometryError, Real, World};

/// A point in frame `F`, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position<F: Frame = World, T: Real = f32> {
    vector: Vector3<T>,
    frame: PhantomData<F>,
}

impl<F: Frame, T: Real> Position<F, T> {
    /// A point from its coordinates, m.
    ///
    /// # Errors
    /// [`GeometryError::NotFinite`] when a coordinate is NaN or infinite.
    pub fn new(x_m: T, y_m: T, z_m: T) -> Result<Self, GeometryError> {
        Self::from_vector(Vector3::new(x_m, y_m, z_m))
    }

    /// A point from its coordinate vector, m.
    ///
    /// # Errors
    /// [`GeometryError::NotFinite`] when a coordinate is NaN or infinite.
    pub fn from_vector(vector: Vector3<T>) -> Result<Self, GeometryError> {
        if vector.iter().all(|c| c.is_finite()) {
            Ok(Self {
                vector,
                frame: PhantomData,
            })
        } else {
            Err(GeometryError::NotFinite)
        }
    }

    /// Coordinate vector, m.
    pub fn vector(&self) -> &Vector3<T> {
        &self.vector
    }

    /// Coordinates [x, y, z], m.
    pub fn to_array(&self) -> [T; 3] {
        [self.vector.x, self.vector.y, self.vector.z]
    }

    /// Vector from `origin` to this point, m.
    pub fn from_origin(&self, origin: &Self) -> Vector3<T> {
        self.vector - origin.vector
    }

    /// Distance to another point, m.
    pub fn distance_m(&self, other: &Self) -> T {
        self.from_origin(other).norm_squared().root()
    }
}

impl<F: Frame> Position<F> {
    /// The same point in double precision.
    #[must_use]
    pub fn to_f64(&self) -> Position<F, f64> {
        Position {
            vector: self.vector.map(f64::from),
            frame: PhantomData,
        }
    }
}

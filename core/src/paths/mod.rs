//! What path estimation hands on: a path of a sweep, and what is claimed of it.

mod covariance;
mod received;

pub use covariance::{Neighbourhood, PathErrors, covariance, departure_outliers, neighbourhood};
pub use received::ReceivedPath;

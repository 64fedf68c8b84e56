//! How far the horizon may go ahead of a sweep.

use super::Filter;
use crate::geometry::Real;

impl<T: Real, const N: usize> Filter<T, N> {
    /// Moves the horizon to `time_ns`, for a sweep that has that time stamp and is still being worked on: so that what is
    /// left to do when it is done are the updates. Nothing older can be taken in afterwards.
    pub fn advance(&mut self, time_ns: u64) {
        self.advance_to(time_ns);
    }
}

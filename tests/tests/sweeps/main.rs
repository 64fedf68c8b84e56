//! Whole sweeps through the path estimator.

mod recordings;
mod screening;

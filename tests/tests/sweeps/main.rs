//! Whole sweeps through the path estimator: here, and with the feature `emulated` on the emulated chip too.

#[cfg(feature = "emulated")]
mod chip;
#[cfg(feature = "emulated")]
mod cost;
#[cfg(feature = "emulated")]
mod golden;
mod recorder;
#[cfg(feature = "emulated")]
mod recordings;
mod screening;
mod work;

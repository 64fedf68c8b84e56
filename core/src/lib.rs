//! The receiver of a UAV that sees with radio: everything that flies.
//!
//! A UAV hears a ground mobile transmitter (GMT) at 30 GHz. From the strongest propagation paths of that link this
//! crate solves where the wave was reflected and collects the reflection points into a bounded point cloud map.
//! Data falls through floors and never climbs back:
//!
//! [`path`] (a measured propagation path) -> [`reflection`] (closed form, gates, covariance) -> [`map`] (bounded
//! point cloud) -> [`telemetry`] (packets). [`geometry`] and [`constants`] stand on the ground floor.
//!
//! The method is that of Z. Mou and F. Gao, "Millimeter Wave Wireless Communication Assisted Three-Dimensional
//! Simultaneous Localization and Mapping"; `docs/signal-model.md` of the repository has the formulas and where this crate
//! departs from the paper, `docs/localization.md` the filter.
//!
//! # Conventions
//! - World frame east-north-up, body frame forward-left-up, metres. Frames are types: see [`geometry`].
//! - `zenith` is the angle from +z (0 = up, 0..pi), `azimuth` is `atan2(y, x)` in (-pi, pi].
//! - Delays are lengths: `c_tau_m` is the speed of light times the absolute delay.
//! - Names carry units where a type does not (`_m`, `_rad`, `_s`, `_hz`, `_db`).
//!
//! # What is promised
//! - `no_std`, no heap, no recursion, no `unsafe` but for one file of assembly (where the target has the DSP instructions of ARM); every capacity is a
//!   const generic.
//! - Bad input gives a typed error that names what was wrong; nothing is dropped without a counter.
//! - Floating point uses only `+ - * /`, square root and [`libm`], so a host and a chip compute the same bits.
//!
//! # What is not
//! The types keep frames apart, not instants: a direction measured at one attitude and turned by another is still a
//! well-typed world direction.
#![no_std]

pub mod array;
pub mod association;
pub mod block;
mod bounded;
mod checksum;
pub mod constants;
pub mod cslam;
pub mod geometry;
pub mod localization;
pub mod lscn;
pub mod ltd;
pub mod map;
pub mod path;
pub mod paths;
pub mod reflection;
#[cfg(dsp_kernels)]
mod simd;
mod sqrt;
pub mod surfaces;
pub mod telemetry;
pub mod waveform;

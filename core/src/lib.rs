//! The receiver of a UAV that sees with radio: everything that flies.
//!
//! A UAV hears a ground mobile transmitter (GMT) at 30 GHz. From the strongest propagation paths of that link this
//! crate solves where the wave was reflected and collects the reflection points into a bounded point cloud map.
//! Data goes one way, and modules import downwards only (`tests/floors.toml` is the list, from the ground up):
//!
//! | module | what it does |
//! |---|---|
//! | [`kernels`], [`constants`] | integer kernels, portable and in DSP instructions; constants of nature |
//! | [`geometry`], [`path`], [`array`](mod@array) | frames, directions, planes; a propagation path; elements, codebook, beam squint of arrays |
//! | [`signal`] | int16 samples of a beam -> taps and power-delay profile |
//! | [`radio`] | waveform, arrays and beams that a receiver is made for, as one description |
//! | [`reflection`] | where a path was reflected: closed form, gates, covariance |
//! | [`link_state`] | the networks: line of sight, one reflection, or else (the paper's LSCN) |
//! | [`paths`] | taps -> delays, angles, powers of the paths, and their covariance (the paper's LTD) |
//! | [`surfaces`] | planes that reflect: tentative, confirmed, with what was seen of them |
//! | [`inertial`] | inertial sensor, magnetometer -> increments, attitude at rest |
//! | [`beam_squint`] | bearing of the line of sight from beam squint symbols (the paper's BSM) |
//! | [`estimator`] | pose, clock, calibration: error-state filter; the paper's HPC as the baseline |
//! | [`association`] | which surfaces made a path |
//! | [`map`] | bounded point cloud |
//! | [`receiver`] | all of it, once a sweep (the paper's Algorithm 1) |
//! | [`telemetry`] | packets to and from the ground |
//!
//! The method is that of Z. Mou and F. Gao, "Millimeter Wave Wireless Communication Assisted Three-Dimensional
//! Simultaneous Localization and Mapping"; `docs/signal-model.md` of the repository has the formulas, `docs/paper-to-code.md`
//! where this crate departs from the paper, `docs/localization.md` the filter.
//!
//! # Quick start
//! The default geometry has names in [`profile`]: an estimator takes the samples of the transmit beams, strongest first, and gives the
//! paths of the sweep. **Each beam has an exponent of its own** (amplitude = integer x 2^exponent): one for all gives paths that look
//! right and are wrong.
//! ```
//! use cslam_core::paths::{EstimatedPath, PathEstimator};
//! use cslam_core::profile::{Block, FlightConfig, FlightEstimator};
//! use cslam_core::signal::Iq;
//!
//! let mut estimator = FlightEstimator::checked(&FlightConfig::default())?;
//! let mut samples = Box::new([[Iq::ZERO; 512]; 32]); // of a front end; 32 channels, array-major
//! for (beam, exponent) in [(17, -38), (16, -39)] {
//!     estimator.push_beam(Block { samples: &mut samples, beam, exponent });
//! }
//! println!("{}", EstimatedPath::COLUMNS);
//! for path in &estimator.finish() {
//!     println!("{path}");
//! }
//! # Ok::<(), cslam_core::paths::EstimatorConfigError>(())
//! ```
//! Where a path was reflected, if it was reflected once:
//! ```
//! use cslam_core::geometry::{Direction, Matrix3, Position, Vector3};
//! use cslam_core::path::{Path, diagonal_covariance};
//! use cslam_core::reflection::{Ends, Form, Gates, Verdict, solve};
//!
//! let ends: Ends = Ends {
//!     uav: Position::new(12.0, 40.0, 6.0)?,
//!     uav_covariance: Matrix3::identity() * 0.05 * 0.05,
//!     gmt: Position::new(12.0, 0.0, 2.0)?,
//! };
//! let path = Path {
//!     c_tau_m: 46.818,
//!     aoa: Direction::from_vector(Vector3::new(-12.0, -20.0, -2.0))?, // towards where the wave came from, world axes
//!     aod: None,
//!     covariance: diagonal_covariance(0.05, 2e-3),
//! };
//! let verdict = solve(&ends, &path, Form::Vector, &Gates::default())?;
//! assert!(matches!(verdict, Verdict::Accepted(point) if point.position.to_array()[0].abs() < 0.01)); // the wall x = 0
//! # Ok::<(), cslam_core::reflection::InputError>(())
//! ```
//! The folder `examples` has more: a recorded sweep, link states, arrays of one's own, static memory.
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
#![cfg_attr(docsrs, feature(doc_cfg))]

#[cfg(feature = "watch")]
extern crate alloc;

pub mod array;
pub mod association;
pub mod beam_squint;
pub mod constants;
pub mod estimator;
pub mod field;
pub mod geometry;
pub mod inertial;
pub mod kernels;
pub mod link_state;
pub mod map;
mod numeric;
pub mod path;
pub mod paths;
pub mod profile;
pub mod radio;
pub mod receiver;
pub mod reflection;
pub mod signal;
pub mod surfaces;
pub mod telemetry;

//! Measurements as records of fixed size: what the path estimator, or a host in its place, hands to the receiver.
//!
//! # Layout
//! [`LENGTH`] bytes, little endian, version 1. Numbers are IEEE 754 binary32 and travel as bits, so NaN and infinity
//! arrive as such and are the receiver's to judge.
//!
//! | offset | kind 1, path | kind 2, end of stream |
//! |---|---|---|
//! | 0 | kind, u8 | kind, u8 |
//! | 1 | version, u8 | version, u8 |
//! | 2 | flags, u8: bit 0 = angle of departure present | 0 |
//! | 3 | index of the path in its link, u8 | 0 |
//! | 4 | index of the link, u32 | number of path records sent, u32 |
//! | 8 | UAV position in the world, 3 x f32, m | 0 |
//! | 20 | its covariance, upper triangle by rows, 6 x f32, m^2 | 0 |
//! | 44 | GMT position in the world, 3 x f32, m | 0 |
//! | 56 | c tau, f32, m | 0 |
//! | 60 | angle of arrival in the world, vector, 3 x f32 | 0 |
//! | 72 | covariance of (c tau, e1, e2), upper triangle by rows, 6 x f32 | 0 |
//! | 96 | angle of departure in the world, vector, 3 x f32, or 0 | 0 |
//! | 108 | its standard deviation, f32, rad, or 0 | 0 |
//! | 112 | CRC-32/ISO-HDLC of bytes 0..112, u32 | the same |

mod codec;
mod error;
mod path;

pub use codec::{LENGTH, Record, VERSION};
pub use error::RecordError;
pub use path::{DepartureRecord, PathRecord};

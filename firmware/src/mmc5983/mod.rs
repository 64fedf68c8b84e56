//! The magnetometer: MEMSIC MMC5983MA (data sheet revision A), over I2C.
//!
//! The sensor's bridges have an offset of their own that drifts with temperature. A pulse through its coil, SET, magnetizes them one way, another,
//! RESET, the other way, which turns the sign of what they measure and not that of the offset: half the difference of a measurement after each is
//! the field without the offset. Every sample here is such a pair.

mod driver;
mod error;

pub use driver::{Field, Mmc5983};
pub use error::MagnetometerError;

/// Answer to PRODUCT_ID.
const IDENTITY: u8 = 0x30;

/// Field of a code, uT: 16 384 codes a gauss, 18 bits for 8 gauss each way.
pub const FIELD_PER_CODE_UT: f32 = 100.0 / 16_384.0;
/// Code of no field.
pub const ZERO_CODE: u32 = 1 << 17;
/// Largest code.
pub const CODE_MAX: u32 = (1 << 18) - 1;

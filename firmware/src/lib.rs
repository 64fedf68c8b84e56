//! Binds the receiver to a chip.
//!
//! The library half is what every board shares, and it knows no chip: frames of the front end and records of the sensors come in
//! through a [`ring`] in shared memory or a driver, the application ([`app`]) runs `cslam-core` on them and queues packets for the radio.
//! It builds on a host too, where the simulator and the tests use it as the golden model: the same bytes in give the same bytes out,
//! on x86 and on the chip.
//!
//! A binary per board (`src/bin`) adds memory, UART, clock and log. A board is chosen by a feature; see `build.rs`.
#![no_std]

#[cfg(feature = "watch")]
extern crate alloc;

pub mod app;
pub mod board;
pub mod clock;
pub mod fault;
pub mod front_end;
pub mod icm42688;
pub mod log;
pub mod mmc5983;
pub mod mpu;
#[cfg(test)]
#[path = "../tests/common/random.rs"]
mod random;
pub mod ring;
pub mod sensor_stream;
pub mod storage;
pub mod supervisor;

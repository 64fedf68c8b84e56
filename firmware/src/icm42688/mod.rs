//! The inertial sensor: TDK InvenSense ICM-42688-P (data sheet DS-000347).
//!
//! [`Icm42688`] starts the sensor and reads its FIFO after every edge of the data-ready line; what comes out are
//! [`ImuSample`](cslam_core::inertial::ImuSample)s by the UAV clock, and exact counts of what did not. [`packet`] is the
//! format of the FIFO, which the simulated sensor writes and this driver reads.

mod driver;
mod error;
mod fifo;
pub mod packet;
mod registers;
mod timebase;

pub use driver::Icm42688;
pub use error::ImuError;
pub use fifo::{BURST, Fifo, ImuCounters, Next, Samples, TRANSFER};
pub use packet::{PACKET_LEN, PacketError, RawSample};

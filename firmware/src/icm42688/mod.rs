//! The inertial sensor: TDK InvenSense ICM-42688-P (data sheet DS-000347).

pub mod packet;

pub use packet::{PACKET_LEN, PacketError, RawSample};

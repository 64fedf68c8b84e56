//! A queue of fixed-size records in memory that two parties share: one writes, one reads.
//!
//! On a flight controller the other party is a DMA channel or a second core, under emulation a process of the host that
//! has the same memory as a file. So the ring does not trust it: geometry and indices are checked before every use, and
//! what is wrong comes back as a [`RingError`]. How memory is reached is the business of [`SharedMemory`].
//!
//! # Layout
//! Little endian, version 1:
//!
//! | offset | content |
//! |---|---|
//! | 0 | magic `CSLR` (written last: a ring without it is not ready) |
//! | 4 | version, u32 |
//! | 8 | slot size, bytes, u32 |
//! | 12 | number of slots, a power of two, u32 |
//! | 32 | head, u32: records published since the start, wrapping; then its complement |
//! | 64 | tail, u32: records taken since the start, wrapping; then its complement |
//! | 128 | slots |
//!
//! Head and tail have a cache line each because each has one writer. Each is followed by its complement because a file's
//! write, or a DMA transfer, is not one store: a reader takes the complement first and then the index, in the reverse
//! order of the writer, and uses the pair only when it agrees.

mod consumer;
mod error;
mod header;
mod memory;
mod producer;

pub use consumer::Consumer;
pub use error::RingError;
pub use header::{HEADER_LENGTH, MAGIC, VERSION, region_length};
pub use memory::{AccessError, SharedMemory};
pub use producer::Producer;

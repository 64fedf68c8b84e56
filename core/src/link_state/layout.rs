//! Figures of a model file that its errors name too.

/// Version of the layout that this crate reads and writes.
pub const VERSION: u16 = 1;
/// What the address of the first byte is a multiple of.
pub const ALIGNMENT: usize = 4;
/// Bytes before the names.
pub const HEADER: usize = 24;
/// Largest magnitude of a bias: keeps sums within `i32`.
pub const MAX_BIAS: i32 = 1 << 30;

//! Streams of random numbers of a sweep, one for each thing that is drawn.

/// Streams of a sweep: its noise, and what is drawn per beam.
pub(super) fn stream(index: u32, symbol: usize, kind: u64) -> u64 {
    (kind << 56) | (u64::from(index) << 16) | symbol as u64
}
pub(super) const NOISE: u64 = 0;
pub(super) const PER_BEAM: u64 = 1;
pub(super) const JAMMED: u64 = 2;
pub(super) const PHASE_NOISE: u64 = 3;
pub(super) const CONVERTER: u64 = 4;
pub(super) const BURSTS: u64 = 5;
pub(super) const BURST_NOISE: u64 = 6;
pub(super) const PHASE_WALK: u64 = 7;

//! What real hardware does beyond the receiver's assumptions, one effect a file (docs/signal-model.md, "Hardware of the
//! simulation").

pub(super) mod airframe;
pub(super) mod amplifier;
pub(super) mod carrier_offset;
pub(super) mod converter;
pub(super) mod coupling;
pub(super) mod cross_polarisation;
pub(super) mod drift;
pub(super) mod interference;
pub(super) mod phase_noise;
pub(super) mod phase_walk;
pub(super) mod quadrature;
pub(super) mod ripple;
pub(super) mod rotors;
pub(super) mod slow;

use crate::random::Stream;

/// What is drawn once for a device. The number of a draw is part of what a seed means: add at the end, never renumber.
#[derive(Clone, Copy, Debug)]
#[repr(u64)]
pub(super) enum Draw {
    UavPhase,
    UavAxis,
    UavDelay,
    GmtPhase,
    GmtDelay,
    UavGain,
    UavCentre,
    Coupling,
    Ripple,
    Drift,
    Temperature,
    GmtGain,
    CarrierOffset,
    Quadrature,
    Leakage,
    Neighbour,
    Rotors,
    GmtAxis,
    GmtCentre,
    CrossPolarisation,
}

/// High bit of the stream numbers of device errors; those of sweeps have it clear.
const DEVICE: u64 = 1 << 63;

impl Draw {
    /// Its stream.
    pub(super) fn stream(self, seed: u64) -> Stream {
        Stream::new(seed, DEVICE | self as u64)
    }
}

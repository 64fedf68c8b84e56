//! What stands before every body.

use super::{HEADER_LENGTH, VERSION};

/// Which way a packet goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Direction {
    /// From the UAV to the ground.
    Down,
    /// From the ground to the UAV.
    Up,
}

/// The second byte's highest bit: the packet goes up.
const UP: u8 = 0x80;
/// The next one: an authentication code follows the body.
const SIGNED: u8 = 0x40;
/// The others: the kind of the message.
const KIND: u8 = 0x3f;

/// Header of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) direction: Direction,
    pub(super) signed: bool,
    pub(super) kind: u8,
    pub(super) uav: u8,
    pub(super) counter: u32,
}

impl Header {
    pub(super) fn encode(self) -> [u8; HEADER_LENGTH] {
        let up = if self.direction == Direction::Up { UP } else { 0 };
        let signed = if self.signed { SIGNED } else { 0 };
        let [a, b, c, d] = self.counter.to_be_bytes();
        [VERSION, up | signed | (self.kind & KIND), self.uav, a, b, c, d]
    }

    /// The version comes first, so that it can be told from damage whatever follows it.
    pub(super) fn decode([_version, what, uav, a, b, c, d]: [u8; HEADER_LENGTH]) -> Self {
        Self {
            direction: if what & UP != 0 {
                Direction::Up
            } else {
                Direction::Down
            },
            signed: what & SIGNED != 0,
            kind: what & KIND,
            uav,
            counter: u32::from_be_bytes([a, b, c, d]),
        }
    }
}

/// Copies `from` into `to` at an offset and returns where it ends.
pub(super) fn put(to: &mut [u8], at: usize, from: &[u8]) -> Option<usize> {
    let end = at.checked_add(from.len())?;
    for (to, from) in to.get_mut(at..end)?.iter_mut().zip(from) {
        *to = *from;
    }
    Some(end)
}

//! MAVLink 2 framing: start byte, header, payload without its trailing zeros, checksum.

use std::collections::BTreeMap;

use crc::{CRC_16_MCRF4XX, Crc};

use super::messages::Message;

/// First byte of every MAVLink 2 frame.
const START: u8 = 0xfd;

/// CRC-16/MCRF4XX, which MAVLink calls X.25.
const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_MCRF4XX);

/// Component that speaks: a visual or, here, radio odometry (MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY).
pub(super) const COMPONENT: u8 = 197;

/// Numbers and frames messages, each system by itself.
#[derive(Clone, Debug, Default)]
pub struct Framer {
    sequences: BTreeMap<u8, u8>,
}

impl Framer {
    /// One frame of a system.
    pub fn frame(&mut self, system: u8, message: &Message) -> Vec<u8> {
        let (id, extra, mut payload) = message.encode();
        while payload.len() > 1 && payload.last() == Some(&0) {
            payload.pop();
        }
        let sequence = self.sequences.entry(system).or_default();
        let [low, middle, high, _] = id.to_le_bytes();
        // No signature, no other incompatible or compatible feature.
        let header = [
            payload.len() as u8,
            0,
            0,
            *sequence,
            system,
            COMPONENT,
            low,
            middle,
            high,
        ];
        *sequence = sequence.wrapping_add(1);
        let mut digest = CRC.digest();
        digest.update(&header);
        digest.update(&payload);
        // What the message's fields are is part of the checksum, so that two ends with other ideas of it do not understand each other.
        digest.update(&[extra]);
        let mut frame = vec![START];
        frame.extend(header);
        frame.extend(payload);
        frame.extend(digest.finalize().to_le_bytes());
        frame
    }
}

#[cfg(test)]
mod tests {
    use super::super::messages::Heartbeat;
    use super::*;

    #[test]
    fn frames_are_numbered_by_system_and_shortened() {
        let mut framer = Framer::default();
        let heartbeat = Message::Heartbeat(Heartbeat { is_active: true });
        let first = framer.frame(7, &heartbeat);
        let second = framer.frame(7, &heartbeat);
        let other = framer.frame(8, &heartbeat);
        assert_eq!((first[4], second[4], other[4]), (0, 1, 0));
        assert_eq!(
            (first[0], first[5], first[6], &first[7..10]),
            (START, 7, COMPONENT, &[0, 0, 0][..])
        );
        // 10 bytes of header, 2 of checksum.
        assert_eq!(first.len(), 12 + usize::from(first[1]));
    }
}

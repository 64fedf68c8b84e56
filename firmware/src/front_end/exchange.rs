//! A two-way timing exchange in the header of a begin (docs/front-end.md section 6.2).
//!
//! The front end measures it by its samples, since nothing else on the board is fine enough: a tick of the receiver's timer is 100 ns,
//! the time stamp in a header is cut to nanoseconds, and 0.3 ns are wanted. The bytes are zero where there is no exchange.
//!
//! | offset | type | content |
//! |---|---|---|
//! | 48 | u32 | number of the exchange, 0 for none |
//! | 52 | i32 | clock offset, whole samples |
//! | 56 | u16 | what is added to it, in 1/65 536 of a sample |

use super::HEADER_LENGTH;

/// Where it lies in the header.
const AT: usize = 48;
/// Samples per second: the waveform's (docs/signal-model.md, "Default configuration").
const SAMPLES_HZ: f64 = 245.76e6;
/// Steps of the phase in a sample: 62 fs each.
const STEPS: f64 = 65_536.0;

/// A two-way exchange as the front end has measured it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Exchange {
    /// Its number, never 0. The front end repeats an exchange in every sweep until it has a newer one.
    pub number: u32,
    /// The UAV's sampling clock less the GMT's at the first sample of the sweep: whole samples, rounded down.
    pub samples: i32,
    /// What is left, in 1/65 536 of a sample.
    pub phase: u16,
}

impl Exchange {
    /// The exchange in a header whose checksum has been found right.
    #[must_use]
    pub fn of(header: &[u8; HEADER_LENGTH]) -> Option<Self> {
        let &[n0, n1, n2, n3, s0, s1, s2, s3, p0, p1] = header.get(AT..).and_then(<[u8]>::first_chunk)?;
        let number = u32::from_le_bytes([n0, n1, n2, n3]);
        (number != 0).then_some(Self {
            number,
            samples: i32::from_le_bytes([s0, s1, s2, s3]),
            phase: u16::from_le_bytes([p0, p1]),
        })
    }

    /// Puts it into a header, as a front end does; the checksum of the header follows.
    pub fn put(&self, header: &mut [u8; HEADER_LENGTH]) {
        let [n0, n1, n2, n3] = self.number.to_le_bytes();
        let [s0, s1, s2, s3] = self.samples.to_le_bytes();
        let [p0, p1] = self.phase.to_le_bytes();
        if let Some(place) = header.get_mut(AT..).and_then(<[u8]>::first_chunk_mut) {
            *place = [n0, n1, n2, n3, s0, s1, s2, s3, p0, p1];
        }
        super::header::seal(header);
    }

    /// UAV clock less GMT clock, s: exact to a hundredth of a picosecond.
    #[must_use]
    pub fn clock_offset_s(&self) -> f64 {
        (f64::from(self.samples) + f64::from(self.phase) / STEPS) / SAMPLES_HZ
    }
}

#[cfg(test)]
mod tests {
    use cslam_core::signal::Waveform;

    use super::super::{Header, Kind, Status};
    use super::*;

    fn begin() -> Header {
        Header {
            kind: Kind::Begin,
            session: 7,
            sequence: 0,
            sweep: 11,
            index: 129,
            exponent: 0,
            sweep_ns: 5_000_000_000,
            offset_ns: 0,
            powers: false,
            payload_checksum: 0,
            dropped: 0,
            status: Status(0),
        }
    }

    #[test]
    fn a_header_carries_it_and_stays_a_header() {
        assert_eq!(Exchange::of(&begin().encode()), None);
        for (samples, phase) in [(0, 0), (-1, 65_535), (i32::MAX, 1), (i32::MIN, 32_768)] {
            let exchange = Exchange {
                number: 9,
                samples,
                phase,
            };
            let mut bytes = begin().encode();
            exchange.put(&mut bytes);
            assert_eq!(Exchange::of(&bytes), Some(exchange));
            assert_eq!(Header::decode(&bytes), Ok(begin()));
        }
    }

    #[test]
    fn an_offset_is_known_to_less_than_a_picosecond() {
        assert_eq!(SAMPLES_HZ, Waveform::default().sample_rate_hz);
        let exchange = |samples, phase| Exchange {
            number: 1,
            samples,
            phase,
        };
        for offset_s in [0.0, 1.25e-6, -1.25e-6, 0.3e-9, -8.0, 8.0] {
            let steps = f64::floor(offset_s * SAMPLES_HZ * STEPS + 0.5);
            let whole = f64::floor(steps / STEPS);
            let found = exchange(whole as i32, (steps - whole * STEPS) as u16).clock_offset_s();
            assert!(
                (found - offset_s).abs() < 0.05e-12,
                "{found}, expected {offset_s}"
            );
        }
        // A sample is 4.07 ns.
        assert!((exchange(1, 0).clock_offset_s() - 4.069_010_416e-9).abs() < 1e-17);
    }
}

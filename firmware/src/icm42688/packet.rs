//! What the FIFO delivers: integer codes in the 20-byte packets of the high-resolution mode.
//!
//! Packet 4 of the data sheet (section 6.1), big-endian: header, accelerometer x y z bits 19..4 (two bytes each), gyroscope
//! likewise, temperature (two bytes), time stamp (two bytes, wrapping, ticks of 32/30 us by the
//! chip's own clock: section 12.7), then three bytes with bits 3..0 of the
//! accelerometer (high nibble) and the gyroscope (low nibble) of each axis. In this mode the full scales are fixed at
//! 16 g and 2000 deg/s; of the 20 bits the accelerometer fills the upper 18 and the gyroscope the upper 19.

use core::f64::consts::PI;
use core::fmt;

use cslam_core::constants::STANDARD_GRAVITY_M_PER_S2;
use cslam_core::inertial::ImuSample;
use nalgebra::Vector3;

/// Acceleration of one accelerometer code, m/s^2: 8192 codes a g.
pub const ACCELERATION_PER_CODE_M_PER_S2: f64 = STANDARD_GRAVITY_M_PER_S2 / 8192.0;
/// Angular rate of one gyroscope code, rad/s: 131.072 codes a degree per second (2^18 codes for 2000 deg/s).
pub const RATE_PER_CODE_RAD_PER_S: f64 = 2000.0 / 262_144.0 * PI / 180.0;
/// Largest accelerometer code, 18 bits. The most negative code of either sensor marks an invalid sample and is never a
/// measurement, so the range is symmetric.
pub const ACCELERATION_CODE_MAX: i32 = (1 << 17) - 1;
/// Largest gyroscope code, 19 bits.
pub const RATE_CODE_MAX: i32 = (1 << 18) - 1;

/// Bytes of a packet.
pub const PACKET_LEN: usize = 20;
/// Accelerometer and gyroscope present, 20-bit data, time stamp of the output data rate.
const HEADER: u8 = 0b0111_1000;
/// Set when the FIFO had nothing to read.
const HEADER_EMPTY: u8 = 0b1000_0000;
/// Set in the first packet after the data rate of a sensor has changed: of no meaning here.
const HEADER_RATE_CHANGED: u8 = 0b0000_0011;
/// Bits of the last three bytes that are zero: two of the accelerometer's 20, one of the gyroscope's.
const UNUSED_BITS: u8 = 0b0011_0001;

/// Why bytes of the FIFO are no sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum PacketError {
    /// The FIFO was empty: more was read than it had.
    Empty,
    /// Another kind of packet than the one that was asked for.
    Header {
        /// Header found.
        found: u8,
    },
    /// Bits are set that a sensor of fewer than 20 bits leaves zero.
    UnusedBits,
    /// The sensor itself says that an axis has no measurement yet, as just after it was turned on.
    NotReady,
}

impl fmt::Display for PacketError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => f.write_str("the FIFO was empty: read no more packets than its counter says"),
            Self::Header { found } => write!(
                f,
                "packet header {found:#04x}, expected {HEADER:#04x}: the FIFO is out of step or set up otherwise, flush it"
            ),
            Self::UnusedBits => {
                f.write_str("bits are set that the sensor leaves zero: check the SPI clock's rate and mode")
            }
            Self::NotReady => f.write_str("an axis has no measurement: the sensor is still starting"),
        }
    }
}

impl core::error::Error for PacketError {}

/// One sample as integer codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RawSample {
    /// Accelerometer codes x, y, z, body axes; [`ACCELERATION_PER_CODE_M_PER_S2`] each.
    pub acceleration: [i32; 3],
    /// Gyroscope codes x, y, z, body axes; [`RATE_PER_CODE_RAD_PER_S`] each.
    pub rate: [i32; 3],
    /// Temperature code: 25 degrees Celsius + code / 132.48.
    pub temperature: i16,
    /// The chip's own time stamp, ticks of 32/30 us by its own clock (sections 12.7 and 4.10: within 3.5 % of the UAV's), wrapping at 2^16.
    pub time_ticks: u16,
}

impl RawSample {
    /// Specific force in body axes, m/s^2.
    #[must_use]
    pub fn specific_force_m_per_s2(&self) -> Vector3<f64> {
        Vector3::from(self.acceleration).map(|code| f64::from(code) * ACCELERATION_PER_CODE_M_PER_S2)
    }

    /// Angular rate in body axes, rad/s.
    #[must_use]
    pub fn rate_rad_per_s(&self) -> Vector3<f64> {
        Vector3::from(self.rate).map(|code| f64::from(code) * RATE_PER_CODE_RAD_PER_S)
    }

    /// Whether any axis is at the end of its range.
    #[must_use]
    pub fn is_saturated(&self) -> bool {
        self.acceleration.iter().any(|c| c.abs() >= ACCELERATION_CODE_MAX)
            || self.rate.iter().any(|c| c.abs() >= RATE_CODE_MAX)
    }

    /// The sample in units, at the time by the UAV clock at which its interval ended, ns. Products in double precision,
    /// rounded once.
    #[must_use]
    pub fn at(&self, time_ns: u64) -> ImuSample {
        ImuSample {
            time_ns,
            rate_rad_per_s: self.rate_rad_per_s().map(|c| c as f32),
            specific_force_m_per_s2: self.specific_force_m_per_s2().map(|c| c as f32),
        }
    }

    /// The packet as it lies in the FIFO.
    #[must_use]
    pub fn to_packet(&self) -> [u8; PACKET_LEN] {
        let high = |code: i32| ((code >> 4) as i16).to_be_bytes();
        let [ax, ay, az] = self.acceleration.map(|code| code << 2);
        let [gx, gy, gz] = self.rate.map(|code| code << 1);
        let low = |a: i32, g: i32| ((a & 15) << 4 | g & 15) as u8;
        let ([a0, a1], [a2, a3], [a4, a5]) = (high(ax), high(ay), high(az));
        let ([g0, g1], [g2, g3], [g4, g5]) = (high(gx), high(gy), high(gz));
        let ([t0, t1], [s0, s1]) = (self.temperature.to_be_bytes(), self.time_ticks.to_be_bytes());
        let [l0, l1, l2] = [low(ax, gx), low(ay, gy), low(az, gz)];
        [
            HEADER, a0, a1, a2, a3, a4, a5, g0, g1, g2, g3, g4, g5, t0, t1, s0, s1, l0, l1, l2,
        ]
    }

    /// Reads a packet.
    ///
    /// # Errors
    /// [`PacketError`].
    pub fn from_packet(packet: &[u8; PACKET_LEN]) -> Result<Self, PacketError> {
        let &[
            found,
            a0,
            a1,
            a2,
            a3,
            a4,
            a5,
            g0,
            g1,
            g2,
            g3,
            g4,
            g5,
            t0,
            t1,
            s0,
            s1,
            l0,
            l1,
            l2,
        ] = packet;
        if found & HEADER_EMPTY != 0 {
            return Err(PacketError::Empty);
        }
        if found & !HEADER_RATE_CHANGED != HEADER {
            return Err(PacketError::Header { found });
        }
        if (l0 | l1 | l2) & UNUSED_BITS != 0 {
            return Err(PacketError::UnusedBits);
        }
        let acceleration = |high, low: u8| i32::from(i16::from_be_bytes(high)) << 2 | i32::from(low >> 6);
        let rate = |high, low: u8| i32::from(i16::from_be_bytes(high)) << 3 | i32::from(low & 15) >> 1;
        let sample = Self {
            acceleration: [
                acceleration([a0, a1], l0),
                acceleration([a2, a3], l1),
                acceleration([a4, a5], l2),
            ],
            rate: [rate([g0, g1], l0), rate([g2, g3], l1), rate([g4, g5], l2)],
            temperature: i16::from_be_bytes([t0, t1]),
            time_ticks: u16::from_be_bytes([s0, s1]),
        };
        let invalid = sample.acceleration.contains(&(-ACCELERATION_CODE_MAX - 1))
            || sample.rate.contains(&(-RATE_CODE_MAX - 1));
        if invalid {
            Err(PacketError::NotReady)
        } else {
            Ok(sample)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_g_and_one_degree_per_second_have_the_data_sheet_codes() {
        let sample = RawSample {
            acceleration: [8192, 0, -8192],
            rate: [131_072, -131_072, 131],
            temperature: 0,
            time_ticks: 0,
        };
        let force = sample.specific_force_m_per_s2();
        assert!((force.x - 9.80665).abs() < 1e-12 && (force.z + 9.80665).abs() < 1e-12);
        let rate = sample.rate_rad_per_s().map(|r| r * 180.0 / PI);
        assert!((rate.x - 1000.0).abs() < 1e-9 && (rate.y + 1000.0).abs() < 1e-9);
        assert!((rate.z - 0.99945).abs() < 1e-5);
    }

    #[test]
    fn a_packet_has_the_layout_of_the_data_sheet() {
        let sample = RawSample {
            acceleration: [0x1_2345 & 0x1_ffff, -1, 3],
            rate: [0x2_468a, -2, 7],
            temperature: -300,
            time_ticks: 0xbeef,
        };
        let packet = sample.to_packet();
        // 0x12345 << 2 = 0x48d14 (20 bits): high word 0x48d1, low nibble 4. 0x2468a << 1 = 0x48d14 as well.
        assert_eq!(packet[0], 0x78);
        assert_eq!(packet[1..3], [0x48, 0xd1]);
        assert_eq!(packet[7..9], [0x48, 0xd1]);
        assert_eq!(packet[17], 0x44);
        assert_eq!(packet[3..5], [0xff, 0xff]);
        assert_eq!(packet[13..15], (-300i16).to_be_bytes());
        assert_eq!(packet[15..17], [0xbe, 0xef]);
    }

    #[test]
    fn every_code_survives_the_packet() {
        for code in (-ACCELERATION_CODE_MAX..=ACCELERATION_CODE_MAX).step_by(37) {
            let sample = RawSample {
                acceleration: [code, -code, ACCELERATION_CODE_MAX],
                rate: [2 * code, 2 * code + 1, -RATE_CODE_MAX],
                temperature: code as i16,
                time_ticks: code as u16,
            };
            assert_eq!(RawSample::from_packet(&sample.to_packet()), Ok(sample));
        }
    }

    #[test]
    fn foreign_packets_are_refused() {
        let sample = RawSample {
            acceleration: [1, 2, 3],
            rate: [4, 5, 6],
            temperature: 7,
            time_ticks: 8,
        };
        let with = |at: usize, byte: u8| {
            let mut packet = sample.to_packet();
            packet[at] = byte;
            RawSample::from_packet(&packet)
        };
        for found in [0x68, 0x58, 0x38, 0x70, 0x7c, 0x00] {
            assert_eq!(with(0, found), Err(PacketError::Header { found }));
        }
        assert_eq!(with(0, 0xff), Err(PacketError::Empty));
        assert_eq!(with(0, 0x7b), Ok(sample), "the data rate has just changed");
        for bit in [0, 4, 5] {
            let byte = sample.to_packet()[18] ^ 1 << bit;
            assert_eq!(with(18, byte), Err(PacketError::UnusedBits), "bit {bit}");
        }
    }

    #[test]
    fn the_most_negative_code_is_no_measurement() {
        for axis in 0..6 {
            let mut sample = RawSample {
                acceleration: [-ACCELERATION_CODE_MAX; 3],
                rate: [-RATE_CODE_MAX; 3],
                temperature: 0,
                time_ticks: 0,
            };
            assert_eq!(RawSample::from_packet(&sample.to_packet()), Ok(sample));
            match axis {
                0..3 => sample.acceleration[axis] -= 1,
                _ => sample.rate[axis - 3] -= 1,
            }
            assert_eq!(
                RawSample::from_packet(&sample.to_packet()),
                Err(PacketError::NotReady)
            );
        }
    }
}

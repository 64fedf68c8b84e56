//! What the IMU's FIFO delivers: integer codes in the 20-byte packets of the ICM-42688-P's high-resolution mode.
//!
//! Packet 4 of the data sheet, big-endian: header, accelerometer x y z bits 19..4 (two bytes each), gyroscope likewise,
//! temperature (two bytes), time stamp (two bytes, microseconds, wrapping), then three bytes with bits 3..0 of the
//! accelerometer (high nibble) and the gyroscope (low nibble) of each axis. In this mode the full scales are fixed at
//! 16 g and 2000 deg/s; of the 20 bits the accelerometer fills the upper 18 and the gyroscope the upper 19.

use core::f64::consts::PI;

use cslam_core::constants::STANDARD_GRAVITY_M_PER_S2;
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

/// One IMU sample as integer codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImuSample {
    /// Accelerometer codes x, y, z, body axes; [`ACCELERATION_PER_CODE_M_PER_S2`] each.
    pub acceleration: [i32; 3],
    /// Gyroscope codes x, y, z, body axes; [`RATE_PER_CODE_RAD_PER_S`] each.
    pub rate: [i32; 3],
    /// Temperature code: 25 degrees Celsius + code / 132.48.
    pub temperature: i16,
    /// The chip's own time stamp, us, wrapping at 2^16. It counts from the chip's power-up with the UAV clock.
    pub time_us: u16,
}

impl ImuSample {
    /// Specific force in body axes, m/s^2.
    pub fn specific_force_m_per_s2(&self) -> Vector3<f64> {
        Vector3::from(self.acceleration).map(|code| f64::from(code) * ACCELERATION_PER_CODE_M_PER_S2)
    }

    /// Angular rate in body axes, rad/s.
    pub fn rate_rad_per_s(&self) -> Vector3<f64> {
        Vector3::from(self.rate).map(|code| f64::from(code) * RATE_PER_CODE_RAD_PER_S)
    }

    /// Whether any axis is at the end of its range.
    pub fn is_saturated(&self) -> bool {
        self.acceleration.iter().any(|c| c.abs() >= ACCELERATION_CODE_MAX)
            || self.rate.iter().any(|c| c.abs() >= RATE_CODE_MAX)
    }

    /// The packet as it lies in the FIFO.
    pub fn to_packet(&self) -> [u8; PACKET_LEN] {
        let mut packet = [0; PACKET_LEN];
        packet[0] = HEADER;
        for axis in 0..3 {
            let acceleration = self.acceleration[axis] << 2;
            let rate = self.rate[axis] << 1;
            packet[1 + 2 * axis..3 + 2 * axis].copy_from_slice(&((acceleration >> 4) as i16).to_be_bytes());
            packet[7 + 2 * axis..9 + 2 * axis].copy_from_slice(&((rate >> 4) as i16).to_be_bytes());
            packet[17 + axis] = ((acceleration & 15) << 4 | rate & 15) as u8;
        }
        packet[13..15].copy_from_slice(&self.temperature.to_be_bytes());
        packet[15..17].copy_from_slice(&self.time_us.to_be_bytes());
        packet
    }

    /// Reads a packet; `None` when the header is another one or a bit that this mode leaves zero is set.
    pub fn from_packet(packet: &[u8; PACKET_LEN]) -> Option<Self> {
        if packet[0] != HEADER {
            return None;
        }
        let word = |at: usize| i16::from_be_bytes([packet[at], packet[at + 1]]);
        let mut sample = Self {
            acceleration: [0; 3],
            rate: [0; 3],
            temperature: word(13),
            time_us: u16::from_be_bytes([packet[15], packet[16]]),
        };
        for axis in 0..3 {
            let low = i32::from(packet[17 + axis]);
            if low & 0b0011_0001 != 0 {
                return None;
            }
            sample.acceleration[axis] = i32::from(word(1 + 2 * axis)) << 2 | low >> 6;
            sample.rate[axis] = i32::from(word(7 + 2 * axis)) << 3 | (low & 15) >> 1;
        }
        Some(sample)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_g_and_one_degree_per_second_have_the_data_sheet_codes() {
        let sample = ImuSample {
            acceleration: [8192, 0, -8192],
            rate: [131_072, -131_072, 131],
            temperature: 0,
            time_us: 0,
        };
        let force = sample.specific_force_m_per_s2();
        assert!((force.x - 9.80665).abs() < 1e-12 && (force.z + 9.80665).abs() < 1e-12);
        let rate = sample.rate_rad_per_s().map(|r| r * 180.0 / PI);
        assert!((rate.x - 1000.0).abs() < 1e-9 && (rate.y + 1000.0).abs() < 1e-9);
        assert!((rate.z - 0.99945).abs() < 1e-5);
    }

    #[test]
    fn a_packet_has_the_layout_of_the_data_sheet() {
        let sample = ImuSample {
            acceleration: [0x1_2345 & 0x1_ffff, -1, 3],
            rate: [0x2_468a, -2, 7],
            temperature: -300,
            time_us: 0xbeef,
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
            let sample = ImuSample {
                acceleration: [code, -code, ACCELERATION_CODE_MAX],
                rate: [2 * code, 2 * code + 1, -RATE_CODE_MAX],
                temperature: code as i16,
                time_us: code as u16,
            };
            assert_eq!(ImuSample::from_packet(&sample.to_packet()), Some(sample));
        }
    }

    #[test]
    fn foreign_packets_are_refused() {
        let sample = ImuSample {
            acceleration: [1, 2, 3],
            rate: [4, 5, 6],
            temperature: 7,
            time_us: 8,
        };
        let mut packet = sample.to_packet();
        packet[0] = 0x68;
        assert_eq!(ImuSample::from_packet(&packet), None);
        for bit in [0, 4, 5] {
            let mut packet = sample.to_packet();
            packet[18] ^= 1 << bit;
            assert_eq!(ImuSample::from_packet(&packet), None, "bit {bit}");
        }
    }
}

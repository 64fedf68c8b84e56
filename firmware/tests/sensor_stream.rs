//! Records of the sensor stream: every kind survives, every damage is found.

use crc::{CRC_32_ISO_HDLC, Crc};
use cslam_core::geometry::Vector3;
use cslam_firmware::icm42688::RawSample;
use cslam_firmware::sensor_stream::{Content, LENGTH, Record, RecordError, UPLINK_MAX};

fn records() -> Vec<Record> {
    let raw = RawSample {
        acceleration: [8192, -5, 77],
        rate: [131_072, -9, 1],
        temperature: -300,
        time_ticks: 65_535,
    };
    let contents = [
        Content::Imu(raw),
        Content::Magnetometer(Vector3::new(1.5, -20.25, f32::MIN_POSITIVE)),
        Content::Timing(-1.25e-6),
        Content::Uplink(heapless::Vec::from_slice(&[7; UPLINK_MAX]).expect("it fits")),
        Content::Uplink(heapless::Vec::new()),
        Content::Frames(130),
        Content::End,
    ];
    let number = |(number, content)| Record {
        number: number as u32,
        time_ns: u64::MAX - number as u64,
        content,
    };
    contents.into_iter().enumerate().map(number).collect()
}

/// Writes a right checksum under whatever the record says.
fn seal(bytes: &mut [u8; LENGTH]) {
    let checksum = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&bytes[..LENGTH - 4]);
    bytes[LENGTH - 4..].copy_from_slice(&checksum.to_le_bytes());
}

#[test]
fn every_kind_survives() {
    for record in records() {
        assert_eq!(Record::decode(&record.encode()), Ok(record.clone()));
    }
}

#[test]
fn every_flipped_bit_is_found() {
    for record in records() {
        let bytes = record.encode();
        for bit in 0..8 * LENGTH {
            let mut damaged = bytes;
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Record::decode(&damaged), Err(RecordError::Checksum), "bit {bit}");
        }
    }
}

#[test]
fn what_a_right_checksum_does_not_excuse_has_its_name() {
    let with = |at: usize, byte: u8, of: &Record| {
        let mut bytes = of.encode();
        bytes[at] = byte;
        seal(&mut bytes);
        Record::decode(&bytes)
    };
    let all = records();
    assert_eq!(with(0, 2, &all[0]), Err(RecordError::Version { found: 2 }));
    assert_eq!(with(1, 9, &all[0]), Err(RecordError::Kind { found: 9 }));
    assert_eq!(with(2, 19, &all[0]), Err(RecordError::Length { found: 19 }));
    assert_eq!(with(2, 21, &all[0]), Err(RecordError::Length { found: 21 }));
    assert_eq!(with(2, 255, &all[3]), Err(RecordError::Length { found: 255 }));
    assert_eq!(with(16, 0x68, &all[0]), Err(RecordError::Packet));
}

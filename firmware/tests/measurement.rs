//! Records: layout, round trip, and damage of every kind.

use crc::{CRC_32_ISO_HDLC, Crc};
use cslam_core::reflection::InputError;
use cslam_firmware::measurement::{DepartureRecord, LENGTH, PathRecord, Record, RecordError};
use proptest::prelude::*;

fn sample() -> PathRecord {
    PathRecord {
        link: 0x0403_0201,
        path: 5,
        uav_m: [53.97, 23.24, 2.0],
        uav_covariance_m2: [1.0, 0.1, 0.2, 2.0, 0.3, 3.0],
        gmt_m: [28.2, 23.04, 2.5],
        c_tau_m: 40.75,
        aoa: [-0.6, 0.8, 0.0],
        covariance: [4.0, 0.4, 0.5, 5.0, 0.6, 6.0],
        aod: Some(DepartureRecord {
            direction: [0.0, 0.6, 0.8],
            sigma_rad: 0.035,
        }),
    }
}

/// Replaces the checksum by the right one.
fn sealed(mut bytes: [u8; LENGTH]) -> [u8; LENGTH] {
    let checksum = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&bytes[..LENGTH - 4]);
    bytes[LENGTH - 4..].copy_from_slice(&checksum.to_le_bytes());
    bytes
}

fn float(bytes: &[u8], at: usize) -> f32 {
    f32::from_le_bytes(bytes[at..at + 4].try_into().expect("four"))
}

#[test]
fn the_record_is_laid_out_as_documented() {
    let bytes = Record::Path(sample()).encode();
    assert_eq!(LENGTH, 116);
    assert_eq!(bytes[..8], [1, 1, 1, 5, 1, 2, 3, 4]);
    let fields = [
        (8, 53.97),
        (16, 2.0),
        (20, 1.0),
        (40, 3.0),
        (44, 28.2),
        (56, 40.75),
        (60, -0.6),
    ];
    let more = [
        (72, 4.0),
        (80, 0.5),
        (84, 5.0),
        (92, 6.0),
        (96, 0.0),
        (104, 0.8),
        (108, 0.035),
    ];
    for (at, value) in fields.into_iter().chain(more) {
        assert_eq!(float(&bytes, at), value, "offset {at}");
    }
    assert_eq!(bytes, sealed(bytes));
    let end = Record::End { sent: 7 }.encode();
    assert_eq!(end[..8], [2, 1, 0, 0, 7, 0, 0, 0]);
    assert!(end[8..LENGTH - 4].iter().all(|b| *b == 0));
}

#[test]
fn what_the_solver_gets_is_what_was_measured() {
    let (ends, path) = sample().measurement().expect("sound");
    assert_eq!(PathRecord::new(0x0403_0201, 5, &ends, &path), sample());
    assert_eq!((ends.uav_covariance.m12, ends.uav_covariance.m32), (0.1, 0.3));
    assert_eq!((path.covariance.m13, path.covariance.m31), (0.5, 0.5));
    // A direction of any length is a direction.
    let long = PathRecord {
        aoa: [-6.0, 8.0, 0.0],
        ..sample()
    };
    let (_, path) = long.measurement().expect("sound");
    assert!((path.aoa.vector().norm() - 1.0).abs() < 1e-6);
}

#[test]
fn numbers_that_mean_nothing_are_input_errors() {
    let error = |record: PathRecord| record.measurement().expect_err("unsound");
    let nan = f32::NAN;
    assert_eq!(
        error(PathRecord {
            uav_m: [nan, 0.0, 0.0],
            ..sample()
        }),
        InputError::NotFinite
    );
    assert_eq!(
        error(PathRecord {
            gmt_m: [0.0, f32::INFINITY, 0.0],
            ..sample()
        }),
        InputError::NotFinite
    );
    assert_eq!(
        error(PathRecord {
            aoa: [0.0, 0.0, nan],
            ..sample()
        }),
        InputError::NotFinite
    );
    assert_eq!(
        error(PathRecord {
            aoa: [0.0; 3],
            ..sample()
        }),
        InputError::NoLength
    );
    let aod = Some(DepartureRecord {
        direction: [nan; 3],
        sigma_rad: 0.1,
    });
    assert_eq!(error(PathRecord { aod, ..sample() }), InputError::NotFinite);
}

#[test]
fn damage_is_named() {
    let good = Record::Path(sample()).encode();
    assert_eq!(Record::decode(&good[..LENGTH - 1]), Err(RecordError::Length));
    assert_eq!(
        Record::decode(&[&good[..], &[0]].concat()),
        Err(RecordError::Length)
    );
    assert_eq!(Record::decode(&[]), Err(RecordError::Length));
    assert_eq!(Record::decode(&[0; LENGTH]), Err(RecordError::Checksum));
    let altered = |at: usize, value: u8| {
        let mut bytes = good;
        bytes[at] = value;
        Record::decode(&sealed(bytes))
    };
    assert_eq!(altered(1, 2), Err(RecordError::Version));
    assert_eq!(altered(0, 3), Err(RecordError::Content));
    assert_eq!(altered(2, 2), Err(RecordError::Content));
    assert_eq!(altered(0, 2), Err(RecordError::Content), "an end has no flags");
}

fn any_float() -> impl Strategy<Value = f32> {
    any::<u32>().prop_map(f32::from_bits)
}

prop_compose! {
    fn any_path()(
        (link, path) in any::<(u32, u8)>(),
        (uav_m, uav_covariance_m2) in (prop::array::uniform3(any_float()), prop::array::uniform6(any_float())),
        (gmt_m, c_tau_m) in (prop::array::uniform3(any_float()), any_float()),
        (aoa, covariance) in (prop::array::uniform3(any_float()), prop::array::uniform6(any_float())),
        aod in prop::option::of((prop::array::uniform3(any_float()), any_float())),
    ) -> PathRecord {
        let aod = aod.map(|(direction, sigma_rad)| DepartureRecord { direction, sigma_rad });
        PathRecord { link, path, uav_m, uav_covariance_m2, gmt_m, c_tau_m, aoa, covariance, aod }
    }
}

proptest! {
    /// Any bits survive, NaN payloads too: compared as bytes, because NaN equals nothing.
    #[test]
    fn every_path_returns(path in any_path()) {
        let bytes = Record::Path(path).encode();
        let back = Record::decode(&bytes).expect("sound");
        prop_assert_eq!(back.encode(), bytes);
        let same = matches!(back, Record::Path(p) if p.link == path.link && p.aod.is_some() == path.aod.is_some());
        prop_assert!(same);
    }

    #[test]
    fn every_end_returns(sent in any::<u32>()) {
        prop_assert_eq!(Record::decode(&Record::End { sent }.encode()), Ok(Record::End { sent }));
    }

    /// CRC-32 finds every error of one burst up to 32 bits, so every damaged byte.
    #[test]
    fn every_damaged_byte_is_found(path in any_path(), at in 0..LENGTH, flip in 1_u8..) {
        let mut bytes = Record::Path(path).encode();
        bytes[at] ^= flip;
        prop_assert_eq!(Record::decode(&bytes), Err(RecordError::Checksum));
    }

    #[test]
    fn bytes_of_any_length_are_survived(bytes in prop::collection::vec(any::<u8>(), 0..2 * LENGTH)) {
        let error = Record::decode(&bytes).expect_err("the chance of a right checksum is 2^-32");
        prop_assert_eq!(error == RecordError::Length, bytes.len() != LENGTH);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4096))]

    /// Content that no sender of this version writes, under a right checksum.
    #[test]
    fn any_checked_content_is_survived(
        (kind, version, flags) in (any::<u8>(), 1_u8..3, 0_u8..3),
        words in prop::array::uniform28(any_float()),
    ) {
        let mut bytes = [0; LENGTH];
        for (place, word) in bytes.chunks_exact_mut(4).zip(words) {
            place.copy_from_slice(&word.to_le_bytes());
        }
        // Kinds that exist come as often as those that do not.
        let kind = if kind < 128 { kind % 4 } else { kind };
        bytes[..3].copy_from_slice(&[kind, version, flags]);
        let result = Record::decode(&sealed(bytes));
        let known = version == 1 && matches!((kind, flags), (1, 0 | 1) | (2, 0));
        prop_assert_eq!(result.is_ok(), known);
        if let Ok(Record::Path(path)) = result {
            let _ = path.measurement();
        }
    }
}

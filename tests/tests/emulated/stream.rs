//! The measurements of the test: the bundled paths with the error budget's errors, and faults in between.

use cslam_firmware::measurement::{LENGTH, PathRecord, Record};
use cslam_host_sim::measurement::Sigmas;
use cslam_host_sim::{path_flight, paths};

const SEED: u64 = 20;
/// One record in this many gets a fault.
const FAULT_EVERY: usize = 25;

/// The stream, closed by its end.
pub(crate) fn records() -> Vec<[u8; LENGTH]> {
    let links = paths::bundled().expect("the bundled paths are sound");
    let mut records = Vec::new();
    for (index, link) in (0_u32..).zip(&links) {
        let sweep = path_flight::measure(index, link, &Sigmas::default(), SEED).expect("sound paths");
        for (path, measured) in (0_u8..).zip(&sweep.paths) {
            let record = PathRecord::new(sweep.link, path, &sweep.ends, measured);
            records.push(with_fault(records.len(), record));
        }
    }
    let sent = u32::try_from(records.len()).expect("few");
    records.push(Record::End { sent }.encode());
    records
}

/// The record as sent, damaged or made meaningless when it is its turn.
fn with_fault(number: usize, mut record: PathRecord) -> [u8; LENGTH] {
    if number % FAULT_EVERY != FAULT_EVERY - 1 {
        return Record::Path(record).encode();
    }
    let turn = number / FAULT_EVERY;
    match turn % 8 {
        0 => record.c_tau_m = f32::NAN,
        1 => record.aoa = [0.0; 3],
        2 => record.uav_m[2] = f32::INFINITY,
        3 => record.covariance[3] = -1.0,
        _ => {
            let mut bytes = Record::Path(record).encode();
            bytes[(turn * 7) % LENGTH] ^= 1 << (turn % 8);
            return bytes;
        }
    }
    Record::Path(record).encode()
}

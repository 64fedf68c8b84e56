//! The board alone: both ends of the ring, one measurement of each outcome, and what must come of them.

use cslam_firmware::measurement::{self, PathRecord, Record};
use cslam_firmware::receiver::{Receiver, Step};
use cslam_firmware::ring::{Consumer, Producer, RingError};

use crate::exit::Exit;
use crate::psram::Psram;
use crate::uart::Downlink;
use crate::{report, unusable};

const SLOT: usize = measurement::LENGTH;
/// Fewer than there are records, so the indices wrap.
const SLOTS: u32 = 2;

/// Worked example of the paper: GMT, UAV and reflection point, m.
const GMT_M: [f32; 3] = [28.20, 23.04, 2.0];
const UAV_M: [f32; 3] = [53.97, 23.24, 2.0];
const POINT_M: [f32; 3] = [41.59, 39.09, 2.0];

/// Runs the test.
pub(crate) fn run<const N: usize>(receiver: &mut Receiver<'_, N>, downlink: &mut Downlink) -> Exit {
    match pass(receiver, downlink) {
        Ok(true) => {}
        Ok(false) => return Exit::SelfTest,
        Err(error) => return unusable(error),
    }
    let expected = [1, 1, 1, 1];
    let counters = receiver.counters();
    let found = [
        counters.points,
        counters.rejected,
        counters.invalid,
        counters.damaged_checksum,
    ];
    if found != expected {
        defmt::error!(
            "points, rejected, invalid, damaged are {}, expected {}",
            found,
            expected
        );
        return Exit::SelfTest;
    }
    let near = receiver
        .map()
        .points()
        .all(|point| distance_m(point.position.to_array(), POINT_M) < 0.02);
    if receiver.map().len() != 1 || !near {
        defmt::error!("the map does not hold the one point of the worked example");
        return Exit::SelfTest;
    }
    defmt::info!("self-test passed");
    report(receiver)
}

/// Sends every record through the ring and the receiver; `false` when a step did not do what it must.
fn pass<const N: usize>(receiver: &mut Receiver<'_, N>, downlink: &mut Downlink) -> Result<bool, RingError> {
    let mut producer = Producer::<_, SLOT>::create(Psram::from(0), SLOTS)?;
    let mut consumer = Consumer::<_, SLOT>::open(Psram::from(0))?;
    let records = records();
    for (index, record) in records.iter().enumerate() {
        if !producer.push(record)? {
            defmt::error!("the ring is full at record {=usize}", index);
            return Ok(false);
        }
        match receiver.step(&mut consumer, downlink) {
            Ok(Step::Idle) => {
                defmt::error!("record {=usize} did not arrive", index);
                return Ok(false);
            }
            Ok(Step::Ended) => return Ok(index + 1 == records.len()),
            Ok(_) => {}
            Err(error) => {
                defmt::error!("record {=usize}: {}", index, defmt::Display2Format(&error));
                return Ok(false);
            }
        }
    }
    defmt::error!("the stream did not end");
    Ok(false)
}

/// A point, a line of sight, a NaN, a damaged record, the end.
fn records() -> [[u8; SLOT]; 5] {
    let reflected = path(POINT_M, distance_m(GMT_M, POINT_M) + distance_m(POINT_M, UAV_M));
    let line_of_sight = PathRecord {
        path: 1,
        ..path(GMT_M, distance_m(GMT_M, UAV_M))
    };
    let not_a_number = PathRecord {
        path: 2,
        c_tau_m: f32::NAN,
        ..reflected
    };
    let [point, los, nan] = [reflected, line_of_sight, not_a_number].map(|path| Record::Path(path).encode());
    let mut damaged = point;
    if let Some(byte) = damaged.last_mut() {
        *byte ^= 1;
    }
    [point, los, nan, damaged, Record::End { sent: 4 }.encode()]
}

/// A path of this length that arrives from `seen_m`.
fn path(seen_m: [f32; 3], c_tau_m: f32) -> PathRecord {
    let [x, y, z] = seen_m;
    let [ux, uy, uz] = UAV_M;
    PathRecord {
        link: 0,
        path: 0,
        uav_m: UAV_M,
        uav_covariance_m2: [0.0025, 0.0, 0.0, 0.0025, 0.0, 0.0025],
        gmt_m: GMT_M,
        c_tau_m,
        aoa: [x - ux, y - uy, z - uz],
        covariance: [0.0025, 0.0, 0.0, 3e-6, 0.0, 3e-6],
        aod: None,
    }
}

fn distance_m([ax, ay, az]: [f32; 3], [bx, by, bz]: [f32; 3]) -> f32 {
    let (dx, dy, dz) = (ax - bx, ay - by, az - bz);
    libm::sqrtf(dx * dx + dy * dy + dz * dz)
}

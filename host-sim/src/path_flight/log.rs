//! The log of a flight over a path list: path `j` of link `i` is measurement `j` of sweep `i`, so the true path behind a
//! measured one is known without matching.

use cslam_core::geometry::{Body, Direction, Rotation, World};
use cslam_core::link_state::LinkState;
use cslam_core::path::Path;

use super::receiver::{Answer, Answered, ListMap};
use super::{Sweep, Times};
use crate::evaluation::downlink::Downlinked;
use crate::flight_log::{
    FlightLog, Header, LinkEstimate, MapVoxel, MeasuredPath, PointRecord, PoseTruth, SweepEstimate,
    SweepRecord, SweepTruth,
};
use crate::paths::Link;

/// A link as it was flown: what was measured on it, and what the receiver made of it.
#[derive(Clone, Debug)]
pub struct Flown<'a> {
    /// The line of the list.
    pub link: &'a Link,
    /// What was measured.
    pub sweep: Sweep,
    /// What became of it.
    pub answered: Answered,
}

/// The log of what was flown, sweep by sweep, what the ground heard of it, and the receiver's map at the end. The
/// pose counts as given, not estimated; without attitude in the list the body's axes are the world's.
pub fn log(
    header: Header,
    flown: &[Flown<'_>],
    times: &Times,
    heard: &Downlinked,
    map: &ListMap,
) -> FlightLog {
    let mut log = FlightLog::new(header, f64::from(map.edge_m()));
    let mut gmt_index = 0;
    for (index, one) in flown.iter().enumerate() {
        gmt_index += u32::from(index > 0 && flown[index - 1].link.tx != one.link.tx);
        let time_s = times.of(index);
        let numbered = one.answered.paths.iter().zip(&one.link.paths).zip(0..=u8::MAX);
        for ((answer, listed), path) in numbered {
            let Some(point) = &answer.point else { continue };
            log.points.push(PointRecord {
                sweep: one.sweep.link,
                path,
                order: 1,
                reflection: 1,
                surface: None,
                mapped_sweep: None,
                time_s,
                gmt_index,
                position_m: point.position.to_array().map(f64::from),
                covariance_trace_m2: f64::from(point.sigma_m()).powi(2),
                probability: answer.probabilities.map(|p| f64::from(p.first_order)),
                snr_db: listed.snr_db,
            });
        }
        log.sweeps.push(record(one, time_s, gmt_index));
    }
    log.map = map.points().map(MapVoxel::from).collect();
    log.health = heard.health_counters();
    log.downlink = heard.traffic;
    log
}

fn record(flown: &Flown<'_>, time_s: f64, gmt_index: u32) -> SweepRecord {
    let Flown {
        link,
        sweep,
        answered,
    } = flown;
    let quaternion_wb = link.uav_quaternion_wb.unwrap_or([1.0, 0.0, 0.0, 0.0]);
    // Checked where the list was read.
    let attitude = Rotation::<Body, World>::from_quaternion(quaternion_wb.map(|q| q as f32))
        .unwrap_or_else(|_| Rotation::identity());
    let listed = sweep.paths.iter().zip(&answered.paths).zip(&link.paths);
    SweepRecord {
        sweep: sweep.link,
        time_s,
        estimate: SweepEstimate {
            pose: None,
            gmt_position_m: Some(sweep.ends.gmt.to_array().map(f64::from)),
            gmt_index,
            paths: listed
                .map(|((path, answer), listed)| measured(path, answer, &attitude, listed.snr_db))
                .collect(),
            link: Some(LinkEstimate {
                state: answered.link.map_or(LinkState::Outage, |p| p.state()) as u8,
                probabilities: answered.link.map(|p| p.to_array().map(f64::from)),
            }),
            los_used: false,
            innovations: Vec::new(),
        },
        truth: SweepTruth {
            pose: Some(PoseTruth {
                position_m: link.rx,
                quaternion_wb,
                velocity_m_per_s: [0.0; 3],
                clock_offset_s: 0.0,
            }),
            link: Some((*link).clone()),
            matches: (0..sweep.paths.len()).map(Some).collect(),
        },
    }
}

fn measured(
    path: &Path<World>,
    answer: &Answer,
    attitude: &Rotation<Body, World>,
    snr_db: Option<f64>,
) -> MeasuredPath {
    let aoa: Direction<Body> = attitude.inverse().apply(path.aoa);
    MeasuredPath {
        c_tau_m: f64::from(path.c_tau_m),
        aoa_zenith_rad: f64::from(aoa.zenith_rad()),
        aoa_azimuth_rad: f64::from(aoa.azimuth_rad()),
        snr_db,
        probabilities: answer.probabilities.map(|p| p.to_array().map(f64::from)),
        verdict: answer.outcome.as_str().to_owned(),
    }
}

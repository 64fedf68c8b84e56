//! The log of a flight over a path list: path `j` of link `i` is measurement `j` of sweep `i`, so the true path behind a
//! measured one is known without matching.

use std::collections::BTreeMap;

use cslam_core::geometry::{Direction, Frame};
use cslam_core::map::PointCloud;
use cslam_core::path::Path;
use cslam_core::telemetry::PathOutcome;
use cslam_firmware::receiver::Answer;

use super::Sweep;
use crate::flight_log::{
    Downlink, FlightLog, Header, MapVoxel, MeasuredPath, PointRecord, PoseTruth, SweepEstimate, SweepRecord,
    SweepTruth,
};
use crate::paths::Link;

/// The log of what was flown: a link and what was measured on it, sweep by sweep, what the receiver made of it, what that
/// cost on the way to the ground, and the receiver's map at the end. A list gives no attitude, so measured angles are in world axes as are the true ones, and the
/// pose counts as given, not estimated.
pub fn log<const N: usize>(
    header: Header,
    flown: &[(&Link, Sweep)],
    answers: &[Answer],
    downlink: Downlink,
    map: &PointCloud<N>,
) -> FlightLog {
    let mut log = FlightLog::new(header, f64::from(map.edge_m()));
    let verdicts: BTreeMap<_, _> = answers.iter().map(|a| ((a.link, a.path), a.outcome)).collect();
    let mut gmt_index = 0;
    for (index, (link, sweep)) in flown.iter().enumerate() {
        gmt_index += u32::from(index > 0 && flown[index - 1].0.tx != link.tx);
        log.sweeps.push(record(
            link,
            sweep,
            &verdicts,
            index,
            gmt_index,
            log.header.sweep_period_s,
        ));
    }
    for answer in answers {
        let Some(point) = &answer.point else { continue };
        let sweep = log.sweeps.get(answer.link as usize);
        log.points.push(PointRecord {
            sweep: answer.link,
            path: answer.path,
            order: 1,
            reflection: 1,
            time_s: sweep.map_or(0.0, |s| s.time_s),
            gmt_index: sweep.map_or(0, |s| s.estimate.gmt_index),
            position_m: point.position.to_array().map(f64::from),
            covariance_trace_m2: f64::from(point.sigma_m()).powi(2),
            probability: None,
            snr_db: None,
        });
    }
    log.map = map.points().map(MapVoxel::from).collect();
    log.downlink = downlink;
    log
}

fn record(
    link: &Link,
    sweep: &Sweep,
    verdicts: &BTreeMap<(u32, u8), PathOutcome>,
    index: usize,
    gmt_index: u32,
    period_s: f64,
) -> SweepRecord {
    // A record that did not reach the receiver leaves no verdict.
    let verdict = |path: u8| {
        verdicts
            .get(&(sweep.link, path))
            .unwrap_or(&PathOutcome::Missing)
            .as_str()
    };
    let numbered = sweep.paths.iter().zip(0..=u8::MAX);
    SweepRecord {
        sweep: sweep.link,
        time_s: (index as f64 + 1.0) * period_s,
        estimate: SweepEstimate {
            pose: None,
            gmt_position_m: sweep.ends.gmt.to_array().map(f64::from),
            gmt_index,
            paths: numbered
                .map(|(path, number)| measured(path, verdict(number)))
                .collect(),
            link: None,
            los_used: false,
            innovations: Vec::new(),
        },
        truth: SweepTruth {
            pose: PoseTruth {
                position_m: link.rx,
                quaternion_wb: [1.0, 0.0, 0.0, 0.0],
                velocity_m_per_s: [0.0; 3],
                clock_offset_s: 0.0,
            },
            gmt_position_m: link.tx,
            link: Some(link.clone()),
            matches: (0..sweep.paths.len()).map(Some).collect(),
        },
    }
}

fn measured<F: Frame>(path: &Path<F>, verdict: &str) -> MeasuredPath {
    let aoa: &Direction<F> = &path.aoa;
    MeasuredPath {
        c_tau_m: f64::from(path.c_tau_m),
        aoa_zenith_rad: f64::from(aoa.zenith_rad()),
        aoa_azimuth_rad: f64::from(aoa.azimuth_rad()),
        snr_db: None,
        first_order_probability: None,
        verdict: verdict.to_owned(),
    }
}

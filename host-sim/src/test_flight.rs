//! Logs of flights for tests: made by hand, piece by piece, or from a planned flight with errors of a known size.

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use nalgebra::{Rotation3, Vector3};

use crate::flight::Motion;
use crate::flight_log::{
    FlightLog, Header, MeasuredPath, PoseEstimate, PoseTruth, SweepEstimate, SweepRecord, SweepTruth,
};
use crate::paths::{Link, LinkPath};
use crate::sensors::Truth;

/// The header of a flight of `sweeps` sweeps, two per second.
pub(crate) fn header(sweeps: usize) -> Header {
    Header {
        mode: "best".into(),
        scene: "test".into(),
        world: None,
        seed: 1,
        planned_sweeps: sweeps,
        sweep_period_s: 0.5,
        delay_cycle_m: None,
    }
}

/// A level pose looking east, at rest, its clock right.
pub(crate) fn truth(position_m: [f64; 3]) -> PoseTruth {
    PoseTruth {
        position_m,
        quaternion_wb: [1.0, 0.0, 0.0, 0.0],
        velocity_m_per_s: [0.0; 3],
        clock_offset_s: 0.0,
    }
}

/// The same as an estimate with unit covariances.
pub(crate) fn estimate(position_m: [f64; 3]) -> PoseEstimate {
    const ONE: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    PoseEstimate {
        position_m,
        quaternion_wb: [1.0, 0.0, 0.0, 0.0],
        velocity_m_per_s: [0.0; 3],
        position_covariance_m2: ONE,
        attitude_covariance_rad2: ONE,
        velocity_covariance_m2_per_s2: ONE,
        clock_offset_s: Some(0.0),
        clock_sigma_s: Some(1e-9),
    }
}

/// A sweep heard at a place, without a path, GMT at the origin.
pub(crate) fn sweep(number: u32, uav_m: [f64; 3]) -> SweepRecord {
    SweepRecord {
        sweep: number,
        time_s: 0.5 * f64::from(number + 1),
        estimate: SweepEstimate {
            pose: Some(estimate(uav_m)),
            gmt_position_m: Some([0.0; 3]),
            gmt_index: number / 2,
            paths: Vec::new(),
            link: None,
            los_used: false,
            innovations: Vec::new(),
        },
        truth: SweepTruth {
            pose: Some(truth(uav_m)),
            link: Some(Link {
                tx: [0.0; 3],
                rx: uav_m,
                ..Link::default()
            }),
            matches: Vec::new(),
        },
    }
}

/// A true path of a length and an angle of arrival (zenith, azimuth, world frame).
pub(crate) fn true_path(order: u8, length_m: f64, aoa_rad: [f64; 2]) -> LinkPath {
    LinkPath {
        order: Some(order),
        kind: None,
        delay_s: length_m / SPEED_OF_LIGHT_M_PER_S,
        aoa_zenith_rad: aoa_rad[0],
        aoa_azimuth_rad: aoa_rad[1],
        aod_zenith_rad: None,
        aod_azimuth_rad: None,
        aod_sigma_rad: None,
        gain: Some([1e-4, 0.0]),
        cross_gain: None,
        first_vertex: None,
        last_vertex: None,
        edge_point: None,
        snr_db: None,
        covariance: None,
        confirmed: None,
        closing_m_per_s: None,
    }
}

/// A UAV that moves and is turned, its clock 1 us ahead, beside a GMT in the origin.
pub(crate) fn turned() -> Truth {
    Truth {
        time_s: 20.0,
        uav: Motion {
            position_m: Vector3::new(30.0, -40.0, 12.0),
            velocity_m_per_s: Vector3::new(3.0, 1.0, -0.5),
            acceleration_m_per_s2: Vector3::zeros(),
            attitude: Rotation3::from_euler_angles(0.2, -0.1, 2.0),
            rate_rad_per_s: Vector3::zeros(),
            angular_acceleration_rad_per_s2: Vector3::zeros(),
            specific_force_m_per_s2: Vector3::zeros(),
        },
        gmt_position_m: Vector3::zeros(),
        gmt_velocity_m_per_s: Vector3::zeros(),
        gmt_attitude: Rotation3::identity(),
        clock_offset_s: 1e-6,
        clock_drift: 0.0,
    }
}

/// A measured path (zenith, azimuth, body frame).
pub(crate) fn measured(c_tau_m: f64, aoa_rad: [f64; 2]) -> MeasuredPath {
    MeasuredPath {
        c_tau_m,
        aoa_zenith_rad: aoa_rad[0],
        aoa_azimuth_rad: aoa_rad[1],
        snr_db: Some(20.0),
        probabilities: Some([0.0, 0.9, 0.1]),
        verdict: "ok".into(),
    }
}

/// A log of these sweeps.
pub(crate) fn log_of(sweeps: Vec<SweepRecord>) -> FlightLog {
    let mut log = FlightLog::new(header(sweeps.len()), 0.25);
    log.sweeps = sweeps;
    log
}

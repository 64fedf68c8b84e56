//! The paper's HPC over the same flights.
//!
//! It gets more than it would have: the pose at the start without error, the gyroscope's bias from rest, a clock that is
//! right but for the error of one exchange (it has no clock state), and no outliers.

use core::f64::consts::PI;
use core::num::NonZeroU32;

use cslam_core::array::GmtArrays;
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{Body, Position, Rotation, World};
use cslam_core::localization::filter::{FaceDirection, SweepVerdict};
use cslam_core::localization::hpc::{Hpc, Mode, Start};
use cslam_core::localization::imu::{Imu, ImuConfig, RestAlignment, RestConfig, RestStatus};
use cslam_core::localization::{ImuErrors, ImuIncrement};
use nalgebra::{Rotation3, Vector3};

use super::flights::{Heard, Prepared, TrueSweep};
use super::fly::Record;
use super::radio::{Ends, Hardware, RadioErrors};
use crate::seeded::{Seeded, Source};

/// Where the attitude comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AttitudeSource {
    /// The gyroscope alone.
    Gyroscope,
    /// An attitude and heading reference with a constant error of 0.5 deg in tilt and 2 deg in yaw.
    Reference,
}

/// Sweeps from fix to fix: T_c.
const FIX_EVERY: NonZeroU32 = NonZeroU32::MIN.saturating_add(1);

/// Flies HPC over a flight; a record a sweep. Clock and NEES are not a number: it has none.
pub fn hpc(flight: &Prepared, mode: Mode, source: AttitudeSource) -> Vec<Record> {
    let hardware = Hardware::new(RadioErrors::default(), flight.seed);
    let gmt_attitude = flight.sensed.sweep_truth(0).gmt_attitude;
    let mut random = Seeded::new(flight.seed, Source::Timing);
    let tilt = Vector3::new(
        random.normal() * 0.5,
        random.normal() * 0.5,
        random.normal() * 2.0,
    ) * (PI / 180.0);
    let mut imu = Imu::new(ImuConfig::default());
    let mut rest = Some(RestAlignment::new(RestConfig::default()));
    let (mut state, mut records): (Option<Hpc>, Vec<Record>) = (None, Vec::new());
    let attitude_at = |time_ns: u64| {
        let time_s = flight.sensed.clock().time_at_s(time_ns as f64 * 1e-9);
        flight.sensed.plan().uav().at(time_s).attitude
    };
    for &(at, heard) in &flight.heard {
        match heard {
            Heard::Inertial(sample) => {
                if let Some(aligning) = &mut rest
                    && let RestStatus::Aligned(found) = aligning.push(&sample)
                {
                    imu.set_errors(ImuErrors {
                        gyro_bias_rad_per_s: found.gyro_bias_rad_per_s,
                        ..ImuErrors::default()
                    });
                    rest = None;
                }
                if let Some(step) = imu.push(&sample) {
                    advance(&mut state, &step.increment, source, &attitude_at, &tilt);
                }
            }
            Heard::Sweep(sweep) => {
                if let Some(step) = imu.finish_step() {
                    advance(&mut state, &step.increment, source, &attitude_at, &tilt);
                }
                let truth = &flight.sweeps[sweep as usize];
                let ends = Ends {
                    attitude: truth.motion.attitude,
                    gmt_attitude,
                    clock_offset_m: truth.clock_offset_m + random.normal() * 0.3e-9 * SPEED_OF_LIGHT_M_PER_S,
                };
                let mut noise = Seeded::numbered(flight.seed, Source::RadioNoise, sweep);
                let fix = truth.sight().and_then(|path| {
                    let seen =
                        hardware.measure(&ends, path.length_m, &path.arrival, &path.departure, &mut noise)?;
                    position(
                        &truth.gmt_m,
                        seen.c_tau_m - truth.clock_offset_m,
                        &seen.departure?,
                    )
                });
                match (&mut state, fix) {
                    // At rest: the first step after the alignment.
                    (None, Some(fix)) if rest.is_none() => {
                        state = begin(mode, at, truth, fix);
                    }
                    (Some(state), Some(fix)) if state.fix_due(sweep) => state.fix(fix),
                    _ => {}
                }
                if let Some(state) = &state {
                    records.push(record(state, truth, sweep));
                }
            }
            Heard::Timing(_) | Heard::Beacon(_) => {}
        }
    }
    records
}

fn advance(
    state: &mut Option<Hpc>,
    increment: &ImuIncrement,
    source: AttitudeSource,
    attitude_at: &impl Fn(u64) -> Rotation3<f64>,
    tilt_rad: &Vector3<f64>,
) {
    let Some(state) = state
        .as_mut()
        .filter(|state| state.time_ns() <= increment.start_ns)
    else {
        return;
    };
    let given = match source {
        AttitudeSource::Gyroscope => None,
        AttitudeSource::Reference => {
            let truth = attitude_at(increment.start_ns);
            Rotation::from_matrix((Rotation3::new(*tilt_rad) * truth).into_inner()).ok()
        }
    };
    // An increment that HPC refuses leaves it as it was; flights have none.
    let _ = state.step(increment, given);
}

fn begin(mode: Mode, time_ns: u64, truth: &TrueSweep, fix: Position<World, f64>) -> Option<Hpc> {
    let attitude: Rotation<Body, World, f64> =
        Rotation::from_matrix(truth.motion.attitude.into_inner()).ok()?;
    Some(Hpc::new(
        mode,
        FIX_EVERY,
        Start {
            time_ns,
            position: fix,
            velocity_m_per_s: truth.motion.velocity_m_per_s,
            attitude,
        },
    ))
}

/// The paper's fix: direction and range from the GMT.
fn position(gmt_m: &Vector3<f64>, range_m: f64, departure: &FaceDirection) -> Option<Position<World, f64>> {
    let faces = GmtArrays::<f64>::default();
    let face = faces.faces().get(departure.face)?;
    let [sx, sz] = departure.cosines;
    let forward = (1.0 - sx * sx - sz * sz).max(0.0).sqrt();
    let direction = face.normal * forward + face.tangent * sx + Vector3::z() * sz;
    Position::from_vector(gmt_m + direction * range_m).ok()
}

fn record(state: &Hpc, truth: &TrueSweep, sweep: u32) -> Record {
    let turn = truth.motion.attitude.into_inner() * state.attitude().matrix().transpose();
    Record {
        time_s: (f64::from(sweep) + 1.0) * 0.5,
        running: true,
        sight: truth.sight().is_some(),
        outlier: false,
        reflections: 0,
        range_m: (truth.gmt_m - truth.motion.position_m).norm(),
        position_m: state.position_m() - truth.motion.position_m,
        attitude_rad: Rotation3::from_matrix_unchecked(turn).scaled_axis(),
        clock_m: f64::NAN,
        nees: [f64::NAN; 3],
        nis: f64::NAN,
        verdict: SweepVerdict::Accepted,
    }
}

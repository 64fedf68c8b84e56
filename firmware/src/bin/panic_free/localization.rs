//! Localization: everything that a measurement can set in motion.

use core::hint::black_box;

use cslam_core::geometry::{Direction, Matrix3, Plane, Position, Rotation, Vector3};
use cslam_core::localization::filter::{
    Bounces, FaceDirection, LevelYaw, MappedPlane, PathMeasurement, ReflectedPath, SweepMeasurement,
    Transmitter, states,
};
use cslam_core::localization::imu::Alignment;
use cslam_core::localization::{ImuErrors, ImuSample, Localizer};

/// States of the filter with four planes.
pub(crate) const STATES: usize = states(4);

/// Flies on measurements of which the compiler knows nothing.
pub(crate) fn fly(localizer: &mut Localizer<f32, STATES>) {
    loop {
        let sample = black_box(ImuSample {
            time_ns: 0,
            rate_rad_per_s: Vector3::zeros(),
            specific_force_m_per_s2: Vector3::zeros(),
        });
        if let Some(step) = black_box(localizer.sample(&sample)) {
            let increment = step.increment;
            black_box(increment.with_errors(&black_box(ImuErrors::default())));
            black_box(increment.split(black_box(0)));
        }
        localizer.tick(black_box(0));
        black_box(localizer.two_way(black_box(0), black_box(0.0)));
        black_box(
            localizer
                .magnetic(black_box(0), &black_box(Vector3::zeros()))
                .is_ok(),
        );
        localizer.announce_sweep(black_box(0));
        black_box(sweep(localizer).is_some());
        black_box((localizer.present(), localizer.health(black_box(0))));
        if let Some(found) = localizer.alignment().copied() {
            localizer.align(&black_box(found));
            turn(&found);
        }
        if black_box(false) {
            break;
        }
    }
}

fn turn(found: &Alignment) {
    black_box(found.roll_pitch_rad());
    black_box(found.attitude(black_box(0.0)).to_attitude().is_ok());
}

fn sweep(localizer: &mut Localizer<f32, STATES>) -> Option<()> {
    let path = PathMeasurement {
        c_tau_m: black_box(0.0),
        c_tau_sigma_m: black_box(0.0),
        aoa: Direction::from_vector(black_box(Vector3::x())).ok()?,
        aoa_sigma_rad: black_box(0.0),
        aoa_rise_sigma_rad: black_box(0.0),
        departure: black_box(Some(FaceDirection {
            face: 0,
            cosines: [0.0; 2],
            sigma: [0.0; 2],
        })),
    };
    let plane = MappedPlane {
        id: black_box(0),
        plane: Plane {
            normal: Direction::from_vector(black_box(Vector3::x())).ok()?,
            centre: Position::from_vector(black_box(Vector3::x())).ok()?,
            covariance: black_box(Matrix3::zeros()),
        },
    };
    let reflected = ReflectedPath {
        path,
        planes: Bounces::from_slice(&[plane, plane]).ok()?,
    };
    let (paths, reflected) = ([path], [reflected]);
    let measurement = SweepMeasurement {
        time_ns: black_box(0),
        gmt: Transmitter {
            position_m: black_box(Vector3::zeros()),
            sigma_m: black_box(0.0),
            attitude: Rotation::from_yaw_pitch_roll(black_box(0.0), black_box(0.0), black_box(0.0)).ok()?,
        },
        stop: black_box(0),
        line_of_sight: black_box(Some(path)),
        proven: black_box(true),
        contrary: black_box(Some(path)),
        level_yaw: black_box(Some(LevelYaw {
            yaw_rad: 0.0,
            sigma_rad: 0.0,
        })),
        reflections: black_box(&reflected),
        heard: black_box(&paths),
    };
    black_box(localizer.sweep(&measurement));
    Some(())
}

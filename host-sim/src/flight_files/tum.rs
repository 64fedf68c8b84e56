//! Trajectories in the TUM format: `time x y z qx qy qz qw` a line, seconds and metres, the pose T_world_body.

use std::io::{self, Write};

use crate::flight_log::FlightLog;

const HEADER: &str = "# time_s x_m y_m z_m qx qy qz qw: T_world_body, world ENU, body FLU";

/// The poses that the receiver estimated.
pub(super) fn estimate(out: &mut impl Write, log: &FlightLog) -> io::Result<()> {
    writeln!(out, "{HEADER}")?;
    for record in log.trajectory().iter() {
        if let Some(pose) = record.estimate {
            line(out, record.time_s, pose.position_m, pose.quaternion_wb)?;
        }
    }
    Ok(())
}

/// The true poses, as far as they are known, also from before the receiver's first one.
pub(super) fn truth(out: &mut impl Write, log: &FlightLog) -> io::Result<()> {
    writeln!(out, "{HEADER}")?;
    for record in log.trajectory().iter() {
        if let Some(pose) = record.truth {
            line(out, record.time_s, pose.position_m, pose.quaternion_wb)?;
        }
    }
    Ok(())
}

fn line(
    out: &mut impl Write,
    time_s: f64,
    [x, y, z]: [f64; 3],
    [qw, qx, qy, qz]: [f64; 4],
) -> io::Result<()> {
    writeln!(
        out,
        "{time_s:.9} {x:.6} {y:.6} {z:.6} {qx:.9} {qy:.9} {qz:.9} {qw:.9}"
    )
}

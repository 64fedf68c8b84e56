//! Where one path was reflected, and why another one has no point.

use std::error::Error;

use cslam_core::geometry::{Direction, Matrix3, Position, Vector3};
use cslam_core::path::{Path, diagonal_covariance};
use cslam_core::reflection::{Ends, Form, Gates, Verdict, solve};

fn main() -> Result<(), Box<dyn Error>> {
    // UAV and transmitter 12 m in front of the wall x = 0, on the ground z = 0.
    let ends: Ends = Ends {
        uav: Position::new(12.0, 40.0, 6.0)?,
        uav_covariance: Matrix3::identity() * 0.05 * 0.05,
        gmt: Position::new(12.0, 0.0, 2.0)?,
    };
    let gates = Gates {
        ground_z_m: Some(0.0),
        ..Gates::default()
    };
    for (what, way_m, towards) in [
        ("off the wall", 46.818, Vector3::new(-12.0, -20.0, -2.0)),
        ("straight", 40.200, Vector3::new(0.0, -40.0, -4.0)),
        ("a longer way", 90.000, Vector3::new(-12.0, -20.0, -2.0)),
        ("from below", 60.000, Vector3::new(-12.0, -20.0, -9.0)),
    ] {
        let path = Path {
            c_tau_m: way_m,
            aoa: Direction::from_vector(towards)?,
            aod: None,
            covariance: diagonal_covariance(0.05, 2e-3),
        };
        match solve(&ends, &path, Form::Vector, &gates)? {
            Verdict::Accepted(point) => {
                let [x, y, z] = point.position.to_array();
                println!("{what}: {x:.3} {y:.3} {z:.3} m, sigma {:.3} m", point.sigma_m());
            }
            Verdict::Rejected(reason) => println!("{what}: {reason}"),
        }
    }
    Ok(())
}

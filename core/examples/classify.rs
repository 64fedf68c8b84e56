//! Line of sight, one reflection or more: what the networks that fly say of the paths of a link.

use std::error::Error;

use cslam_core::geometry::{Direction, Matrix3, Position, Vector3};
use cslam_core::link_state::{Classifier, LinkGeometry, Received, models};
use cslam_core::path::{Departure, Path, diagonal_covariance};
use cslam_core::reflection::Ends;
use cslam_core::signal::Waveform;

fn main() -> Result<(), Box<dyn Error>> {
    let classifier = Classifier::new(models::geometric()?, models::geometric_without_departure()?)?;
    let ends: Ends = Ends {
        uav: Position::new(12.0, 40.0, 6.0)?,
        uav_covariance: Matrix3::identity() * 0.05 * 0.05,
        gmt: Position::new(12.0, 0.0, 2.0)?,
    };
    // Strongest first: length, towards where it came from, where it left the transmitter, gain.
    let paths = [
        (40.20, [0.0, -40.0, -4.0], Some([0.0, 40.0, 4.0]), -94.1),
        (46.82, [-12.0, -20.0, -2.0], Some([-12.0, 20.0, 2.0]), -105.0),
        (93.70, [-12.0, -20.0, -2.0], None, -122.0),
    ]
    .map(|(c_tau_m, towards, left, gain_db)| {
        let direction = |v: [f32; 3]| Direction::from_vector(Vector3::from(v));
        let aod = left.map(direction).transpose()?.map(|direction| Departure {
            direction,
            sigma_rad: 0.035,
        });
        Ok(Received {
            path: Path {
                c_tau_m,
                aoa: direction(towards)?,
                aod,
                covariance: diagonal_covariance(0.05, 2e-3),
            },
            gain_db: Some(gain_db),
        })
    });
    let paths = paths.into_iter().collect::<Result<Vec<_>, Box<dyn Error>>>()?;
    let link = LinkGeometry::new(&ends, &paths, &Waveform::default())?;
    for path in &paths {
        let p = classifier.path(&link, path)?;
        println!("{:.2} m: {:?} {:.3?}", path.path.c_tau_m, p.state(), p.to_array());
    }
    Ok(())
}

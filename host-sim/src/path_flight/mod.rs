//! A flight over a path list: what a receiver with the error budget would measure on each link, or what one did measure.
//!
//! One link is one sweep: the UAV at `rx` hears the GMT at `tx`. Of a traced list delay, angles and the UAV's own position get
//! normal errors, drawn from a stream of their own per sweep; the receiver sees only the erroneous values and knows only their
//! standard deviations. A [measured](crate::paths::are_measured) list is taken as it is.

mod bundled;
mod log;
mod receiver;
mod times;

pub use bundled::bundled;
pub use log::{Flown, log};
pub use receiver::{Answer, Answered, ListMap, ListReceiver, Methods};
pub use times::Times;

use cslam_core::geometry::{Direction, Matrix3, Position, Vector3, World};
use cslam_core::path::{Departure, Path};
use cslam_core::reflection::{Ends, InputError};

use crate::measurement::{self, Sigmas};
use crate::paths::{Link, LinkPath};
use crate::random::Stream;

/// What the receiver gets from one sweep.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// Index of the link.
    pub link: u32,
    /// Both ends as the receiver believes them.
    pub ends: Ends,
    /// Measured paths, strongest first.
    pub paths: Vec<Path<World>>,
}

/// Takes one measured link as it is. `sigmas` say how sure that is which the list does not.
///
/// # Errors
/// [`InputError`] when the path list itself holds an impossible number.
pub fn as_measured(index: u32, link: &Link, sigmas: &Sigmas) -> Result<Sweep, InputError> {
    let paths = link.paths.iter().map(|path| measurement::path(path, sigmas));
    Ok(Sweep {
        link: index,
        ends: measurement::ends(link, sigmas)?,
        paths: paths.collect::<Result<_, _>>()?,
    })
}

/// Measures one traced link.
///
/// # Errors
/// [`InputError`] when the path list itself holds an impossible number.
pub fn measure(index: u32, link: &Link, errors: &Sigmas, seed: u64) -> Result<Sweep, InputError> {
    let mut stream = Stream::new(seed, u64::from(index));
    let exact = measurement::ends::<f64>(link, errors)?;
    let shift = normal_vector(&mut stream) * errors.position_m;
    let uav = (exact.uav.vector() + shift).map(|c| c as f32);
    let ends = Ends {
        uav: Position::from_vector(uav)?,
        uav_covariance: exact.uav_covariance.map(|c| c as f32),
        gmt: Position::from_vector(exact.gmt.vector().map(|c| c as f32))?,
    };
    let paths = link
        .paths
        .iter()
        .map(|path| measure_path(path, errors, &mut stream));
    Ok(Sweep {
        link: index,
        ends,
        paths: paths.collect::<Result<_, _>>()?,
    })
}

fn measure_path(path: &LinkPath, errors: &Sigmas, stream: &mut Stream) -> Result<Path<World>, InputError> {
    let exact = measurement::path::<f64>(path, errors)?;
    let aod = match exact.aod {
        Some(departure) => Some(Departure {
            direction: disturbed(&departure.direction, departure.sigma_rad, stream)?,
            sigma_rad: departure.sigma_rad as f32,
        }),
        None => None,
    };
    Ok(Path {
        c_tau_m: (exact.c_tau_m + stream.normal() * errors.c_tau_m) as f32,
        aoa: disturbed(&exact.aoa, errors.aoa_deg.to_radians(), stream)?,
        aod,
        covariance: Matrix3::from_fn(|i, j| exact.covariance[(i, j)] as f32),
    })
}

/// A direction with a normal error along each tangent.
fn disturbed(
    exact: &Direction<World, f64>,
    sigma_rad: f64,
    stream: &mut Stream,
) -> Result<Direction<World>, InputError> {
    let (e1, e2) = exact.tangents();
    let vector = exact.vector() + e1 * (stream.normal() * sigma_rad) + e2 * (stream.normal() * sigma_rad);
    Ok(Direction::from_vector(vector.map(|c| c as f32))?)
}

fn normal_vector(stream: &mut Stream) -> Vector3<f64> {
    Vector3::from_fn(|_, _| stream.normal())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::rms;

    #[test]
    fn a_sweep_depends_only_on_seed_and_index() {
        let links = bundled().expect("sound");
        let index = links.iter().position(|l| l.paths.len() > 2).expect("a rich link");
        let at = |index: u32, seed| {
            measure(index, &links[index as usize], &Sigmas::default(), seed).expect("sound")
        };
        let index = index as u32;
        assert_eq!(at(index, 1).paths, at(index, 1).paths);
        assert_ne!(at(index, 1).paths, at(index, 2).paths);
    }

    #[test]
    fn errors_have_the_stated_size() {
        let links = bundled().expect("sound");
        let errors = Sigmas::default();
        let (mut range, mut angle, mut place) = (vec![], vec![], vec![]);
        for (index, link) in links.iter().enumerate() {
            let sweep = measure(index as u32, link, &errors, 9).expect("sound");
            for (exact, measured) in link.paths.iter().zip(&sweep.paths) {
                let exact = measurement::path::<f64>(exact, &errors).expect("sound");
                range.push(f64::from(measured.c_tau_m) - exact.c_tau_m);
                let seen = Direction::from_vector(measured.aoa.vector().map(f64::from)).expect("unit");
                angle.push(exact.aoa.angle_to_rad(&seen).to_degrees());
            }
            let seen = sweep.ends.uav.to_array().map(f64::from);
            place.extend((0..3).map(|i| seen[i] - link.rx[i]));
        }
        let near = |values: &[f64], expected: f64| (rms(values).expect("many") / expected - 1.0).abs() < 0.06;
        assert!(near(&range, 0.05) && near(&angle, 0.1 * 2.0_f64.sqrt()) && near(&place, 0.05));
    }
}

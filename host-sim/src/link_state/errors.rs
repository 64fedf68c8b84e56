//! From true links to measured ones: errors of the stated sizes, drawn from one stream a link.

use cslam_core::geometry::{Direction, Matrix3, Position, World};
use cslam_core::link_state::Received;
use cslam_core::path::{Departure, Path, diagonal_covariance};
use cslam_core::reflection::{Ends, InputError};
use nalgebra::Vector3;

use super::links::{Link, TruePath};
use crate::random::Stream;

/// Standard deviations of a measured link. The defaults are those that the classifier is specified for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// UAV position along each axis, m; common to all paths of the link.
    pub position_m: f64,
    /// c tau of each path, m.
    pub c_tau_m: f64,
    /// Angle of arrival along each tangent, deg.
    pub aoa_deg: f64,
    /// Angle of departure along each tangent, deg.
    pub aod_deg: f64,
    /// Gain of each path, dB: what is not known of antennas and transmit power. Which of two paths is the stronger, the
    /// receiver knows much better, from their energies on the same antennas: the order of the paths is kept.
    pub gain_db: f64,
    /// Share of links whose gains are not known at all.
    pub gain_unknown: f64,
}

impl Default for Errors {
    fn default() -> Self {
        Self {
            position_m: 0.3,
            c_tau_m: 0.2,
            aoa_deg: 0.5,
            aod_deg: 2.0,
            gain_db: 3.0,
            gain_unknown: 0.0,
        }
    }
}

/// A link as the receiver has it.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Where the ends are thought to be.
    pub ends: Ends,
    /// Paths, strongest first.
    pub paths: Vec<Received>,
}

impl Errors {
    /// Measures a link with the errors of one stream. `departures` tells whether angles of departure are measured.
    ///
    /// # Errors
    /// [`InputError`] when the link is none: coordinates or angles that are not finite.
    pub fn measure(
        &self,
        link: &Link<'_>,
        departures: bool,
        stream: &mut Stream,
    ) -> Result<Measured, InputError> {
        let mut place = link.rx_m.map(f64::from);
        for coordinate in &mut place {
            *coordinate += self.position_m * stream.normal();
        }
        let gain_known = stream.uniform() >= self.gain_unknown;
        let ends = Ends {
            uav: Position::new(place[0] as f32, place[1] as f32, place[2] as f32)?,
            uav_covariance: Matrix3::identity() * (self.position_m * self.position_m) as f32,
            gmt: Position::new(link.tx_m[0], link.tx_m[1], link.tx_m[2])?,
        };
        let paths = link
            .paths()
            .map(|path| self.received(&path, departures, gain_known, stream));
        Ok(Measured {
            ends,
            paths: paths.collect::<Result<_, _>>()?,
        })
    }

    fn received(
        &self,
        path: &TruePath,
        departures: bool,
        gain_known: bool,
        stream: &mut Stream,
    ) -> Result<Received, InputError> {
        // All numbers are drawn whatever is used of them, so that settings can be compared on the same errors.
        let c_tau_m = f64::from(path.c_tau_m) + self.c_tau_m * stream.normal();
        let aoa = turned(path.aoa_rad, self.aoa_deg, stream)?;
        let aod = turned(path.aod_rad, self.aod_deg, stream)?;
        let gain_db = path.gain_db + (self.gain_db * stream.normal()) as f32;
        Ok(Received {
            path: Path {
                // A reflection right beside an antenna may come out as no length at all; no receiver reports that.
                c_tau_m: c_tau_m.max(0.01) as f32,
                aoa,
                aod: departures.then_some(Departure {
                    direction: aod,
                    sigma_rad: self.aod_deg.to_radians() as f32,
                }),
                covariance: diagonal_covariance(self.c_tau_m as f32, self.aoa_deg.to_radians() as f32),
            },
            gain_db: gain_known.then_some(gain_db),
        })
    }
}

/// A direction (zenith, azimuth) with a normal error along each tangent.
fn turned(angles_rad: [f32; 2], sigma_deg: f64, stream: &mut Stream) -> Result<Direction<World>, InputError> {
    let exact =
        Direction::<World, f64>::from_zenith_azimuth(f64::from(angles_rad[0]), f64::from(angles_rad[1]))?;
    let (e1, e2) = exact.tangents();
    let sigma_rad = sigma_deg.to_radians();
    let (a, b) = (sigma_rad * stream.normal(), sigma_rad * stream.normal());
    let vector: Vector3<f64> = exact.vector() + e1 * a + e2 * b;
    Ok(Direction::from_vector(vector.map(|c| c as f32))?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link_state::links::tests::one_link;

    fn none() -> Errors {
        Errors {
            position_m: 0.0,
            c_tau_m: 0.0,
            aoa_deg: 0.0,
            aod_deg: 0.0,
            gain_db: 0.0,
            gain_unknown: 0.0,
        }
    }

    #[test]
    fn without_errors_the_link_comes_back() {
        let links = one_link();
        let link = links.link(0).expect("one");
        let measured = none()
            .measure(&link, true, &mut Stream::new(1, 0))
            .expect("sound");
        assert_eq!(measured.ends.uav.to_array(), link.rx_m);
        let (path, truth) = (measured.paths[1], link.paths().nth(1).expect("two"));
        assert_eq!(path.path.c_tau_m, truth.c_tau_m);
        assert_eq!(path.gain_db, Some(truth.gain_db));
        assert!((path.path.aoa.zenith_rad() - truth.aoa_rad[0]).abs() < 1e-6);
        let departure = path.path.aod.expect("measured").direction;
        assert!((departure.azimuth_rad() - truth.aod_rad[1]).abs() < 1e-6);
    }

    #[test]
    fn errors_have_their_sizes() {
        let links = one_link();
        let link = links.link(0).expect("one");
        let truth = link.paths().next().expect("two");
        let exact = none()
            .measure(&link, true, &mut Stream::new(1, 0))
            .expect("sound");
        let n = 20_000;
        let mut squares = [0.0_f64; 5];
        for index in 0..n {
            let m = Errors::default()
                .measure(&link, true, &mut Stream::new(1, index))
                .expect("sound");
            let path = m.paths[0].path;
            let departures =
                [m.paths[0].path.aod, exact.paths[0].path.aod].map(|d| d.expect("set").direction);
            let errors = [
                m.ends.uav.distance_m(&exact.ends.uav),
                path.c_tau_m - truth.c_tau_m,
                path.aoa.angle_to_rad(&exact.paths[0].path.aoa).to_degrees(),
                departures[0].angle_to_rad(&departures[1]).to_degrees(),
                m.paths[0].gain_db.expect("known") - truth.gain_db,
            ];
            squares
                .iter_mut()
                .zip(errors)
                .for_each(|(s, e)| *s += f64::from(e * e) / n as f64);
        }
        // Three axes; one; two tangents; two; one.
        let expected = [3.0 * 0.09, 0.04, 2.0 * 0.25, 2.0 * 4.0, 9.0];
        for (square, expected) in squares.iter().zip(expected) {
            assert!((square / expected - 1.0).abs() < 0.05, "{squares:?}");
        }
    }

    #[test]
    fn what_is_not_measured_is_left_out() {
        let links = one_link();
        let link = links.link(0).expect("one");
        let errors = Errors {
            gain_unknown: 1.0,
            ..Errors::default()
        };
        let without = errors
            .measure(&link, false, &mut Stream::new(3, 9))
            .expect("sound");
        assert!(
            without
                .paths
                .iter()
                .all(|p| p.path.aod.is_none() && p.gain_db.is_none())
        );
        let with = Errors::default()
            .measure(&link, true, &mut Stream::new(3, 9))
            .expect("sound");
        assert_eq!(
            with.paths[1].path.aoa, without.paths[1].path.aoa,
            "the same draws"
        );
    }
}

//! What stands beside a path, and how well the path and the pose are known: inputs of the trees alone.
//!
//! The networks are trained on links with one error each; a receiver knows the errors of each path and of the pose that it has
//! now, and the other paths of the sweep: an estimate beside a much stronger path is often an artefact of that one.
//! No departure is among these inputs: data association weighs it, and what is weighed twice counts twice.

use super::{
    ANGLE_UNIT_RAD, Arrived, EXCESS_UNIT_M, GEOMETRIC_INPUTS, GEOMETRIC_NAMES, LinkGeometry, RANKS, Received,
    compressed, decibels,
};
use crate::geometry::Direction;
use crate::kernels::sqrt;
use crate::reflection::InputError;

/// Inputs of [`super::LinkGeometry::tree_inputs`].
pub const TREE_INPUTS: usize = GEOMETRIC_INPUTS + BESIDE;

const BESIDE: usize = 14;

const NAMES: [&str; BESIDE] = [
    "excess_sigmas",
    "arrival_off_gmt_sigmas",
    "delay_sigma",
    "arrival_sigma",
    "paths",
    "leaves_towards_z",
    "departure_known",
    "stronger_delay",
    "stronger_angle",
    "stronger_by",
    "nearest_delay",
    "nearest_angle",
    "nearest_by",
    "strongest_angle",
];

/// Names of the trees' inputs: those of the networks without departure, then those that tell what stands beside the path.
pub fn tree_names() -> impl Iterator<Item = &'static str> {
    GEOMETRIC_NAMES.into_iter().take(GEOMETRIC_INPUTS).chain(NAMES)
}

/// Compression: standard deviations of paths that stand alone are a few of these.
const DELAY_SIGMA_UNIT_M: f32 = 0.01;
const ARRIVAL_SIGMA_UNIT_RAD: f32 = 0.002;

/// Paths this far apart in delay, m, or in direction, rad, are equally far: what 200 MHz and four arrays resolve
/// ([`crate::paths`]).
const APART: (f32, f32) = (1.5, 0.2);

/// How another path stands to this one.
#[derive(Clone, Copy)]
struct Other {
    /// Squared distance in units of [`APART`].
    distance: f32,
    /// It comes later by, m.
    later_m: f32,
    cosine: f32,
    /// It is stronger by, dB; 0 where the gains are not known.
    stronger_db: f32,
}

impl Other {
    /// No other path: far off in everything.
    const NONE: Self = Self {
        distance: f32::INFINITY,
        later_m: 1e3,
        cosine: -1.0,
        stronger_db: 0.0,
    };

    fn of(received: &Received, other: &Received) -> Self {
        let later_m = other.path.c_tau_m - received.path.c_tau_m;
        let cosine = other.path.aoa.vector().dot(received.path.aoa.vector());
        let (delay, chord) = (later_m / APART.0, 2.0 - 2.0 * cosine);
        Self {
            distance: delay * delay + chord / (APART.1 * APART.1),
            later_m,
            cosine,
            stronger_db: match (other.gain_db, received.gain_db) {
                (Some(other), Some(own)) => other - own,
                _ => 0.0,
            },
        }
    }

    fn nearer(self, other: Self) -> Self {
        if other.distance < self.distance {
            other
        } else {
            self
        }
    }

    fn values(&self) -> [f32; 3] {
        let angle = sqrt((2.0 - 2.0 * self.cosine).max(0.0));
        [
            compressed(self.later_m, EXCESS_UNIT_M),
            compressed(angle, ANGLE_UNIT_RAD),
            decibels(self.stronger_db),
        ]
    }
}

impl LinkGeometry<'_> {
    /// What stands beside a path, in the order of [`NAMES`].
    pub(super) fn beside(&self, received: &Received, arrived: &Arrived) -> Result<[f32; BESIDE], InputError> {
        let path = &received.path;
        let (mut stronger, mut nearest) = (Other::NONE, Other::NONE);
        for (index, other) in self.paths.iter().enumerate() {
            if Some(index) == arrived.rank {
                continue;
            }
            let other = Other::of(received, other);
            nearest = nearest.nearer(other);
            if arrived.rank.is_none_or(|rank| index < rank) {
                stronger = stronger.nearer(other);
            }
        }
        let [stronger_delay, stronger_angle, stronger_by] = stronger.values();
        let [nearest_delay, nearest_angle, nearest_by] = nearest.values();
        let straight = Direction::from_vector(-self.baseline)?;
        let across_m2 = self.ends.uav_covariance.trace() / (self.baseline_m * self.baseline_m);
        let arrival_variance = 0.5 * (path.covariance.m22 + path.covariance.m33);
        let arrival_sigma = sqrt(arrival_variance.max(0.0));
        let off_sigma = sqrt((arrival_variance + across_m2).max(1e-12));
        let strongest = self.paths.first().map_or(1.0, |strongest| {
            strongest.path.aoa.vector().dot(path.aoa.vector())
        });
        Ok([
            compressed(self.excess_m(path), self.excess_sigma_m(path).max(1e-6)),
            compressed(straight.angle_to_rad(&path.aoa), off_sigma),
            compressed(sqrt(path.covariance.m11.max(0.0)), DELAY_SIGMA_UNIT_M),
            compressed(arrival_sigma, ARRIVAL_SIGMA_UNIT_RAD),
            self.paths.len() as f32 / RANKS,
            arrived.single.incoming.vector().z,
            f32::from(u8::from(path.aod.is_some())),
            stronger_delay,
            stronger_angle,
            stronger_by,
            nearest_delay,
            nearest_angle,
            nearest_by,
            compressed(sqrt((2.0 - 2.0 * strongest).max(0.0)), ANGLE_UNIT_RAD),
        ])
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use nalgebra::Matrix3;

    use super::*;
    use crate::geometry::{Position, World};
    use crate::path::{Departure, Path, diagonal_covariance};
    use crate::reflection::Ends;
    use crate::signal::Waveform;

    fn path(c_tau_m: f32, azimuth_rad: f32, gain_db: f32) -> Received {
        Received {
            path: Path {
                c_tau_m,
                aoa: Direction::<World>::from_zenith_azimuth(1.5, azimuth_rad).expect("finite"),
                aod: None,
                covariance: diagonal_covariance(0.02, 0.002),
            },
            gain_db: Some(gain_db),
        }
    }

    /// An input of the last of these paths, strongest first.
    fn named(paths: &[Received], name: &str) -> f32 {
        let ends = Ends {
            uav: Position::new(0.0, 40.0, 9.0).expect("finite"),
            uav_covariance: Matrix3::identity() * 0.01,
            gmt: Position::new(0.0, 0.0, 1.5).expect("finite"),
        };
        let link = LinkGeometry::new(&ends, paths, &Waveform::default()).expect("apart");
        let inputs = link.tree_inputs(paths.last().expect("some")).expect("sound");
        let place = tree_names().position(|other| other == name).expect("an input");
        inputs[place]
    }

    #[test]
    fn the_nearest_path_and_the_nearest_stronger_one_are_told_apart() {
        let (strong, near, own) = (
            path(50.0, 0.3, -90.0),
            path(61.0, 1.02, -100.0),
            path(60.0, 1.0, -99.0),
        );
        // In the list's order the near one is stronger too.
        let paths = [strong, near, own];
        let expected = [
            ("stronger_delay", libm::asinhf(1.0 / 0.3)),
            ("nearest_by", -0.1),
            ("paths", 3.0 / 8.0),
            ("departure_known", 0.0),
            ("delay_sigma", libm::asinhf(2.0)),
            ("arrival_sigma", libm::asinhf(1.0)),
        ];
        for (name, value) in expected {
            assert!(
                (named(&paths, name) - value).abs() < 1e-4,
                "{name} {}",
                named(&paths, name)
            );
        }
        let chord = 2.0 * libm::sinf(0.01) * libm::sinf(1.5);
        assert!((named(&paths, "nearest_angle") - libm::asinhf(chord / 0.05)).abs() < 1e-3);
        // Without the near one, the strongest.
        let paths = [strong, own];
        assert!((named(&paths, "stronger_delay") + libm::asinhf(10.0 / 0.3)).abs() < 1e-3);
        assert!((named(&paths, "stronger_by") - 0.9).abs() < 1e-4);
    }

    #[test]
    fn a_path_of_the_same_direction_is_nearer_than_one_of_the_same_length() {
        let (along, across) = (path(61.0, 1.01, -100.0), path(60.1, 2.0, -98.0));
        let paths = [along, across, path(60.0, 1.0, -99.0)];
        assert!((named(&paths, "nearest_by") + 0.1).abs() < 1e-4);
    }

    #[test]
    fn a_path_alone_has_nothing_beside_it() {
        let paths = [path(60.0, 1.0, -99.0)];
        assert_eq!(named(&paths, "stronger_by"), 0.0);
        assert!(named(&paths, "nearest_delay") > 8.0);
        assert_eq!(named(&paths, "strongest_angle"), 0.0);
    }

    #[test]
    fn an_excess_is_held_against_its_own_error() {
        let straight = libm::sqrtf(40.0 * 40.0 + 7.5 * 7.5);
        let paths = [path(straight + 0.3, -1.57, -90.0)];
        // Delay .02 m and position .1 m.
        let sigmas = 0.3 / libm::hypotf(0.02, 0.1);
        assert!((named(&paths, "excess_sigmas") - libm::asinhf(sigmas)).abs() < 0.01);
    }

    #[test]
    fn no_direction_of_departure_is_among_the_inputs() {
        let towards = |z: f32| {
            let mut own = path(60.0, 1.0, -99.0);
            own.path.aod = Some(Departure {
                direction: Direction::<World>::from_zenith_azimuth(z, 0.3).expect("finite"),
                sigma_rad: 0.01,
            });
            own
        };
        for name in tree_names() {
            assert_eq!(
                named(&[towards(1.0)], name),
                named(&[towards(2.0)], name),
                "{name}"
            );
        }
        assert_eq!(named(&[towards(1.0)], "departure_known"), 1.0);
    }
}

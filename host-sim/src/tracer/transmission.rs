//! Straight through thin sheets (kind T): panes, boards, doors, and walls that are made of two of them.
//!
//! A face whose material is a slab lets a part of the wave through: T of ITU-R P.2040-3 for each polarisation. The path does not
//! bend; a sheet of thickness d makes it longer by `d (Re sqrt(eta - sin^2) - cos)`. The tree of images takes every face for
//! opaque, so these paths are searched for beside it, image by image: line of sight and at most [`MOST_REFLECTIONS`].

use core::f64::consts::PI;

use nalgebra::Complex;

use super::field::{self, Bounce, departing, dipole, received, received_across};
use super::path::{Place, TracedPath};
use super::tree::{IN_FRONT_M, ImageTree};
use super::{LEAST_DISTANCE_M, Tracer};
use crate::paths::{Interaction, Kind};
use crate::scene::{Scene, Vec3};
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;

/// Reflections beside sheets: the list of all chains of three is as long as the cube of the number of faces.
const MOST_REFLECTIONS: usize = 2;

/// Sheets in a path: three walls of two each.
const MOST_SHEETS: usize = 6;

/// Thicker slabs, m, and those that lose more straight through, dB, let nothing through.
const THICKEST_M: f64 = 0.5;
const MOST_LOSS_DB: f64 = 40.0;

/// Weaker paths are dropped, gain between vertical half-wave dipoles, dB.
const LEAST_GAIN_DB: f64 = -165.0;

/// Which faces of a scene are sheets that let waves through.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sheets {
    of_face: Vec<bool>,
}

/// A reflection on trial.
#[derive(Clone, Copy)]
struct Mirror {
    face: u32,
    /// The transmitter as it seems to be behind it.
    image: Vec3,
}

impl Sheets {
    /// Those of the scene of a tracer.
    pub fn of(tracer: &Tracer<'_>) -> Self {
        let lets_through = |face: u32| {
            let thickness_m = tracer.scene.materials()[tracer.scene.material_of(face)].thickness_m();
            let loss_db = tracer.surfaces.of(face).transmission(1.0).map(|(through, _)| {
                let amplitude = through[0].norm();
                -20.0 * libm::log10(amplitude)
            });
            thickness_m.is_some_and(|m| m <= THICKEST_M) && loss_db.is_some_and(|db| db <= MOST_LOSS_DB)
        };
        let faces = 0..tracer.scene.faces().len() as u32;
        Self {
            of_face: faces.map(lets_through).collect(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        !self.of_face.contains(&true)
    }

    /// Appends the paths to a receiver that go through a sheet or more.
    pub fn trace(&self, tree: &ImageTree<'_>, rx_m: [f64; 3], max_order: usize, paths: &mut Vec<TracedPath>) {
        let (tx, rx) = (Vec3::from(tree.transmitter_m()), Vec3::from(rx_m));
        if (rx - tx).norm() < LEAST_DISTANCE_M {
            return;
        }
        let faces = tree.scene().faces();
        let found = paths.len();
        paths.extend(self.try_chain(tree, &[], &rx));
        let deepest = max_order.min(MOST_REFLECTIONS);
        let mirrors = |from: &Vec3, not: Option<u32>| {
            let from = *from;
            (0..faces.len() as u32).filter_map(move |face| {
                let lit = Some(face) != not && faces[face as usize].height_m(&from) > IN_FRONT_M;
                lit.then(|| Mirror {
                    face,
                    image: faces[face as usize].mirror(&from),
                })
            })
        };
        let faces_rx: Vec<bool> = faces.iter().map(|face| face.height_m(&rx) > IN_FRONT_M).collect();
        if deepest > 0 {
            for first in mirrors(&tx, None) {
                if faces_rx[first.face as usize] {
                    paths.extend(self.try_chain(tree, &[first], &rx));
                }
                if deepest > 1 {
                    let seconds = mirrors(&first.image, Some(first.face));
                    for second in seconds.filter(|second| faces_rx[second.face as usize]) {
                        paths.extend(self.try_chain(tree, &[first, second], &rx));
                    }
                }
            }
        }
        let mut through = paths.split_off(found);
        through.sort_by(TracedPath::by_strength);
        TracedPath::drop_twins(&mut through);
        paths.extend(through);
        paths.sort_by(TracedPath::by_strength);
    }

    /// The path off a chain of mirrors, if there is one, no opaque face is in its way, and a sheet is.
    fn try_chain(&self, tree: &ImageTree<'_>, chain: &[Mirror], rx: &Vec3) -> Option<TracedPath> {
        let scene = tree.scene();
        let tx = Vec3::from(tree.transmitter_m());
        // Transmitter, reflections, receiver; found from behind.
        let mut points = vec![*rx; chain.len() + 2];
        points[0] = tx;
        for (i, mirror) in chain.iter().enumerate().rev() {
            let face = &scene.faces()[mirror.face as usize];
            let seen_from = points[i + 2];
            let (before, behind) = (face.height_m(&seen_from), -face.height_m(&mirror.image));
            if before <= IN_FRONT_M {
                return None;
            }
            let point = seen_from + (mirror.image - seen_from) * (before / (before + behind));
            if !face.contains(&point) {
                return None;
            }
            points[i + 1] = point;
        }
        let mut legs: Vec<Vec<u32>> = Vec::with_capacity(chain.len() + 1);
        let mut count = 0;
        for (leg, ends) in points.windows(2).enumerate() {
            let own = [leg.checked_sub(1), Some(leg)].map(|i| i.and_then(|i| chain.get(i)).map(|m| m.face));
            let mut crossed = Vec::new();
            let opaque = scene.find_crossed(ends[0], ends[1], |face| {
                if own.contains(&Some(face)) {
                    return false;
                }
                if self.of_face[face as usize] {
                    crossed.push(face);
                }
                !self.of_face[face as usize]
            });
            count += crossed.len();
            if opaque.is_some() || count > MOST_SHEETS {
                return None;
            }
            let at = |face: &u32| {
                scene.faces()[*face as usize]
                    .crossing(&ends[0], &ends[1])
                    .unwrap_or(0.0)
            };
            crossed.sort_by(|a, b| at(a).total_cmp(&at(b)));
            legs.push(crossed);
        }
        if count == 0 {
            return None;
        }
        path(tree, chain, &points, &legs)
    }
}

/// The path through points with the sheets of every leg, unless it is too weak.
fn path(tree: &ImageTree<'_>, chain: &[Mirror], points: &[Vec3], legs: &[Vec<u32>]) -> Option<TracedPath> {
    let scene: &Scene = tree.scene();
    let wavelength_m = SPEED_OF_LIGHT_M_PER_S / scene.frequency_hz();
    let way = |leg: usize| (points[leg + 1] - points[leg]).normalize();
    let departure = way(0);
    let mut field = departing(&departure);
    let (mut met, mut excess_m) = (Vec::new(), 0.0);
    for (leg, sheets) in legs.iter().enumerate() {
        let direction = way(leg);
        for &face in sheets {
            let normal = scene.faces()[face as usize].normal();
            let (through, excess_rad) = tree.surface_of(face).transmission(direction.dot(normal).abs())?;
            field = field::transmit(&field, &direction, normal, through);
            excess_m += excess_rad * wavelength_m / (2.0 * PI);
            met.push(Interaction::Transmission);
        }
        if let Some(mirror) = chain.get(leg) {
            let bounce = Bounce {
                normal: scene.faces()[mirror.face as usize].normal(),
                surface: tree.surface_of(mirror.face),
            };
            field = field::reflect(&field, &direction, &bounce, &way(leg + 1));
            met.push(Interaction::Reflection);
        }
    }
    let arrival = -way(legs.len() - 1);
    let length_m: f64 = points.windows(2).map(|leg| (leg[1] - leg[0]).norm()).sum();
    let spread = wavelength_m / (4.0 * PI * length_m) * dipole(&departure) * dipole(&arrival);
    let gain: Complex<f64> = received(&field, &arrival) * spread;
    if gain.norm() < libm::exp10(LEAST_GAIN_DB / 20.0) {
        return None;
    }
    let places = chain.iter().zip(&points[1..]).map(|(mirror, point)| Place {
        point: *point,
        face: Some(mirror.face),
    });
    let [tx, rx] = [points[0], points[points.len() - 1]];
    let mut path = TracedPath::through(Kind::of(&met)?, &tx, places, &rx, gain);
    path.length_m += excess_m;
    Some(path.with_across(received_across(&field, &arrival) * spread))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, RawFace};

    /// A floor of the paper's material and an upright double wall of boards across x = 10, 10 cm thick, with a wall behind the
    /// receiver at x = 30.
    fn walled(material: Material) -> Scene {
        let upright = |x: f64, towards: f64| RawFace {
            vertices: if towards > 0.0 {
                vec![[x, -20.0, 0.0], [x, 20.0, 0.0], [x, 20.0, 8.0], [x, -20.0, 8.0]]
            } else {
                vec![[x, 20.0, 0.0], [x, -20.0, 0.0], [x, -20.0, 8.0], [x, 20.0, 8.0]]
            },
            ..RawFace::default()
        };
        let floor = RawFace {
            vertices: vec![
                [0.0, -20.0, 0.0],
                [30.0, -20.0, 0.0],
                [30.0, 20.0, 0.0],
                [0.0, 20.0, 0.0],
            ],
            ..RawFace::default()
        };
        let faces = vec![
            floor,
            upright(10.0, -1.0),
            upright(10.1, 1.0),
            upright(30.0, -1.0),
        ];
        let scene = Scene::new("walled", Material::PAPER, 30e9, None, faces).unwrap();
        scene.with_materials(&[material], &[None, Some(0), Some(0), None])
    }

    fn board() -> Material {
        Material::named("plasterboard").unwrap().slab(0.0125).unwrap()
    }

    fn trace(scene: &Scene, tx_m: [f64; 3], rx_m: [f64; 3]) -> (Vec<TracedPath>, Vec<TracedPath>) {
        let tracer = Tracer::new(scene, 2).unwrap();
        let tree = tracer.transmitter(tx_m);
        let opaque = tree.trace(rx_m);
        let mut paths = opaque.clone();
        Sheets::of(&tracer).trace(&tree, rx_m, 2, &mut paths);
        (opaque, paths)
    }

    #[test]
    fn a_wall_of_two_boards_passes_what_the_slab_says() {
        let scene = walled(board());
        let (opaque, paths) = trace(&scene, [2.0, 0.0, 2.0], [20.0, 0.0, 2.0]);
        assert!(
            opaque
                .iter()
                .all(|path| path.vertices().iter().all(|v| v[0] <= 10.0))
        );
        let path = paths
            .iter()
            .find(|path| path.order() == 0)
            .expect("through the wall");
        assert_eq!(path.kind().to_string(), "TT");
        // 2.9 dB for each board at normal incidence; sqrt(eta) is 1.653, so 8.2 mm each.
        let free = SPEED_OF_LIGHT_M_PER_S / 30e9 / (4.0 * PI * 18.0) * 1.643;
        let loss_db = -20.0 * libm::log10(path.gain.norm() / free);
        assert!((loss_db - 5.8).abs() < 0.2, "{loss_db}");
        assert!(
            (path.length_m() - 18.0 - 2.0 * 0.0125 * (1.6526 - 1.0)).abs() < 1e-5,
            "{}",
            path.length_m()
        );
        // Carrier phase put back, a board's amplitude is the slab's, whose argument is that of e^{-jq} and of what goes to and fro
        // in it: two boards turn by twice that.
        let k = 2.0 * PI * 30e9 / SPEED_OF_LIGHT_M_PER_S;
        let whole = path.gain / free * Complex::new(0.0, -k * (path.length_m() - 18.0)).exp();
        let eta = board().complex_permittivity(30e9);
        let eta = Complex::new(eta[0], eta[1]);
        let q = eta.sqrt() * (k * 0.0125);
        let r = (Complex::new(1.0, 0.0) - eta.sqrt()) / (Complex::new(1.0, 0.0) + eta.sqrt());
        let j = Complex::new(0.0, 1.0);
        let through = (Complex::new(1.0, 0.0) - r * r) * (-j * q).exp()
            / (Complex::new(1.0, 0.0) - r * r * (-j * q * 2.0).exp());
        let expected = (through * (j * k * 0.0125).exp()).powu(2);
        assert!((whole - expected).norm() < 1e-9, "{whole} {expected}");
        // Off the floor and off the wall at the end, which come behind the boards, and before them on the way back.
        let (_, back) = trace(&scene, [20.0, 0.0, 2.0], [2.0, 0.0, 2.0]);
        for (paths, kind) in [(&paths, "TTR"), (&back, "RTT")] {
            let count = paths
                .iter()
                .filter(|path| path.kind().to_string() == kind)
                .count();
            assert_eq!(count, 2, "{kind}");
        }
        assert!(opaque.iter().all(|path| paths.contains(path)));
    }

    #[test]
    fn aslant_it_comes_back_the_same_way() {
        let scene = walled(board());
        let ends = [[2.0, -3.0, 1.2], [24.0, 9.0, 5.1]];
        let [(_, there), (_, back)] =
            [[ends[0], ends[1]], [ends[1], ends[0]]].map(|[a, b]| trace(&scene, a, b));
        let through = |paths: &[TracedPath]| {
            let with = |path: &&TracedPath| path.kind().interactions().contains(&Interaction::Transmission);
            let mut all: Vec<(f64, f64)> = paths
                .iter()
                .filter(with)
                .map(|path| (path.length_m(), path.gain.norm()))
                .collect();
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
            all
        };
        let [there, back] = [through(&there), through(&back)];
        assert!(there.len() > 2 && there.len() == back.len());
        for (a, b) in there.iter().zip(&back) {
            assert!(
                (a.0 - b.0).abs() < 1e-9 && (a.1 / b.1 - 1.0).abs() < 1e-9,
                "{a:?} {b:?}"
            );
        }
    }

    #[test]
    fn what_is_no_sheet_stays_opaque() {
        let metal = Material::named("metal").unwrap().slab(0.001).unwrap();
        let thick = Material::named("brick").unwrap().slab(0.6).unwrap();
        for material in [Material::named("plasterboard").unwrap(), metal, thick] {
            let scene = walled(material);
            let (opaque, paths) = trace(&scene, [2.0, 0.0, 2.0], [20.0, 0.0, 2.0]);
            assert_eq!(paths, opaque);
            assert!(Sheets::of(&Tracer::new(&scene, 2).unwrap()).is_empty());
        }
    }

    #[test]
    fn offices_are_heard_through_their_walls_when_these_are_boards() {
        let scene = Scene::load("indoor").unwrap().with_drawn_materials();
        let bare = Tracer::new(&scene, 3).unwrap();
        assert!(Sheets::of(&bare).is_empty());
        let scene = scene.with_sheets();
        let (opaque, paths) = trace(&scene, [4.0, 3.0, 1.5], [14.0, 3.0, 2.0]);
        assert!(paths.len() > opaque.len());
        let los = paths
            .iter()
            .find(|path| path.order() == 0)
            .expect("through one wall");
        assert_eq!(los.kind().to_string(), "TT");
    }
}

//! Movers between the ends of a link: they block, weaken and reflect waves.
//!
//! The static scene keeps its image trees; bodies are laid over what a tree has found, for one link at one instant. Cars block,
//! people weaken as four knife edges. Their sides and tops reflect once (kind M), also before or behind the ground (MR, RM), as mirrors
//! of finite size. docs/propagation.md, "Movers", says what is left out.

use nalgebra::Complex;

use super::field::{self, Bounce};
use super::knife_edge::{edge, strip};
use super::path::{Place, TracedPath};
use super::surface::Surface;
use super::tree::ImageTree;
use super::{LEAST_DISTANCE_M, Propagation};
use crate::movers::{Body, BodyKind, Finish, Plate};
use crate::paths::{Interaction, Kind};
use crate::scene::{Lobe, Material, Roughness, Scene, Vec3};
use cslam_core::constants::{SPEED_OF_LIGHT_M_PER_S, VACUUM_PERMITTIVITY_F_PER_M};

/// Weaker paths off movers are dropped, gain between vertical half-wave dipoles, dB.
const LEAST_GAIN_DB: f64 = -165.0;

/// A person so far off a wave, in units of the square root of wavelength times harmonic distance, does nothing to it: 0.1 dB.
const BESIDE: f64 = 9.0;

/// Ground is looked for so far above and below the foot of a mover, m.
const GROUND_M: f64 = 1.0;

/// Faces that look up more than this are ground.
const LEVEL: f64 = 0.9;

/// Bodies between the ends of a link, at one instant.
#[derive(Debug)]
pub struct Bodies<'b> {
    bodies: &'b [Body],
    finishes: [Surface; 3],
    wavelength_m: f64,
}

/// A mirrored end: where it seems to be, and the face that mirrors it.
#[derive(Clone, Copy)]
struct End {
    at: Vec3,
    seems: Vec3,
    grounded: bool,
}

impl<'b> Bodies<'b> {
    /// Bodies in a scene whose waves travel by some rules.
    pub fn new(bodies: &'b [Body], scene: &Scene, propagation: &Propagation) -> Self {
        let frequency_hz = scene.frequency_hz();
        let surface =
            |finish: Finish| Surface::new(&material(finish, frequency_hz), frequency_hz, propagation);
        Self {
            bodies,
            finishes: [Finish::Metal, Finish::Glass, Finish::Skin].map(surface),
            wavelength_m: SPEED_OF_LIGHT_M_PER_S / frequency_hz,
        }
    }

    /// The paths of a tree to a receiver as bodies leave them, with those that bodies make; strongest first.
    pub fn among(&self, tree: &ImageTree<'_>, rx_m: [f64; 3], mut paths: Vec<TracedPath>) -> Vec<TracedPath> {
        let ends = [tree.transmitter_m().into(), Vec3::from(rx_m)];
        paths.retain_mut(|path| {
            let left = self.left_of(path, &ends, None);
            if left < 1.0 {
                path.gain *= left;
            }
            left > 0.0
        });
        for index in 0..self.bodies.len() {
            self.reflect(index, tree, &ends, &mut paths);
        }
        paths.sort_by(TracedPath::by_strength);
        paths
    }

    /// Share of a path's amplitude that bodies leave, save one of them that it is reflected by.
    fn left_of(&self, path: &TracedPath, [tx, rx]: &[Vec3; 2], save: Option<usize>) -> f64 {
        let mut left = 1.0;
        let mut from = *tx;
        let stops = path.vertices().iter().map(|vertex| Vec3::from(*vertex));
        for to in stops.chain([*rx]) {
            for (index, body) in self.bodies.iter().enumerate() {
                if Some(index) == save {
                    continue;
                }
                left *= match body.kind {
                    BodyKind::Car if body.crosses(&from, &to) => 0.0,
                    BodyKind::Car => 1.0,
                    BodyKind::Person => past_person(body, &from, &to, self.wavelength_m),
                };
                if left == 0.0 {
                    return 0.0;
                }
            }
            from = to;
        }
        left
    }

    /// Appends the paths that one body reflects.
    fn reflect(&self, index: usize, tree: &ImageTree<'_>, ends: &[Vec3; 2], paths: &mut Vec<TracedPath>) {
        let body = &self.bodies[index];
        let ground_m = body.foot_m.z;
        let plain = ends.map(|at| End {
            at,
            seems: at,
            grounded: false,
        });
        let mirrored = plain.map(|end| End {
            seems: Vec3::new(end.at.x, end.at.y, 2.0 * ground_m - end.at.z),
            grounded: true,
            ..end
        });
        let ways = [plain, [mirrored[0], plain[1]], [plain[0], mirrored[1]]];
        for plate in body.plates() {
            for way in &ways {
                let path = self.off_plate(index, &plate, way, tree);
                paths.extend(path);
            }
        }
    }

    /// The path between two ends, mirrored or not, by a plate of a body.
    fn off_plate(
        &self,
        index: usize,
        plate: &Plate,
        way: &[End; 2],
        tree: &ImageTree<'_>,
    ) -> Option<TracedPath> {
        let scene = tree.scene();
        let body = &self.bodies[index];
        let heights_m = [0, 1].map(|end| plate.normal.dot(&(way[end].seems - plate.centre)));
        if heights_m.iter().any(|height_m| *height_m <= LEAST_DISTANCE_M) {
            return None;
        }
        let [source, target] = [way[0].seems, way[1].seems];
        let image = source - plate.normal * (2.0 * heights_m[0]);
        let point = image + (target - image) * (heights_m[0] / (heights_m[0] + heights_m[1]));
        let off = point - plate.centre;
        let aside_m = plate.axes.map(|axis| axis.dot(&off));
        if (0..2).any(|i| aside_m[i].abs() > plate.half_m[i]) {
            return None;
        }
        // Where the ground reflects, and by which face.
        let ground = |end: &End| -> Option<Option<(Vec3, u32)>> {
            if !end.grounded {
                return Some(None);
            }
            let (above, below) = (point.z - body.foot_m.z, body.foot_m.z - end.seems.z);
            if above <= LEAST_DISTANCE_M || below <= LEAST_DISTANCE_M {
                return None;
            }
            let at = point + (end.seems - point) * (above / (above + below));
            let up = Vec3::z() * GROUND_M;
            let is_ground = |face: u32| scene.faces()[face as usize].normal().z > LEVEL;
            let face = scene.find_crossed(at + up, at - up, is_ground)?;
            Some(Some((at, face)))
        };
        let (before, behind) = (ground(&way[0])?, ground(&way[1])?);
        let mut points = vec![way[0].at];
        points.extend(before.map(|(at, _)| at));
        points.push(point);
        points.extend(behind.map(|(at, _)| at));
        points.push(way[1].at);
        let lengths_m: Vec<f64> = points.windows(2).map(|leg| (leg[1] - leg[0]).norm()).collect();
        let length_m = lengths_m.iter().sum();
        let finish = &self.finishes[plate.finish as usize];
        let bounce_of_ground = |face: u32| Bounce {
            normal: scene.faces()[face as usize].normal(),
            surface: tree.surface_of(face),
        };
        let bounces = before
            .map(|(_, face)| bounce_of_ground(face))
            .into_iter()
            .chain([Bounce {
                normal: &plate.normal,
                surface: finish,
            }])
            .chain(behind.map(|(_, face)| bounce_of_ground(face)));
        let gain = field::gain(scene.frequency_hz(), &points, bounces, length_m);
        // A mirror of this size: an opening between the image and the target.
        let ends_m = [(point - image).norm(), (target - point).norm()];
        let along = (target - point) / ends_m[1];
        let opening: f64 = (0..2)
            .map(|i| {
                let slope = plate.axes[i].dot(&along);
                let foreshortened = (1.0 - slope * slope).max(0.0).sqrt();
                let half_m = plate.half_m[i];
                let edges_m = [-half_m - aside_m[i], half_m - aside_m[i]].map(|m| m * foreshortened);
                strip(edges_m, ends_m, self.wavelength_m)
            })
            .product();
        let gain: Complex<f64> = gain * opening;
        if gain.norm() < libm::exp10(LEAST_GAIN_DB / 20.0) {
            return None;
        }
        let on_face = |leg: usize| {
            // The faces that a leg starts and ends on.
            let face_at = |place: usize| match (place, before, behind) {
                (1, Some((_, face)), _) => Some(face),
                (place, _, Some((_, face))) if place + 2 == points.len() => Some(face),
                _ => None,
            };
            [face_at(leg), face_at(leg + 1)]
        };
        let clear = points.windows(2).enumerate().all(|(leg, ends)| {
            let own = on_face(leg);
            scene
                .find_crossed(ends[0], ends[1], |face| !own.contains(&Some(face)))
                .is_none()
        });
        if !clear {
            return None;
        }
        let mut met = vec![Interaction::Mover];
        if before.is_some() {
            met.insert(0, Interaction::Reflection);
        }
        if behind.is_some() {
            met.push(Interaction::Reflection);
        }
        let at_mover = usize::from(before.is_some()) + 1;
        let places = points[1..points.len() - 1]
            .iter()
            .enumerate()
            .map(|(i, at)| Place {
                point: *at,
                face: match (i + 1 == at_mover, before, behind) {
                    (true, ..) => None,
                    (false, Some((_, face)), _) | (false, None, Some((_, face))) => Some(face),
                    (false, None, None) => None,
                },
            });
        let mut path = TracedPath::through(Kind::of(&met)?, &way[0].at, places, &way[1].at, gain);
        let left = self.left_of(&path, &[way[0].at, way[1].at], Some(index));
        if left == 0.0 {
            return None;
        }
        path.gain *= left;
        let leg = |i: usize| (points[i + 1] - points[i]) / lengths_m[i];
        path.closing_m_per_s = body.velocity_m_per_s.dot(&(leg(at_mover) - leg(at_mover - 1)));
        Some(path)
    }
}

/// Of what a side of a mover is; what it scatters (S = 0.3 of cars, 0.4 of people) is lost to its reflection.
fn material(finish: Finish, frequency_hz: f64) -> Material {
    let smooth = |material: Material, coefficient: f64| {
        let roughness = Roughness {
            rms_height_m: 0.0,
            lobe: Some(Lobe {
                coefficient,
                exponent: 4,
            }),
        };
        material.with_roughness(roughness).unwrap_or(material)
    };
    let named = |name: &str| Material::named(name).unwrap_or(Material::PAPER);
    match finish {
        Finish::Metal => smooth(named("metal"), 0.3),
        Finish::Glass => {
            let glass = named("glass");
            smooth(glass.slab(0.004).unwrap_or(glass), 0.3)
        }
        Finish::Skin => {
            let omega = core::f64::consts::TAU * frequency_hz;
            let skin = Material::new(16.0, 17.0 * omega * VACUUM_PERMITTIVITY_F_PER_M);
            smooth(skin.unwrap_or(Material::PAPER), 0.4)
        }
    }
}

/// Share of the amplitude of a straight leg that a person leaves: a screen across it, as wide as the body is seen from there.
fn past_person(body: &Body, from: &Vec3, to: &Vec3, wavelength_m: f64) -> f64 {
    let (way, off) = (to - from, body.foot_m - from);
    let level_m = (way.x * way.x + way.y * way.y).sqrt();
    if level_m < LEAST_DISTANCE_M {
        return 1.0;
    }
    let along = Vec3::new(way.x, way.y, 0.0) / level_m;
    let across = Vec3::z().cross(&along);
    let at_m = off.dot(&along);
    if at_m <= 0.0 || at_m >= level_m {
        return 1.0;
    }
    let [half_length, half_width, _] = body.half_m();
    let [forward, left, _] = body.axes();
    let half_m = half_length * forward.dot(&across).abs() + half_width * left.dot(&across).abs();
    let aside_m = off.dot(&across);
    let ends_m = [at_m, level_m - at_m];
    // Height of the wave where the body stands, over its foot.
    let over_m = -off.z + way.z * at_m / level_m;
    let height_m = body.kind.size_m()[2];
    let beside_m = (aside_m.abs() - half_m).max(over_m - height_m);
    let zone_m = (wavelength_m * ends_m[0] * ends_m[1] / level_m).sqrt();
    if beside_m > BESIDE * zone_m {
        return 1.0;
    }
    let across = strip([aside_m - half_m, aside_m + half_m], ends_m, wavelength_m);
    // Seen from the side the leg may rise: an edge over it lies further along it.
    let [cos, sin] = [level_m, way.z].map(|part| part / way.norm());
    let over = |edge_m: f64, inside: bool| {
        let further_m = [edge_m * sin, -edge_m * sin];
        let ends_m = [0, 1].map(|i| ends_m[i] / cos + further_m[i]);
        edge(edge_m * cos, inside, ends_m, wavelength_m)
    };
    let (foot_m, top_m) = (-over_m, height_m - over_m);
    let upright = over(foot_m, foot_m < 0.0) + over(top_m, top_m > 0.0);
    1.0 - across * upright
}

#[cfg(test)]
mod tests;

//! Movers between the ends of a link: they block, weaken and reflect waves.
//!
//! The static scene keeps its image trees; bodies are laid over what a tree has found, for one link at one instant. Cars block,
//! people weaken as four knife edges. Their sides and tops reflect once (kind M), also before or behind the ground (MR, RM), as mirrors
//! of finite size. docs/propagation.md, "Movers", says what is left out.

mod reflecting;

use super::knife_edge::{edge, strip};
use super::path::TracedPath;
use super::surface::Surface;
use super::tree::ImageTree;
use super::{LEAST_DISTANCE_M, Propagation};
use crate::movers::{Body, BodyKind, Finish};
use crate::scene::{Lobe, Material, Roughness, Scene, Vec3};
use cslam_core::constants::{SPEED_OF_LIGHT_M_PER_S, VACUUM_PERMITTIVITY_F_PER_M};

/// A person so far off a wave, in units of the square root of wavelength times harmonic distance, does nothing to it: 0.1 dB.
const BESIDE: f64 = 9.0;

/// Bodies between the ends of a link, at one instant.
#[derive(Debug)]
pub struct Bodies<'b> {
    bodies: &'b [Body],
    finishes: [Surface; 3],
    wavelength_m: f64,
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
                path.weaken(left.into());
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

//! What becomes of a path with the final pose: a point of the map, several, or why not.

use heapless::Vec;

use super::config::{Mapped, Mirrored};
use super::higher_order::{EFFORT, explain};
use super::known::{KNOWN, Known, proving};
use super::mirrors::piece;
use super::paths::Judged;
use super::report::{MappedPoint, Outcome};
use super::specular::{Least, better, both, ground, misfit, point_on};
use super::supposed::suppose;
use super::{CHANNELS, Cslam, PATHS, count};
use crate::ltd::PathEstimator;
use crate::reflection::{Ends, Gates, ReflectionPoint, Rejection, Verdict, solve};

/// What a sweep's paths are held against.
pub(super) struct Scene {
    ends: Ends,
    known: Vec<Known, KNOWN>,
    sweep: u32,
    stop: u32,
    /// Left for paths of several reflections.
    effort: u32,
}

impl<E: PathEstimator<CHANNELS, PATHS>, const VOXELS: usize, const STATES: usize>
    Cslam<'_, E, VOXELS, STATES>
{
    /// Of a sweep that was sent from this stop of the GMT.
    pub(super) fn scene(&self, ends: Ends, sweep: u32, stop: u32) -> Scene {
        Scene {
            known: self.known(&ends),
            ends,
            sweep,
            stop,
            effort: EFFORT,
        }
    }

    /// Mirrors that may prove what a path between these ends is.
    fn known(&self, ends: &Ends) -> Vec<Known, KNOWN> {
        let ground = self.config.accept.point.ground_z_m.and_then(|z| ground(ends, z));
        proving(ground, self.planes.surfaces(), &self.mirrors, &self.supposed)
    }

    /// What becomes of a path that is not the line of sight.
    pub(super) fn outcome(&mut self, scene: &mut Scene, index: usize, judged: &Judged) -> Outcome {
        if self.config.mapped == Mapped::Strongest && index > 0 {
            return Outcome::Unused;
        }
        let Some(probabilities) = judged.probabilities else {
            return Outcome::Unused;
        };
        let accept = self.config.accept;
        let asked = self.config.mirrored;
        let mirrored = asked.and_then(|asked| Some((asked, self.mirrored(scene, judged)?)));
        let least = match (&mirrored, asked) {
            (Some((asked, _)), _) => Least::Mirrored(asked.min_probability),
            (None, Some(asked)) => Least::Alone(asked.min_probability_alone),
            (None, None) => Least::Alone(accept.min_probability),
        };
        if !least.is_reached(&probabilities) {
            let of_several = asked.filter(|asked| {
                self.config.mapped == Mapped::Every && probabilities.higher_order >= asked.min_probability
            });
            return of_several
                .and_then(|asked| self.several(scene, judged, &asked))
                .unwrap_or(Outcome::NotFirstOrder);
        }
        let unsure = judged
            .path
            .aod
            .is_none_or(|departure| departure.sigma_rad > self.config.max_departure_sigma_rad);
        if unsure
            && !judged.off_ground
            && mirrored.is_none()
            && self.config.max_departure_sigma_rad.is_finite()
        {
            return Outcome::DepartureUnknown;
        }
        // How good the point must be is said below, of the better one.
        let gates = Gates {
            max_sigma_m: f32::INFINITY,
            ..accept.point
        };
        match solve(&scene.ends, &judged.path, self.config.form, &gates) {
            Err(error) => Outcome::Input(error),
            Ok(Verdict::Rejected(rejection)) => Outcome::Rejected(rejection),
            Ok(Verdict::Accepted(solved)) => {
                let point = better(&solved, accept.point.max_sigma_m, mirrored.as_ref());
                let Some(point) = point else {
                    return Outcome::Rejected(Rejection::IllConditioned);
                };
                // A point that a mirror made says nothing new of mirrors.
                if solved.sigma_m() <= accept.point.max_sigma_m
                    && let Some(piece) = piece(&scene.ends, &solved.position)
                {
                    let _proven = self.mirrors.enter(scene.sweep, scene.stop, &piece);
                }
                self.mapped(&[point])
            }
        }
    }

    /// Where the ground or the mirror that explains a path best reflected it; `None` when none does. The path was compared with
    /// the ground when it was judged.
    fn mirrored(&self, scene: &Scene, judged: &Judged) -> Option<ReflectionPoint> {
        let ends = &scene.ends;
        let [uav, gmt] = both(ends);
        if judged.off_ground {
            let ground = scene.known.iter().find(|known| known.is_ground())?;
            return point_on(&uav, &gmt, &ground.plane);
        }
        scene
            .known
            .iter()
            .filter(|known| !known.is_ground())
            .filter_map(|known| Some((misfit(ends, &judged.path, &known.plane)?, known)))
            .min_by(|(a, _), (b, _)| a.total_cmp(b))
            .and_then(|(_, known)| point_on(&uav, &gmt, &known.plane))
    }

    /// A path of several reflections: points on the mirrors that explain it, or else what it makes one suppose.
    fn several(&mut self, scene: &mut Scene, judged: &Judged, asked: &Mirrored) -> Option<Outcome> {
        let path = &judged.path;
        let mut points = explain(&scene.ends, path, &scene.known, &mut scene.effort);
        if points.is_none() {
            if scene.effort == 0 {
                count(&mut self.counters.unexplained);
            }
            let ground_z_m = self.config.accept.point.ground_z_m;
            let mut proven = false;
            suppose(&scene.ends, path, &scene.known, ground_z_m, |plane| {
                proven |= self.supposed.enter(scene.sweep, scene.stop, plane);
            });
            if proven {
                // With what it has just proven, this path is explained too.
                scene.known = self.known(&scene.ends);
                points = explain(&scene.ends, path, &scene.known, &mut scene.effort);
            }
        }
        let points = points?;
        let known = points.iter().all(|point| point.sigma_m() <= asked.max_sigma_m);
        Some(if known {
            self.mapped(&points)
        } else {
            Outcome::Rejected(Rejection::IllConditioned)
        })
    }

    /// Enters the points of a path into the map.
    fn mapped(&mut self, points: &[ReflectionPoint]) -> Outcome {
        let mut mapped = Vec::new();
        for point in points {
            // What lies beyond the map's range is counted there.
            let insertion = self.memory.map.insert(point).ok();
            let _fits = mapped.push(MappedPoint {
                point: *point,
                insertion,
            });
        }
        Outcome::Points(mapped)
    }
}

//! One reflection off a side of a mover, also before or behind the ground.

use super::super::LEAST_DISTANCE_M;
use super::super::field::{self, Bounce};
use super::super::knife_edge::strip;
use super::super::path::{Place, TracedPath};
use super::super::tree::ImageTree;
use super::Bodies;
use crate::movers::Plate;
use crate::paths::{Interaction, Kind};
use crate::scene::Vec3;

/// Weaker paths off movers are dropped, gain between vertical half-wave dipoles, dB.
const LEAST_GAIN_DB: f64 = -165.0;

/// Ground is looked for so far above and below the foot of a mover, m.
const GROUND_M: f64 = 1.0;

/// Faces that look up more than this are ground.
const LEVEL: f64 = 0.9;

/// An end of a link.
#[derive(Clone, Copy)]
struct End {
    at: Vec3,
    /// Where it seems to be: in the ground, if that reflects between it and the mover.
    seems: Vec3,
    grounded: bool,
}

/// Where a path turns: off a face of the ground, or off the mover.
struct Stop {
    at: Vec3,
    ground: Option<u32>,
}

/// A plate that mirrors one end into the other, at a point of it.
struct Mirrored {
    image: Vec3,
    point: Vec3,
    target: Vec3,
    /// Of the point off the plate's middle, along its axes, m.
    aside_m: [f64; 2],
}

impl Bodies<'_> {
    /// Appends the paths that one body reflects between transmitter and receiver.
    pub(super) fn reflect(
        &self,
        index: usize,
        tree: &ImageTree<'_>,
        ends: &[Vec3; 2],
        paths: &mut Vec<TracedPath>,
    ) {
        let body = &self.bodies[index];
        let plain = ends.map(|at| End {
            at,
            seems: at,
            grounded: false,
        });
        let in_ground = plain.map(|end| End {
            seems: Vec3::new(end.at.x, end.at.y, 2.0 * body.foot_m.z - end.at.z),
            grounded: true,
            ..end
        });
        let ways = [plain, [in_ground[0], plain[1]], [plain[0], in_ground[1]]];
        for plate in body.plates() {
            for way in &ways {
                paths.extend(self.off_plate(index, &plate, way, tree));
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
        let (scene, body) = (tree.scene(), &self.bodies[index]);
        let mirrored = Mirrored::by(plate, way[0].seems, way[1].seems)?;
        let mover = Stop {
            at: mirrored.point,
            ground: None,
        };
        let mut stops = vec![mover];
        for (end, place) in [(&way[1], 1), (&way[0], 0)] {
            if end.grounded {
                stops.insert(place, ground_between(tree, &mirrored.point, end, body.foot_m.z)?);
            }
        }
        let mut points = vec![way[0].at];
        points.extend(stops.iter().map(|stop| stop.at));
        points.push(way[1].at);
        let legs = || points.windows(2).map(|leg| leg[1] - leg[0]);
        let bounces = stops.iter().map(|stop| match stop.ground {
            Some(face) => Bounce {
                normal: scene.faces()[face as usize].normal(),
                surface: tree.surface_of(face),
            },
            None => Bounce {
                normal: &plate.normal,
                surface: &self.finishes[plate.finish as usize],
            },
        });
        let length_m = legs().map(|leg| leg.norm()).sum();
        let gain = field::gain(scene.frequency_hz(), &points, bounces, length_m)
            * mirrored.opening(plate, self.wavelength_m);
        if gain.norm() < libm::exp10(LEAST_GAIN_DB / 20.0) {
            return None;
        }
        // The faces that a leg starts and ends on are none that could block it.
        let ground_at = |place: Option<usize>| place.and_then(|place| stops.get(place)?.ground);
        let clear = points.windows(2).enumerate().all(|(leg, ends)| {
            let own = [ground_at(leg.checked_sub(1)), ground_at(Some(leg))];
            let hit = scene.find_crossed(ends[0], ends[1], |face| !own.contains(&Some(face)));
            hit.is_none()
        });
        if !clear {
            return None;
        }
        let met: Vec<Interaction> = stops
            .iter()
            .map(|stop| match stop.ground {
                Some(_) => Interaction::Reflection,
                None => Interaction::Mover,
            })
            .collect();
        let places = stops.iter().map(|stop| Place {
            point: stop.at,
            face: stop.ground,
        });
        let ends = way.map(|end| end.at);
        let mut path = TracedPath::through(Kind::of(&met)?, &ends[0], places, &ends[1], gain);
        let left = self.left_of(&path, &ends, Some(index));
        if left == 0.0 {
            return None;
        }
        path.gain *= left;
        let directions: Vec<Vec3> = legs().map(|leg| leg.normalize()).collect();
        let before = stops.iter().position(|stop| stop.ground.is_none())?;
        let turn = directions[before + 1] - directions[before];
        path.closing_m_per_s = body.velocity_m_per_s.dot(&turn);
        Some(path)
    }
}

impl Mirrored {
    /// `None` when one of the ends is behind the plate, or the point beside it.
    fn by(plate: &Plate, source: Vec3, target: Vec3) -> Option<Self> {
        let heights_m = [source, target].map(|end| plate.normal.dot(&(end - plate.centre)));
        if heights_m.iter().any(|height_m| *height_m <= LEAST_DISTANCE_M) {
            return None;
        }
        let image = source - plate.normal * (2.0 * heights_m[0]);
        let point = image + (target - image) * (heights_m[0] / (heights_m[0] + heights_m[1]));
        let aside_m = plate.axes.map(|axis| axis.dot(&(point - plate.centre)));
        let within = (0..2).all(|i| aside_m[i].abs() <= plate.half_m[i]);
        within.then_some(Self {
            image,
            point,
            target,
            aside_m,
        })
    }

    /// Share of the amplitude of a mirror without end: an opening of the plate's size between the image and the target.
    fn opening(&self, plate: &Plate, wavelength_m: f64) -> f64 {
        let ends_m = [
            (self.point - self.image).norm(),
            (self.target - self.point).norm(),
        ];
        let along = (self.target - self.point) / ends_m[1];
        let strips = (0..2).map(|i| {
            let slope = plate.axes[i].dot(&along);
            let foreshortened = (1.0 - slope * slope).max(0.0).sqrt();
            let (half_m, aside_m) = (plate.half_m[i], self.aside_m[i]);
            let edges_m = [-half_m - aside_m, half_m - aside_m].map(|m| m * foreshortened);
            strip(edges_m, ends_m, wavelength_m)
        });
        strips.product()
    }
}

/// Where the ground reflects between a point and an end, at a height; `None` without ground there.
fn ground_between(tree: &ImageTree<'_>, point: &Vec3, end: &End, ground_m: f64) -> Option<Stop> {
    let (above, below) = (point.z - ground_m, ground_m - end.seems.z);
    if above <= LEAST_DISTANCE_M || below <= LEAST_DISTANCE_M {
        return None;
    }
    let at = point + (end.seems - point) * (above / (above + below));
    let up = Vec3::z() * GROUND_M;
    let scene = tree.scene();
    let is_ground = |face: u32| scene.faces()[face as usize].normal().z > LEVEL;
    let face = scene.find_crossed(at + up, at - up, is_ground)?;
    Some(Stop {
        at,
        ground: Some(face),
    })
}

//! Paths with one diffraction: at an edge alone (D), reflected before it (RD) or behind it (DR).
//!
//! Unfolded about the line of an edge, source and receiver lie in one plane: the wave bends where the straight line between
//! them meets the edge (Keller's cone). A source is the transmitter or its image at a face; a receiver likewise. Which part
//! of which edge a source may light depends on the transmitter alone and is found once ([`LitEdges`]). A bound on the gain
//! spares most of the tests for clearance.

mod crossing;
mod dyad;

use self::crossing::Crossing;
use self::dyad::diffract;
use super::Diffraction;
use super::beam::{Plane, SLACK_M, one_face_hides};
use super::edges::{AboutEdge, Edges, IN_FRONT_M, Wedge};
use super::field::{Bounce, departing, dipole, received, reflect};
use super::path::{Place, TracedPath};
use super::surface::Surfaces;
use super::utd::Incidence;
use crate::paths::{Interaction, Kind};
use crate::scene::{Scene, Vec3};

/// Square of the dipole's greatest amplitude, for both ends.
const DIPOLES: f64 = 1.643;

/// A part of an edge that a source may light.
#[derive(Debug)]
struct LitEdge {
    wedge: u32,
    /// The face that the wave is reflected by before the edge.
    face: Option<u32>,
    /// Transmitter or image, m.
    source: Vec3,
    about: AboutEdge,
    /// Angle of the source about the edge, rad.
    phi_rad: f64,
    /// The part, along the edge, m.
    part_m: [f64; 2],
}

/// The edges that a transmitter and its images of one reflection may light.
#[derive(Debug)]
pub(super) struct LitEdges<'t> {
    scene: &'t Scene,
    /// Transmitter, m.
    tx: Vec3,
    edges: &'t Edges,
    options: Diffraction,
    lit: Vec<LitEdge>,
}

/// A path on trial.
struct Trial<'a> {
    wedge: &'a Wedge,
    incidence: Incidence,
    /// Interactions in the order of travel, with the faces of the reflecting ones.
    places: [(Vec3, Option<u32>); 2],
    count: usize,
}

impl<'t> LitEdges<'t> {
    /// Looks from a transmitter and its images (face, place, sides of the beam) of one reflection.
    pub(super) fn of<'i>(
        scene: &'t Scene,
        edges: &'t Edges,
        options: Diffraction,
        tx: &Vec3,
        images: impl Iterator<Item = (u32, Vec3, &'i [Plane])>,
    ) -> Self {
        let mut lit: Vec<LitEdge> = Vec::new();
        let mut look = |face: Option<u32>, source: &Vec3, beam: &[Plane]| {
            for (index, wedge) in edges.wedges.iter().enumerate() {
                if face.is_some_and(|face| wedge.faces().contains(&face)) {
                    continue;
                }
                let Some(about) = wedge.about(source) else {
                    continue;
                };
                let Some(part_m) = clip(wedge, beam) else { continue };
                let ends = part_m.map(|at_m| wedge.point(at_m));
                let legs = ends.iter().map(|end| {
                    let from = face.map_or(*source, |face| {
                        let face = &scene.faces()[face as usize];
                        let (behind, before) = (-face.height_m(source), face.height_m(end).max(0.0));
                        source + (end - source) * (behind / (behind + before))
                    });
                    (from, *end)
                });
                let [first, second] = wedge.faces();
                if one_face_hides(scene, legs, &[first, second, face.unwrap_or(first)]) {
                    continue;
                }
                lit.push(LitEdge {
                    wedge: index as u32,
                    face,
                    source: *source,
                    about,
                    phi_rad: about.angle_rad(),
                    part_m,
                });
            }
        };
        look(None, tx, &[]);
        for (face, source, sides) in images {
            let mut beam = vec![Plane::front_of(&scene.faces()[face as usize])];
            beam.extend_from_slice(sides);
            look(Some(face), &source, &beam);
        }
        Self {
            scene,
            tx: *tx,
            edges,
            options,
            lit,
        }
    }

    /// The strongest diffracted paths to a receiver; DR only when a reflection is allowed.
    pub(super) fn trace(&self, rx: &Vec3, surfaces: &Surfaces<'_>, reflections: bool) -> Vec<TracedPath> {
        let scene = self.scene;
        let seen: Vec<Option<AboutEdge>> = self.edges.wedges.iter().map(|wedge| wedge.about(rx)).collect();
        let mut found = Vec::new();
        for lit in &self.lit {
            if let Some(about) = &seen[lit.wedge as usize] {
                found.extend(self.try_path(lit, None, rx, rx, about, surfaces));
            }
            if !reflections || lit.face.is_some() {
                continue;
            }
            let wedge = &self.edges.wedges[lit.wedge as usize];
            for &face in self.edges.lit_by(scene, lit.wedge) {
                let mirror = &scene.faces()[face as usize];
                if mirror.height_m(rx) <= IN_FRONT_M {
                    continue;
                }
                let image = mirror.mirror(rx);
                if let Some(about) = wedge.about(&image) {
                    found.extend(self.try_path(lit, Some(face), rx, &image, &about, surfaces));
                }
            }
        }
        found.sort_by(TracedPath::by_strength);
        TracedPath::drop_twins(&mut found);
        found.truncate(self.options.most_paths);
        found
    }

    /// The path by a lit edge to a receiver, seen as `image` behind the face that reflects it last.
    fn try_path(
        &self,
        lit: &LitEdge,
        last: Option<u32>,
        rx: &Vec3,
        image: &Vec3,
        about: &AboutEdge,
        surfaces: &Surfaces<'_>,
    ) -> Option<TracedPath> {
        let scene = self.scene;
        let wedge = &self.edges.wedges[lit.wedge as usize];
        let crossing = Crossing::of(
            wedge,
            &lit.about,
            lit.phi_rad,
            about,
            scene.frequency_hz(),
            |at_m| (lit.part_m[0]..=lit.part_m[1]).contains(&at_m),
        )?;
        let Crossing {
            at_m,
            incidence,
            spread,
        } = crossing;
        let least = least_amplitude(&self.options);
        if spread * DIPOLES * incidence.bound() < least {
            return None;
        }
        let point = wedge.point(at_m);
        let mut trial = Trial {
            wedge,
            incidence,
            places: [(point, None); 2],
            count: 1,
        };
        let mirrored = |face: u32, from: &Vec3| {
            let mirror = &scene.faces()[face as usize];
            let (before, behind) = (mirror.height_m(&point), -mirror.height_m(from));
            let at = point + (from - point) * (before / (before + behind));
            (before > IN_FRONT_M && mirror.contains(&at)).then_some((at, Some(face)))
        };
        if let Some(face) = lit.face {
            trial.places[0] = mirrored(face, &lit.source)?;
            trial.count = 2;
        } else if let Some(face) = last {
            trial.places[1] = mirrored(face, image)?;
            trial.count = 2;
        }
        let tx = self.tx;
        if !trial.is_clear(scene, &tx, rx) {
            return None;
        }
        let bounce = |face: u32| Bounce {
            normal: scene.faces()[face as usize].normal(),
            surface: surfaces.of(face),
        };
        let path = TracedPath {
            wedge: Some(lit.wedge),
            ..trial.path(&tx, rx, bounce, surfaces, spread)
        };
        (path.gain.norm() >= least).then_some(path)
    }

    /// A path of one diffraction with its reflection elsewhere than on the face: through these points, off this plane.
    pub(super) fn around(
        &self,
        flat: &TracedPath,
        points: &[Vec3],
        bounce: &Bounce<'_>,
        ends: [&Vec3; 2],
        frequency_hz: f64,
        surfaces: &Surfaces<'_>,
    ) -> Option<TracedPath> {
        let (edge, face) = (flat.kind.edge()?, *flat.faces().first()?);
        let wedge = &self.edges.wedges[flat.wedge? as usize];
        let mut trial_places = [(points[edge], None); 2];
        let mirror = 1 - edge;
        trial_places[mirror] = (*points.get(mirror)?, Some(face));
        // The end on the mirror's side of the edge is seen behind the mirror.
        let mut seen = ends.map(|end| *end);
        let height_m = bounce.normal.dot(&(seen[mirror] - points[mirror]));
        seen[mirror] -= bounce.normal * (2.0 * height_m);
        let [source, receiver] = [wedge.about(&seen[0])?, wedge.about(&seen[1])?];
        let on_edge = |at_m: f64| (0.0..=wedge.length_m).contains(&at_m);
        let crossing = Crossing::of(
            wedge,
            &source,
            source.angle_rad(),
            &receiver,
            frequency_hz,
            on_edge,
        )?;
        let trial = Trial {
            wedge,
            incidence: crossing.incidence,
            places: trial_places,
            count: 2,
        };
        let path = trial.path(ends[0], ends[1], |_| *bounce, surfaces, crossing.spread);
        Some(TracedPath {
            wedge: flat.wedge,
            ..path
        })
    }

    /// The two faces of an edge.
    pub(super) fn flanks(&self, wedge: u32) -> [u32; 2] {
        self.edges.wedges[wedge as usize].faces()
    }

    /// Unit vector along an edge.
    pub(super) fn along(&self, wedge: u32) -> Vec3 {
        self.edges.wedges[wedge as usize].along
    }
}

fn least_amplitude(options: &Diffraction) -> f64 {
    libm::pow(10.0, options.least_gain_db / 20.0)
}

/// The part of an edge within a beam, m along it.
fn clip(wedge: &Wedge, beam: &[Plane]) -> Option<[f64; 2]> {
    let [mut least, mut most] = [0.0, wedge.length_m];
    for plane in beam {
        let depth_m = plane.distance_m(&wedge.from) + SLACK_M;
        let slope = plane.normal.dot(&wedge.along);
        // Depth grows along the edge by the slope.
        if slope > 0.0 {
            least = f64::max(least, -depth_m / slope);
        } else if slope < 0.0 {
            most = f64::min(most, -depth_m / slope);
        } else if depth_m < 0.0 {
            return None;
        }
    }
    (least <= most).then_some([least, most])
}

impl Trial<'_> {
    fn places(&self) -> &[(Vec3, Option<u32>)] {
        &self.places[..self.count]
    }

    /// Whether all legs are free, from the receiver back to the transmitter. Faces that a leg starts or ends on are none
    /// that could block it: it leaves the wedge outwards.
    fn is_clear(&self, scene: &Scene, tx: &Vec3, rx: &Vec3) -> bool {
        let [first, second] = self.wedge.faces();
        let own = |place: Option<&(Vec3, Option<u32>)>, face: u32| match place {
            None => false,
            Some((_, Some(mirror))) => *mirror == face,
            Some((_, None)) => face == first || face == second,
        };
        let places = self.places();
        (0..=places.len()).rev().all(|leg| {
            let (near, far) = (places.get(leg), leg.checked_sub(1).and_then(|i| places.get(i)));
            let [from, to] = [near.map_or(*rx, |p| p.0), far.map_or(*tx, |p| p.0)];
            scene
                .find_crossed(from, to, |face| !own(near, face) && !own(far, face))
                .is_none()
        })
    }

    /// The path with its gain; `bounce` says off what a face reflects.
    fn path<'a>(
        &self,
        tx: &Vec3,
        rx: &Vec3,
        bounce: impl Fn(u32) -> Bounce<'a>,
        surfaces: &Surfaces<'_>,
        spread: f64,
    ) -> TracedPath {
        let places = self.places();
        let at = |i: usize| match i {
            0 => *tx,
            i => places.get(i - 1).map_or(*rx, |place| place.0),
        };
        let departure = (at(1) - at(0)).normalize();
        let mut direction = departure;
        let mut field = departing(&departure);
        for (i, (_, face)) in places.iter().enumerate() {
            let next = (at(i + 2) - at(i + 1)).normalize();
            field = match face {
                Some(face) => reflect(&field, &direction, &bounce(*face), &next),
                None => diffract(&field, self.wedge, &self.incidence, &direction, &next, surfaces),
            };
            direction = next;
        }
        let gain = received(&field, &-direction) * (spread * dipole(&departure) * dipole(&-direction));
        let interactions = [0, 1].map(|i| match self.places[i].1 {
            Some(_) => Interaction::Reflection,
            None => Interaction::Diffraction,
        });
        TracedPath::through(
            Kind::of(&interactions[..self.count]).unwrap_or(Kind::reflections(0)),
            tx,
            places.iter().map(|(point, face)| Place {
                point: *point,
                face: *face,
            }),
            rx,
            gain,
        )
    }
}

#[cfg(test)]
mod exact;
#[cfg(test)]
mod tests;

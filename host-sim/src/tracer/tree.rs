//! The image tree of one transmitter, and the paths to a receiver from it.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use super::beam::{Clipper, Plane, hidden, push_sides};
use super::diffraction::LitEdges;
use super::field::{self, Bounce};
use super::path::Place;
use super::scatter::LitTiles;
use super::surface::{Surface, Surfaces};
use super::uneven::UnevenLink;
use super::{LEAST_DISTANCE_M, MAX_ORDER, TracedPath, Tracer};
use crate::paths::{Kind, Link};
use crate::scene::{Material, Scene, Vec3};

/// Points must be at least this far in front of a face to be reflected by it, m.
pub(super) const IN_FRONT_M: f64 = 1e-9;

const ROOT: u32 = u32::MAX;

/// A mirror image of the transmitter.
#[derive(Clone, Copy, Debug)]
struct Image {
    position: Vec3,
    /// The face that it was last mirrored at.
    face: u32,
    /// The image before, or [`ROOT`].
    parent: u32,
}

/// All images of one transmitter from which a wave may come, with the planes that bound their beams.
#[derive(Debug)]
pub struct ImageTree<'t> {
    tracer: &'t Tracer<'t>,
    scene: &'t Scene,
    tx: Vec3,
    images: Vec<Image>,
    /// Sides of the beam of image `i`: those from `sides_end[i - 1]` up to `sides_end[i]`.
    sides_end: Vec<u32>,
    sides: Vec<Plane>,
    /// Images by last face: a receiver behind the face needs none of them.
    by_face: Vec<FaceImages>,
    /// One for each image.
    obstacles: Vec<Obstacle>,
    /// With diffraction.
    lit_edges: Option<LitEdges<'t>>,
    /// With diffuse scattering.
    lit_tiles: Option<LitTiles<'t>>,
}

/// What blocked the last path from an image: leg and face. The next receiver is often behind the same wall; a look there
/// first saves the search. It changes no result, whoever wrote it, because it is tested again.
#[derive(Debug)]
struct Obstacle(AtomicU64);

impl Obstacle {
    const NONE: u64 = u64::MAX;

    fn load(&self) -> (usize, u32) {
        let value = self.0.load(Relaxed);
        ((value >> 32) as usize, value as u32)
    }

    fn store(&self, leg: usize, face: u32) {
        self.0.store((leg as u64) << 32 | u64::from(face), Relaxed);
    }
}

/// Images that were last mirrored at one face.
#[derive(Debug)]
struct FaceImages {
    front: Plane,
    images: Vec<u32>,
}

impl<'t> ImageTree<'t> {
    /// Grows the tree level by level.
    pub(super) fn grow(tracer: &'t Tracer<'t>, tx: Vec3) -> Self {
        let scene = tracer.scene();
        let mut tree = Self {
            tracer,
            scene,
            tx,
            images: Vec::new(),
            sides_end: Vec::new(),
            sides: Vec::new(),
            by_face: Vec::new(),
            obstacles: Vec::new(),
            lit_edges: None,
            lit_tiles: None,
        };
        let mut clipper = Clipper::default();
        let mut level = 0..0;
        for order in 1..=tracer.max_order() {
            if order == 1 {
                let all: Vec<u32> = (0..scene.faces().len() as u32).collect();
                tree.add_children(ROOT, &all, &mut clipper);
            }
            for parent in level.clone() {
                let lit = tracer.pairs.lit_by(scene, tree.images[parent].face);
                tree.add_children(parent as u32, lit, &mut clipper);
            }
            level = level.end..tree.images.len();
        }
        tree.group();
        tree.obstacles = tree
            .images
            .iter()
            .map(|_| Obstacle(AtomicU64::new(Obstacle::NONE)))
            .collect();
        if let (Some(options), Some(edges)) = (tracer.propagation().diffraction, &tracer.edges) {
            let once = (0..tree.images.len()).filter(|&i| tree.images[i].parent == ROOT);
            let images = once.map(|i| (tree.images[i].face, tree.images[i].position, tree.sides_of(i)));
            tree.lit_edges = Some(LitEdges::of(scene, edges, options, &tx, images));
        }
        if let (Some(options), Some(tiles)) = (tracer.propagation().diffuse, &tracer.tiles) {
            tree.lit_tiles = Some(LitTiles::of(scene, tiles, options, &tx, &tracer.surfaces));
        }
        tree
    }

    /// Adds the images at those of the given faces that the parent's beam reaches.
    fn add_children(&mut self, parent: u32, faces: &[u32], clipper: &mut Clipper) {
        let (source, through) = match self.images.get(parent as usize) {
            Some(image) => (image.position, Some(image.face)),
            None => (self.tx, None),
        };
        // Copied, because the planes of the children go to the same place.
        let mut beam = Vec::new();
        if let Some(face) = through {
            beam.push(Plane::front_of(&self.scene.faces()[face as usize]));
            beam.extend_from_slice(self.sides_of(parent as usize));
        }
        for &target in faces {
            let face = &self.scene.faces()[target as usize];
            if face.height_m(&source) <= IN_FRONT_M
                || !clipper.clip(face.hull(), &beam)
                || hidden(self.scene, &source, through, &clipper.polygon, target)
            {
                continue;
            }
            let position = face.mirror(&source);
            self.images.push(Image {
                position,
                face: target,
                parent,
            });
            push_sides(&position, &clipper.polygon, &mut self.sides);
            self.sides_end.push(self.sides.len() as u32);
        }
    }

    /// Prepares the search: images by face, and of each the side first that most of the scene lies outside of.
    fn group(&mut self) {
        let bounds = self.scene.bounds();
        let centre = 0.5 * (Vec3::from(bounds.min_m) + Vec3::from(bounds.max_m));
        let mut group_of = vec![None; self.scene.faces().len()];
        for (index, image) in self.images.iter().enumerate() {
            let start = if index == 0 { 0 } else { self.sides_end[index - 1] };
            self.sides[start as usize..self.sides_end[index] as usize]
                .sort_by(|a, b| a.distance_m(&centre).total_cmp(&b.distance_m(&centre)));
            let group = *group_of[image.face as usize].get_or_insert_with(|| {
                self.by_face.push(FaceImages {
                    front: Plane::front_of(&self.scene.faces()[image.face as usize]),
                    images: Vec::new(),
                });
                self.by_face.len() - 1
            });
            self.by_face[group].images.push(index as u32);
        }
    }

    fn sides_of(&self, image: usize) -> &[Plane] {
        let start = if image == 0 { 0 } else { self.sides_end[image - 1] };
        &self.sides[start as usize..self.sides_end[image] as usize]
    }

    /// Transmitter position, m.
    pub fn transmitter_m(&self) -> [f64; 3] {
        self.tx.into()
    }

    /// Number of images in the tree.
    pub fn images(&self) -> usize {
        self.images.len()
    }

    /// The scene.
    pub(super) fn scene(&self) -> &'t Scene {
        self.scene
    }

    /// What a face does to waves.
    pub(super) fn surface_of(&self, face: u32) -> &Surface {
        self.tracer.surfaces.of(face)
    }

    /// All paths to a receiver, strongest first; of equal strength, by order and faces.
    pub fn trace(&self, rx_m: [f64; 3]) -> Vec<TracedPath> {
        self.paths(rx_m, &self.tracer.surfaces)
    }

    /// The same as [`Self::trace`], with another material on every face than the scene's. Which specular paths exist does not
    /// depend on it, only their strength does. What faces scatter stays that of the scene's materials.
    pub fn trace_with(&self, rx_m: [f64; 3], material: &Material) -> Vec<TracedPath> {
        self.paths(
            rx_m,
            &Surfaces::all_of(material, self.scene, self.tracer.propagation()),
        )
    }

    fn paths(&self, rx_m: [f64; 3], surfaces: &Surfaces<'_>) -> Vec<TracedPath> {
        let rx = Vec3::from(rx_m);
        let mut paths = Vec::new();
        if (rx - self.tx).norm() >= LEAST_DISTANCE_M && !self.scene.blocked(self.tx.into(), rx_m) {
            paths.push(self.path(&[], &[], &rx, surfaces));
        }
        for face in self.by_face.iter().filter(|face| face.front.admits(&rx)) {
            for &image in &face.images {
                if self.sides_of(image as usize).iter().all(|side| side.admits(&rx)) {
                    paths.extend(self.reflect(image, &rx, surfaces));
                }
            }
        }
        paths.sort_by(TracedPath::by_strength);
        TracedPath::drop_twins(&mut paths);
        if let Some(lit) = &self.lit_edges {
            paths.extend(lit.trace(&rx, surfaces, self.tracer.max_order() > 0));
            paths.sort_by(TracedPath::by_strength);
        }
        if let Some(uneven) = self.scene.uneven() {
            let link = UnevenLink {
                scene: self.scene,
                uneven,
                edges: self.lit_edges.as_ref(),
                ends: [&self.tx, &rx],
                surfaces,
            };
            for path in &mut paths {
                if let Some(met) = link.met(path) {
                    *path = met;
                }
            }
            paths.sort_by(TracedPath::by_strength);
        }
        if let Some(lit) = &self.lit_tiles {
            let strongest = paths.first().map_or(0.0, |path| path.gain.norm_sqr());
            paths.extend(lit.trace(self.scene, &self.tx, &rx, surfaces, strongest));
            paths.sort_by(TracedPath::by_strength);
        }
        paths
    }

    /// Traced paths as a line of a paths file. With diffraction or diffuse scattering every path says its kind.
    pub fn to_link(&self, rx_m: [f64; 3], paths: &[TracedPath]) -> Link {
        let mut link = Link {
            tx: self.tx.into(),
            rx: rx_m,
            paths: paths.iter().map(TracedPath::to_link_path).collect(),
            ..Link::default()
        };
        if self.tracer.propagation().has_kinds() {
            for (line, path) in link.paths.iter_mut().zip(paths) {
                line.kind = Some(path.kind());
            }
        }
        if self.tracer.propagation().cross_polarisation {
            for (line, path) in link.paths.iter_mut().zip(paths) {
                line.cross_gain = (path.across.norm_sqr() > 0.0).then_some([path.across.re, path.across.im]);
            }
        }
        link
    }

    /// The path from an image, if its reflection points exist and every leg is clear.
    fn reflect(&self, image: u32, rx: &Vec3, surfaces: &Surfaces<'_>) -> Option<TracedPath> {
        let faces = self.scene.faces();
        // From the receiver back to the transmitter.
        let mut chain = [0_u32; MAX_ORDER];
        let mut points = [Vec3::zeros(); MAX_ORDER];
        let mut order = 0;
        let mut seen_from = *rx;
        let mut at = image;
        while let Some(image) = self.images.get(at as usize) {
            let face = &faces[image.face as usize];
            let before = face.height_m(&seen_from);
            if before <= IN_FRONT_M {
                return None;
            }
            let behind = -face.height_m(&image.position);
            let point = seen_from + (image.position - seen_from) * (before / (before + behind));
            if !face.contains(&point) {
                return None;
            }
            (chain[order], points[order]) = (image.face, point);
            order += 1;
            seen_from = point;
            at = image.parent;
        }
        if !self.clear(image, rx, &chain[..order], &points[..order]) {
            return None;
        }
        chain[..order].reverse();
        points[..order].reverse();
        Some(self.path(&chain[..order], &points[..order], rx, surfaces))
    }

    /// Whether all legs are free, from the receiver back to the transmitter.
    fn clear(&self, image: u32, rx: &Vec3, chain: &[u32], points: &[Vec3]) -> bool {
        let legs = points.len() + 1;
        let leg = |i: usize| {
            let near = if i == 0 { *rx } else { points[i - 1] };
            let far = points.get(i).copied().unwrap_or(self.tx);
            // The faces that the leg starts and ends on.
            let own = [i.checked_sub(1).and_then(|i| chain.get(i)), chain.get(i)];
            (near, far, move |face: u32| own.contains(&Some(&face)))
        };
        let obstacle = &self.obstacles[image as usize];
        let (last_leg, last_face) = obstacle.load();
        if last_leg < legs {
            let (near, far, _) = leg(last_leg);
            if self.scene.blocked_by(last_face, near, far) {
                return false;
            }
        }
        for i in 0..legs {
            let (near, far, own) = leg(i);
            if let Some(face) = self.scene.find_crossed(near, far, |face| !own(face)) {
                obstacle.store(i, face);
                return false;
            }
        }
        true
    }

    fn path(&self, faces: &[u32], vertices: &[Vec3], rx: &Vec3, surfaces: &Surfaces<'_>) -> TracedPath {
        let order = faces.len();
        let mut points = [*rx; MAX_ORDER + 2];
        points[0] = self.tx;
        points[1..=order].copy_from_slice(vertices);
        let points = &points[..order + 2];
        let length_m = points.windows(2).map(|leg| (leg[1] - leg[0]).norm()).sum();
        let bounces = faces.iter().map(|&face| Bounce {
            normal: self.scene.faces()[face as usize].normal(),
            surface: surfaces.of(face),
        });
        let [gain, across] = field::gains(self.scene.frequency_hz(), points, bounces, length_m);
        let places = vertices.iter().zip(faces).map(|(point, face)| Place {
            point: *point,
            face: Some(*face),
        });
        TracedPath::through(Kind::reflections(order), &self.tx, places, rx, gain).with_across(across)
    }
}

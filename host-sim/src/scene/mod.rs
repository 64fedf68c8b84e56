//! The world as radio sees it: planar faces of a material each, one-sided, with fast visibility queries.
//!
//! A scene comes from a file (JSON of `design/README.md` section 5, OBJ, PLY), from the list of built-in scenes or from
//! the seeded city generator; all of them pass the same validation. A face is the boundary of a solid: it reflects on its
//! front, where its vertices run counter-clockwise, and blocks from both sides. World frame ENU, metres.

mod bounds;
mod city;
mod drawn;
mod error;
mod face;
mod index;
mod indoor;
mod json;
mod kinds;
mod material;
mod obj;
mod panels;
mod place;
mod placement;
mod ply;
mod prism;
mod relief;
mod sheets;
mod street;
mod triangles;
mod uneven;
mod weld;

pub use bounds::Bounds;
pub use error::SceneError;
pub use face::{Face, FaceError, MAX_COORDINATE_M, PLANARITY_TOLERANCE_M};
pub use material::{Lobe, MATERIAL_NAMES, Material, Roughness};
pub use place::{BUILT_IN_NAMES, REFERENCE_SCENE_JSON};
pub use placement::Placement;
pub(crate) use placement::turn;

use index::FaceIndex;

use crate::input::limits::{SCENE_FACES, SCENE_VERTICES};

pub use index::SURFACE_MARGIN_M;
pub(crate) use triangles::triangles;
pub use uneven::Unevenness;
pub(crate) use uneven::{Patch, Uneven};

/// Cartesian vector in the world frame, m (or dimensionless for directions).
pub(crate) type Vec3 = nalgebra::Vector3<f64>;

/// Carrier of the built-in scenes and of meshes, which do not name one, Hz.
pub const DEFAULT_FREQUENCY_HZ: f64 = 30e9;

/// A polygon before validation, as a file or a generator gives it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawFace {
    /// Vertices, counter-clockwise seen from free space, m.
    pub vertices: Vec<[f64; 3]>,
    /// Normal towards free space; only checked against the winding.
    pub normal: Option<[f64; 3]>,
    /// Number of the solid that the face belongs to. Without it, faces that share a vertex form one solid.
    pub object: Option<u32>,
}

/// Horizontal unit vectors to the four sides, off the axes that walls like to run along.
const AROUND: [[f64; 3]; 4] = [
    [0.8, 0.6, 0.0],
    [-0.6, 0.8, 0.0],
    [-0.8, -0.6, 0.0],
    [0.6, -0.8, 0.0],
];

/// Where a ray first meets an object.
struct FirstFace {
    object: u32,
    distance_m: f64,
    /// Seen from behind, that is from inside the object.
    back: bool,
}

/// The faces of polygons, in their order.
fn checked(raw: &[RawFace]) -> Result<Vec<Face>, SceneError> {
    let vertices = raw.iter().map(|face| face.vertices.len()).sum();
    if raw.len() > SCENE_FACES || vertices > SCENE_VERTICES {
        return Err(SceneError::TooLarge {
            faces: raw.len(),
            vertices,
        });
    }
    let face = |(index, raw)| Face::new(raw).map_err(|error| SceneError::Face { index, error });
    raw.iter().enumerate().map(face).collect()
}

/// A validated scene. Immutable; queries take `&self` and may run on any number of threads.
#[derive(Debug)]
pub struct Scene {
    name: String,
    /// The scene's own, then those of single faces.
    materials: Vec<Material>,
    /// For every face, its place among the materials; empty when all have the scene's.
    material_of: Vec<u16>,
    frequency_hz: f64,
    bounds: Bounds,
    faces: Vec<Face>,
    index: FaceIndex,
    /// Where the surfaces are, when they are off the faces.
    uneven: Option<Uneven>,
    /// Of a scene that was moved.
    moved: Option<Box<Moved>>,
}

/// Where a scene stands, and the scene as it was.
#[derive(Debug)]
struct Moved {
    placement: Placement,
    own: Scene,
}

impl Scene {
    /// Builds a scene of polygons. `bounds` is the room to fly in; without it, the box around all faces.
    ///
    /// # Errors
    /// [`SceneError`] naming the first face that is degenerate, not planar, self-intersecting, not finite, or wound
    /// against its stated normal; or a scene without faces.
    pub fn new(
        name: impl Into<String>,
        material: Material,
        frequency_hz: f64,
        bounds: Option<Bounds>,
        raw: Vec<RawFace>,
    ) -> Result<Self, SceneError> {
        let mut faces = checked(&raw)?;
        weld::number_objects(&raw, &mut faces);
        let hull = Bounds::of(&faces).ok_or(SceneError::Unusable("a scene needs at least one face"))?;
        let index = FaceIndex::new(&faces).ok_or(SceneError::Unusable(
            "the faces are too unevenly spread for a search tree",
        ))?;
        Ok(Self {
            name: name.into(),
            materials: vec![material],
            material_of: Vec::new(),
            frequency_hz,
            bounds: bounds.unwrap_or(hull),
            faces,
            index,
            uneven: None,
            moved: None,
        })
    }

    /// The scene turned and moved as a whole, with its materials and its surfaces. One that was moved before is moved anew.
    ///
    /// # Errors
    /// [`SceneError`] naming a face that came to lie too far off.
    pub fn placed(self, placement: Placement) -> Result<Self, SceneError> {
        let own = match self.moved {
            Some(moved) => moved.own,
            None => self,
        };
        if placement.is_none() {
            return Ok(own);
        }
        let place = |v: &Vec3| <[f64; 3]>::from(placement.place(v));
        let raw: Vec<RawFace> = own
            .faces
            .iter()
            .map(|face| RawFace {
                vertices: face.vertices().iter().map(place).collect(),
                normal: None,
                object: Some(face.object()),
            })
            .collect();
        let corners = own.bounds.corners().map(|corner| placement.place(&corner));
        let scene = Self::new(
            own.name.clone(),
            own.materials[0],
            own.frequency_hz,
            Bounds::around(&corners),
            raw,
        )?;
        let uneven = own.uneven.as_ref();
        Ok(Self {
            materials: own.materials.clone(),
            material_of: own.material_of.clone(),
            uneven: uneven.and_then(|uneven| uneven.moved(&scene.faces, placement)),
            moved: Some(Box::new(Moved { placement, own })),
            ..scene
        })
    }

    /// Where the scene stands.
    pub fn placement(&self) -> Placement {
        self.moved
            .as_ref()
            .map_or_else(Placement::default, |moved| moved.placement)
    }

    /// The scene in its own frame, as it was before it was moved.
    pub fn own(&self) -> &Self {
        self.moved.as_ref().map_or(self, |moved| &moved.own)
    }

    /// Name of the scene.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Gives single faces a material of their own: for every face, `None` for the scene's, or the place of one of `own`.
    ///
    /// # Panics
    /// When there are not as many places as faces, or one beyond the end of `own`, or 65 535 of these and more.
    pub(crate) fn with_materials(mut self, own: &[Material], of_face: &[Option<u16>]) -> Self {
        assert!(of_face.len() == self.faces.len() && own.len() < usize::from(u16::MAX));
        assert!(
            of_face
                .iter()
                .flatten()
                .all(|&place| usize::from(place) < own.len())
        );
        self.materials.truncate(1);
        self.materials.extend_from_slice(own);
        self.material_of = of_face
            .iter()
            .map(|place| place.map_or(0, |place| place + 1))
            .collect();
        self
    }

    /// Material of the faces that have none of their own.
    pub fn material(&self) -> &Material {
        &self.materials[0]
    }

    /// All materials: the scene's, then those of single faces.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// Place of a face's material among all.
    pub(crate) fn material_of(&self, face: u32) -> usize {
        self.material_of
            .get(face as usize)
            .map_or(0, |&place| usize::from(place))
    }

    /// The same scene at another carrier, Hz: gains of its paths and materials of ITU-R P.2040-3 follow it, permittivities that a file
    /// or a built-in scene says stay.
    #[must_use]
    pub fn at_frequency(mut self, frequency_hz: f64) -> Self {
        self.frequency_hz = frequency_hz;
        if let Some(moved) = &mut self.moved {
            moved.own.frequency_hz = frequency_hz;
        }
        self
    }

    /// Carrier frequency, Hz.
    pub fn frequency_hz(&self) -> f64 {
        self.frequency_hz
    }

    /// The room to fly in, m: that of the file, or the box around all faces. Of a scene that was moved, the box around that room.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// All faces; a face index anywhere in this crate is a place in this slice.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// Whether a face stands between two points. The first and last [`SURFACE_MARGIN_M`] of the segment do not count, so
    /// that a point on a surface sees what is in front of it.
    pub fn blocked(&self, from_m: [f64; 3], to_m: [f64; 3]) -> bool {
        self.find_crossed(from_m.into(), to_m.into(), |_| true).is_some()
    }

    /// Whether one certain face stands between two points, by the rule of [`Scene::blocked`].
    pub(crate) fn blocked_by(&self, face: u32, from: Vec3, to: Vec3) -> bool {
        index::crosses(&self.faces[face as usize], &from, &to, index::margin(&from, &to))
    }

    /// First face (in tree order) that the predicate accepts among those crossed by the segment.
    pub(crate) fn find_crossed(&self, from: Vec3, to: Vec3, accept: impl FnMut(u32) -> bool) -> Option<u32> {
        self.index.find_crossed(&self.faces, from, to, accept)
    }

    /// Whether the point lies inside a solid: a building, the ground, or behind the wall of a room.
    ///
    /// It is inside an object whose first face straight overhead shows its back. Of an object without a face overhead it
    /// must see backs all around. So objects may be open below (buildings on the ground) or above (walls through a
    /// ceiling), and may stand in each other. A point on top of a surface is outside; one on a wall may be told either way.
    pub fn inside_solid(&self, point_m: [f64; 3]) -> bool {
        // Lifted off the surface that it may stand on.
        let point = Vec3::from(point_m) + Vec3::z() * (2.0 * SURFACE_MARGIN_M);
        let above = self.first_faces(point, Vec3::z());
        if above.iter().any(|hit| hit.back) {
            return true;
        }
        let mut suspects: Option<Vec<u32>> = None;
        for direction in AROUND {
            let hits = self.first_faces(point, direction.into());
            let shows_back = |object: u32| hits.iter().any(|hit| hit.object == object && hit.back);
            let still: Vec<u32> = match &suspects {
                Some(suspects) => suspects
                    .iter()
                    .copied()
                    .filter(|&object| shows_back(object))
                    .collect(),
                None => hits
                    .iter()
                    .filter(|hit| hit.back && above.iter().all(|over| over.object != hit.object))
                    .map(|hit| hit.object)
                    .collect(),
            };
            if still.is_empty() {
                return false;
            }
            suspects = Some(still);
        }
        true
    }

    /// The nearest face of every object along a ray.
    fn first_faces(&self, point: Vec3, direction: Vec3) -> Vec<FirstFace> {
        let mut first: Vec<FirstFace> = Vec::new();
        self.index
            .each_along(&self.faces, point, direction, |face, distance_m| {
                let face = &self.faces[face as usize];
                let hit = FirstFace {
                    object: face.object(),
                    distance_m,
                    back: face.normal().dot(&direction) > 0.0,
                };
                match first.iter_mut().find(|known| known.object == hit.object) {
                    Some(known) if hit.distance_m < known.distance_m => *known = hit,
                    Some(_) => {}
                    None => first.push(hit),
                }
            });
        first
    }

    /// Whether the point is within the bounds, turned with the scene, and in no solid.
    pub fn is_free(&self, point_m: [f64; 3]) -> bool {
        let own_m = self.placement().back(&point_m.into()).into();
        self.own().bounds.contains(own_m) && !self.inside_solid(point_m)
    }
}

#[cfg(test)]
mod tests;

//! What the faces of a scene are, by the object that they belong to: for what no scene file says.

use super::Face;

/// Objects no taller than this are cars outdoors and furniture indoors, m.
const LOW_OBJECT_M: f64 = 2.5;

/// Normals steeper than this look up or down, by their vertical component.
const STEEP: f64 = 0.7;

/// What a face is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FaceKind {
    /// The lowest level: street, floor.
    Ground,
    /// A car, or furniture.
    LowObject,
    /// A wall, upright or leaning.
    Wall,
    /// A roof or a ceiling, or what else of a building is level.
    Roof,
}

/// What the objects of a scene are, by number.
pub(super) struct Kinds {
    /// Least and greatest height of each, m.
    heights_m: Vec<[f64; 2]>,
    /// Height of the lowest face that looks up, m.
    ground_m: f64,
    indoors: bool,
}

/// Whether a face looks up (1) or down (-1); 0 for walls.
fn level(face: &Face) -> i8 {
    i8::from(face.normal().z > STEEP) - i8::from(face.normal().z < -STEEP)
}

/// Least and greatest height of a face, m.
fn height_m(face: &Face) -> [f64; 2] {
    face.vertices()
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
            [low.min(v.z), high.max(v.z)]
        })
}

impl Kinds {
    pub(super) fn of(faces: &[Face]) -> Self {
        let count = faces.iter().map(|face| face.object() as usize + 1).max();
        let mut heights_m = vec![[f64::INFINITY, f64::NEG_INFINITY]; count.unwrap_or(0)];
        for face in faces {
            let [low, high] = height_m(face);
            let of_object = &mut heights_m[face.object() as usize];
            *of_object = [of_object[0].min(low), of_object[1].max(high)];
        }
        let floors = faces.iter().filter(|face| level(face) > 0);
        let ground_m = floors.map(|face| height_m(face)[0]).fold(f64::INFINITY, f64::min);
        // A ceiling: the highest face of its object looks down, and the object has a height.
        let indoors = faces.iter().any(|face| {
            let [low, high] = heights_m[face.object() as usize];
            level(face) < 0 && height_m(face)[0] >= high && high - low > LOW_OBJECT_M
        });
        Self {
            heights_m,
            ground_m,
            indoors,
        }
    }

    /// Whether some object has its ceiling over it.
    pub(super) fn indoors(&self) -> bool {
        self.indoors
    }

    /// What a face is.
    pub(super) fn of_face(&self, face: &Face) -> FaceKind {
        let [low, high] = self.heights_m[face.object() as usize];
        let is_low = high - low <= LOW_OBJECT_M;
        // Indoors a low object over the ground is a lintel.
        let stands = !self.indoors || low <= self.ground_m;
        if level(face) > 0 && height_m(face)[0] <= self.ground_m {
            FaceKind::Ground
        } else if is_low && stands {
            FaceKind::LowObject
        } else if level(face) == 0 {
            FaceKind::Wall
        } else {
            FaceKind::Roof
        }
    }
}

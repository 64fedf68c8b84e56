//! What can be wrong with the faces of a scene.

use super::face::FaceError;
use crate::input::limits::{SCENE_FACES, SCENE_VERTICES};

/// Which face of a scene is wrong, and why.
#[derive(Clone, Debug, PartialEq)]
pub enum SceneError {
    /// A face that is no planar simple polygon; the index counts from 0 in the order of the file.
    Face {
        /// Index of the face.
        index: usize,
        /// What is wrong with it.
        error: FaceError,
    },
    /// More faces than [`SCENE_FACES`], or more vertices in all of them than [`SCENE_VERTICES`].
    TooLarge {
        /// Number of faces.
        faces: usize,
        /// Number of their vertices.
        vertices: usize,
    },
    /// No face at all, or a tree too deep to search; in words.
    Unusable(&'static str),
}

impl std::fmt::Display for SceneError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Face { index, error } => write!(f, "face {index}: {error}"),
            Self::TooLarge { faces, vertices } => write!(
                f,
                "has {faces} faces with {vertices} vertices, at most {SCENE_FACES} with {SCENE_VERTICES} are read"
            ),
            Self::Unusable(why) => f.write_str(why),
        }
    }
}

impl std::error::Error for SceneError {}

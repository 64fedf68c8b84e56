//! Link state classification (LSCN): how probable it is that a path is the line of sight, one reflection, or more.
//!
//! Small dense networks with rectified linear units, and boosted [`Trees`], look at [`features`](LinkGeometry) of measured paths and
//! run in integers. A model is a file: [`Model`] checks it and reads it in place, [`Network`] runs it, [`write()`] makes it;
//! [`Trees`] and [`TreesDescription`] are that for trees.
//!
//! ```text
//! f32 features --offset, scale, round--> int8 --dense, requantise, clamp 0..127--> int8 ... --dense--> i32 sums
//!              --scale of the row--> f32 logits --temperature, softmax--> Probabilities
//! ```
//! Between the rounded inputs and the sums everything is integer arithmetic with one stated rounding a layer; the
//! operations in `f32` are `+ - * /`, square roots and [`libm`]. A host and a chip compute the same bits.
//!
//! Two topologies ([`Shape`]): a chain of dense layers, and the paper's, in which the first layer sees the strongest path
//! alone and its outputs are joined by the other inputs. Sources: Mou and Gao, section "Link State Classification Neural
//! Network"; docs/link-state.md; docs/signal-model.md, "Fixed point".
//!
//! # Example
//! A path as long as the straight way, from where the GMT stands, through the trees that fly; and one 20 m longer, from the side:
//! ```
//! use cslam_core::geometry::{Direction, Matrix3, Position, Vector3};
//! use cslam_core::link_state::{LinkGeometry, LinkState, Received, models};
//! use cslam_core::path::{Path, diagonal_covariance};
//! use cslam_core::reflection::Ends;
//! use cslam_core::signal::Waveform;
//!
//! let ends = Ends { uav: Position::new(0.0, 30.0, 6.0)?, uav_covariance: Matrix3::identity() * 0.01, gmt: Position::new(0.0, 0.0, 2.0)? };
//! let heard = |[x, y, z]: [f32; 3], c_tau_m, gain_db| {
//!     let (aoa, covariance) = (Direction::from_vector(Vector3::new(x, y, z))?, diagonal_covariance(0.05, 2e-3));
//!     Ok::<_, cslam_core::geometry::GeometryError>(Received { path: Path { c_tau_m, aoa, aod: None, covariance }, gain_db: Some(gain_db) })
//! };
//! let paths = [heard([0.0, -30.0, -4.0], 30.27, -91.0)?, heard([20.0, -15.0, -2.0], 50.16, -104.0)?];
//! let (trees, link) = (models::trees()?, LinkGeometry::new(&ends, &paths, &Waveform::default())?);
//! assert_eq!(trees.path(&link, &paths[0])?.state(), LinkState::LineOfSight);
//! assert_ne!(trees.path(&link, &paths[1])?.state(), LinkState::LineOfSight);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```

mod accept;
mod bounce;
mod classifier;
mod error;
mod features;
pub mod format;
mod layout;
mod model;
pub mod models;
mod network;
mod probability;
mod shape;
mod trees;
mod write;

pub use accept::AcceptGate;
pub use classifier::{Classifier, ClassifyError, LinkState, PaperClassifier, PathClassifier, WrongModel};
pub use error::ModelError;
pub use features::{
    Features, GEOMETRIC_INPUTS, GEOMETRIC_NAMES, GEOMETRIC_WITH_DEPARTURE_INPUTS, LinkGeometry,
    PAPER_INPUTS_PER_PATH, PAPER_NAMES, Received, TREE_INPUTS, paper_inputs, tree_names,
};
pub use model::{InputScale, Model};
pub use network::{Activations, InferenceError, Network};
pub use probability::{CLASSES, Probabilities};
pub use shape::{Kind, MAX_INPUTS, MAX_LAYERS, MAX_WIDTH, STATES, Shape};
pub use trees::{LEAVES, LEVELS, MAX_ROUNDS, NODES, Tree, Trees, TreesDescription};
pub use write::{Description, Outputs, Rows, WriteError, write};

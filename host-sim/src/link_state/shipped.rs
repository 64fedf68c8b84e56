//! The models that come with the program: those that fly, and the float networks that they were rounded from.

use std::path::Path;

use cslam_core::link_state::models;

use super::float_model::FloatModel;
use super::model_file::ModelFile;
use crate::input::InputError;

/// Model files: geometric with and without angle of departure, and the paper's for K = 9.
#[derive(Clone, Debug)]
pub struct Shipped {
    /// For paths with angle of departure.
    pub geometric: ModelFile,
    /// For paths without.
    pub geometric_without_departure: ModelFile,
    /// The paper's, K = 9.
    pub paper: ModelFile,
}

impl Default for Shipped {
    fn default() -> Self {
        let file = ModelFile::from_bytes;
        Self {
            geometric: file(models::geometric_file()),
            geometric_without_departure: file(models::geometric_without_departure_file()),
            paper: file(models::paper_file()),
        }
    }
}

impl Shipped {
    /// The three model files of a directory instead.
    ///
    /// # Errors
    /// [`InputError`] naming the file and what is wrong with it.
    pub fn read(directory: &Path) -> Result<Self, InputError> {
        let file = |name: &str| ModelFile::read(&directory.join(name));
        Ok(Self {
            geometric: file("geometric.lscn")?,
            geometric_without_departure: file("geometric-without-departure.lscn")?,
            paper: file("paper-k9.lscn")?,
        })
    }
}

/// The float networks that the geometric models were rounded from: with and without angle of departure.
///
/// # Errors
/// None in a sound build; the signature is that of [`FloatModel::from_bytes`].
pub fn float_geometric() -> Result<[FloatModel; 2], String> {
    Ok([
        FloatModel::from_bytes(include_bytes!("../../models/geometric.safetensors"))?,
        FloatModel::from_bytes(include_bytes!(
            "../../models/geometric-without-departure.safetensors"
        ))?,
    ])
}

/// The same of a directory.
///
/// # Errors
/// [`InputError`] naming the file and what is wrong with it.
pub fn read_float_geometric(directory: &Path) -> Result<[FloatModel; 2], InputError> {
    let file = |name: &str| FloatModel::read(&directory.join(name));
    Ok([
        file("geometric.safetensors")?,
        file("geometric-without-departure.safetensors")?,
    ])
}

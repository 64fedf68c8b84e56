//! The models that come with the program: those that fly, and the float networks that they were rounded from.

use super::float_model::FloatModel;
use super::model_file::ModelFile;

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
            geometric: file(include_bytes!("../../../core/models/geometric.lscn")),
            geometric_without_departure: file(include_bytes!(
                "../../../core/models/geometric-without-departure.lscn"
            )),
            paper: file(include_bytes!("../../../core/models/paper-k9.lscn")),
        }
    }
}

/// The float network of the geometric model with or without angle of departure.
///
/// # Errors
/// None in a sound build; the signature is that of [`FloatModel::from_bytes`].
pub fn float_geometric(departure: bool) -> Result<FloatModel, String> {
    FloatModel::from_bytes(if departure {
        include_bytes!("../../models/geometric.safetensors")
    } else {
        include_bytes!("../../models/geometric-without-departure.safetensors")
    })
}

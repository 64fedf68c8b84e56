//! How a board is built: what `cslam key image` writes into its settings besides the key.

use cslam_firmware::storage::Mount;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Table `[board]`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BoardConfig {
    /// Body axes forward, left and up as axes of the inertial sensor: 1, 2, 3 for its x, y, z, negative for the opposite.
    #[serde(with = "axes")]
    pub mount: Mount,
}

mod axes {
    use super::*;

    pub(super) fn serialize<S: Serializer>(mount: &Mount, to: S) -> Result<S::Ok, S::Error> {
        mount.axes().serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Mount, D::Error> {
        let axes = <[i8; 3]>::deserialize(from)?;
        Mount::new(axes).ok_or_else(|| {
            let message = format!("{axes:?} is no rotation, expected three axes as [1, 2, 3] or [-2, 1, 3]");
            serde::de::Error::custom(message)
        })
    }
}

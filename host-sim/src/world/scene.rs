//! The scene as a world has it: where it stands, and how far its surfaces are off its faces.

use serde::{Deserialize, Serialize};

use crate::input::InputError;
use crate::scene::{Placement, Scene, Unevenness};

/// What becomes of a scene before anything flies in it. The default takes it as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SceneConfig {
    /// Where it stands as a whole; the flight goes with it.
    pub placement: Placement,
    /// How far its surfaces are off its faces.
    pub surfaces: Unevenness,
}

impl SceneConfig {
    /// Uneven ground and facades, where the scene's file has it.
    pub(super) fn real() -> Self {
        Self {
            surfaces: Unevenness::real(),
            ..Self::default()
        }
    }

    /// A scene as this says.
    ///
    /// # Errors
    /// [`InputError`] naming the scene when it does not fit where it shall stand.
    pub fn applied(&self, scene: Scene) -> Result<Scene, InputError> {
        let name = scene.name().to_owned();
        scene
            .with_unevenness(self.surfaces)
            .placed(self.placement)
            .map_err(|error| InputError::new(format!("scene {name}: {error}")))
    }

    /// Checks every figure; the error names the key.
    pub(super) fn check(&self) -> Result<(), InputError> {
        let placement = self.placement.check().map_err(|error| error.under("placement"));
        placement.and_then(|()| self.surfaces.check().map_err(|error| error.under("surfaces")))
    }
}

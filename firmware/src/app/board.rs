//! How much a board has room for: every capacity in one place.

use cslam_core::map::PointCloud;
use cslam_core::paths::{Estimator, EstimatorConfig};

/// Voxels of the map, 30 bytes each.
pub const VOXELS: usize = 3072;

/// The map.
pub type Map = PointCloud<VOXELS>;

/// Path estimation in our mode: four arrays of eight elements, 72 beams of three faces of 8 x 8 elements, a grid of 360
/// directions, nine paths. `M` is told where the time goes.
pub type Best<M = ()> = Estimator<4, 8, 32, 72, 3, 8, 8, 360, 9, M>;

/// Its configuration.
pub type BoardEstimatorConfig = EstimatorConfig<4, 8, 3, 8, 8, 3>;

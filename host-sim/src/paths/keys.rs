//! Every key that a line of a paths file may hold. Those that no field of a link is for are read over, but named here, so that a
//! misspelt one does not pass for one of them.
#![expect(dead_code, reason = "only the names matter")]

use serde::Deserialize;
use serde::de::IgnoredAny;

/// Keys of a link.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LinkKeys {
    tx: Option<IgnoredAny>,
    rx: Option<IgnoredAny>,
    paths: Option<Vec<PathKeys>>,
    /// Axes of the angles of arrival.
    pub(super) frame: Option<String>,
    // Of `cslam estimate`.
    recording: Option<IgnoredAny>,
    mode: Option<IgnoredAny>,
    beams: Option<IgnoredAny>,
    clips: Option<IgnoredAny>,
}

/// Keys of a path.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PathKeys {
    order: Option<IgnoredAny>,
    delay_s: Option<IgnoredAny>,
    aoa_zenith_rad: Option<IgnoredAny>,
    aoa_azimuth_rad: Option<IgnoredAny>,
    aod_zenith_rad: Option<IgnoredAny>,
    aod_azimuth_rad: Option<IgnoredAny>,
    gain: Option<IgnoredAny>,
    first_vertex: Option<IgnoredAny>,
    last_vertex: Option<IgnoredAny>,
    snr_db: Option<IgnoredAny>,
    covariance: Option<IgnoredAny>,
    confirmed: Option<IgnoredAny>,
    // Of `cslam estimate`.
    beam: Option<IgnoredAny>,
    aoa_body_zenith_rad: Option<IgnoredAny>,
    aoa_body_azimuth_rad: Option<IgnoredAny>,
    aod_sigma_rad: Option<IgnoredAny>,
    // Of `cslam trace --vertices`; `faces` of diffracted paths as well.
    faces: Option<IgnoredAny>,
    vertices: Option<IgnoredAny>,
    // Of lists with diffracted paths: the kinds of interaction in order, the edge, its wedge, and the angles at it.
    kind: Option<IgnoredAny>,
    edge: Option<IgnoredAny>,
    edge_point: Option<IgnoredAny>,
    wedge_exterior_rad: Option<IgnoredAny>,
    phi_in_rad: Option<IgnoredAny>,
    phi_out_rad: Option<IgnoredAny>,
    beta_rad: Option<IgnoredAny>,
}

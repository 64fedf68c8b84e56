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
    measured: Option<IgnoredAny>,
    time_s: Option<IgnoredAny>,
    uav_quaternion_wb: Option<IgnoredAny>,
    // Of `cslam estimate`.
    recording: Option<IgnoredAny>,
    mode: Option<IgnoredAny>,
    beams: Option<IgnoredAny>,
    clips: Option<IgnoredAny>,
}

impl LinkKeys {
    /// What to add to a line that is whole but for the place of an end, as `cslam estimate` writes it of a recording that does
    /// not know its places.
    pub(super) fn missing_end(&self) -> Option<String> {
        self.paths.as_ref()?;
        let missing = |end: &Option<IgnoredAny>, key: &str, whose: &str, recorded: &str| {
            end.is_none().then(|| {
                format!(
                    "`{key}` is missing: add the {whose}'s position, \"{key}\":[x,y,z] in m, world frame \
                     (`cslam estimate` takes it from `{recorded}` of a recording)"
                )
            })
        };
        missing(&self.rx, "rx", "receiver (UAV)", "cslam:uav_position_m")
            .or_else(|| missing(&self.tx, "tx", "transmitter (GMT)", "cslam:gmt_position_m"))
    }
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
    cross_gain: Option<IgnoredAny>,
    first_vertex: Option<IgnoredAny>,
    last_vertex: Option<IgnoredAny>,
    snr_db: Option<IgnoredAny>,
    covariance: Option<IgnoredAny>,
    confirmed: Option<IgnoredAny>,
    closing_m_per_s: Option<IgnoredAny>,
    // Of `cslam estimate`.
    beam: Option<IgnoredAny>,
    aoa_body_zenith_rad: Option<IgnoredAny>,
    aoa_body_azimuth_rad: Option<IgnoredAny>,
    aod_sigma_rad: Option<IgnoredAny>,
    // Of `cslam trace --vertices`; `faces` of diffracted paths as well.
    faces: Option<IgnoredAny>,
    vertices: Option<IgnoredAny>,
    // Of lists with diffracted paths: the edge, its wedge, and the angles at it.
    kind: Option<IgnoredAny>,
    edge: Option<IgnoredAny>,
    edge_point: Option<IgnoredAny>,
    wedge_exterior_rad: Option<IgnoredAny>,
    phi_in_rad: Option<IgnoredAny>,
    phi_out_rad: Option<IgnoredAny>,
    beta_rad: Option<IgnoredAny>,
}

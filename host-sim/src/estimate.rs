//! Path estimation on recordings: exactly the estimator that flies, its result in the paths format.
//!
//! An estimate is a link of the paths format with what measured paths have more: beam, SNR, covariance, and the angles in
//! body axes, in which the arrays measure. A recording with the UAV's attitude gives world angles too, and then the line
//! feeds `cslam solve` as it is.

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{Body, Direction, Frame, Gmt, Matrix3, Rotation, World};
use cslam_core::path::Path;
use cslam_core::paths::{
    ElementErrors, EstimatedPath, Estimator, EstimatorConfig, PaperEstimator, PathEstimator, TapDelays,
};
use serde::{Deserialize, Serialize};

use crate::channel;
use crate::sigmf::{self, Recording};

/// Which estimator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Streaming peak search with off-grid scoring: the default of the receiver.
    Best,
    /// The published low-rank decomposition, delays on whole taps.
    Paper,
    /// The same, delays between the taps: the paper does not say which.
    PaperInterpolated,
}

impl Mode {
    /// Every one.
    pub const ALL: [Self; 3] = [Self::Best, Self::Paper, Self::PaperInterpolated];

    /// Name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Best => "best",
            Self::Paper => "paper",
            Self::PaperInterpolated => "paper-interpolated",
        }
    }
}

/// An estimator for 32 channels, 72 beams and nine paths.
pub fn estimator(mode: Mode, config: &EstimatorConfig) -> Box<dyn PathEstimator<32, 9>> {
    match mode {
        Mode::Best => Box::new(Estimator::<4, 8, 32, 72, 3, 8, 8, 360, 9>::new(config)),
        Mode::Paper => Box::new(PaperEstimator::<4, 8, 32, 72, 9>::new(config)),
        Mode::PaperInterpolated => {
            let whole = PaperEstimator::<4, 8, 32, 72, 9>::new(config);
            Box::new(whole.with_delays(TapDelays::Interpolated))
        }
    }
}

/// Axes that the angles of arrival of an estimate refer to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Axes {
    /// The recording knows the UAV's attitude.
    World,
    /// It does not.
    Body,
}

/// What the estimator found in one recording: a line of `cslam estimate --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Position of the GMT, world frame, m, where the recording has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tx: Option<[f64; 3]>,
    /// Position of the UAV, world frame, m, where the recording has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rx: Option<[f64; 3]>,
    /// Always true: the paths have their errors, whoever reads them adds none.
    pub measured: bool,
    /// Attitude of the UAV [w, x, y, z], body to world, where the recording has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uav_quaternion_wb: Option<[f64; 4]>,
    /// Axes of `aoa_zenith_rad`, `aoa_azimuth_rad` and of the covariance.
    pub frame: Axes,
    /// Estimator.
    pub mode: Mode,
    /// Beams in the recording, of 72.
    pub beams: usize,
    /// Samples that clipped in the transforms, see [`cslam_core::paths::BeamReport::clips`].
    pub clips: u32,
    /// Paths, strongest first.
    pub paths: Vec<Estimated>,
}

/// One estimated path.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimated {
    /// Absolute delay, clock offset included, s.
    pub delay_s: f64,
    /// Zenith angle of arrival, rad, in the line's `frame`.
    pub aoa_zenith_rad: f64,
    /// Azimuth of arrival, rad, in the line's `frame`.
    pub aoa_azimuth_rad: f64,
    /// Zenith angle of arrival in body axes, rad.
    pub aoa_body_zenith_rad: f64,
    /// Azimuth of arrival in body axes, rad.
    pub aoa_body_azimuth_rad: f64,
    /// Zenith angle of departure, world frame, rad; absent when the beams did not show it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aod_zenith_rad: Option<f64>,
    /// Azimuth of departure, rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aod_azimuth_rad: Option<f64>,
    /// Standard deviation of the departure along any tangent, rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aod_sigma_rad: Option<f64>,
    /// SNR per element and active subcarrier in the strongest beam, mean over the elements, dB.
    pub snr_db: f64,
    /// Transmit beam in which the path was strongest.
    pub beam: u16,
    /// Covariance by noise of (c tau in m, angles along the tangents e1, e2 of the line's `frame` in rad).
    pub covariance: [[f64; 3]; 3],
    /// The path as the receiver has it: what the lines of `cslam estimate --csv` are made of.
    #[serde(skip)]
    pub found: EstimatedPath<World>,
}

/// Runs an estimator over the blocks of a recording, which it works on in place. `gmt_heading_rad`: azimuth at which the
/// first face of the GMT looks; recordings do not hold it.
///
/// # Errors
/// In words: a recording without blocks, or of beam squint symbols.
pub fn estimate(recording: &mut Recording, mode: Mode, gmt_heading_rad: f64) -> Result<Estimate, String> {
    if recording.codebook != sigmf::Codebook::Beams {
        return Err(format!(
            "`cslam:codebook` is \"{}\", expected \"{}\": paths are estimated from the ordinary beams",
            recording.codebook.name(),
            sigmf::Codebook::Beams.name()
        ));
    }
    if recording.blocks.is_empty() {
        return Err("`captures` is empty, expected one a transmit beam".to_owned());
    }
    let heading = Rotation::<Gmt, World>::from_yaw_pitch_roll(gmt_heading_rad as f32, 0.0, 0.0)
        .map_err(|e| format!("heading of the GMT: {e}"))?;
    let attitude = recording
        .uav_quaternion_wb
        .map(Rotation::<Body, World, f64>::from_quaternion)
        .transpose()
        .map_err(|e| format!("`cslam:uav_quaternion_wb`: {e}"))?;
    let config = EstimatorConfig {
        element_errors: ElementErrors::BUDGET,
        ..EstimatorConfig::of(&recording.radio.unwrap_or_default().config())
    };
    let mut estimator = estimator(mode, &config);
    let mut clips = 0_u32;
    for block in channel::strongest_first(&mut recording.blocks) {
        clips = clips.saturating_add(estimator.push_beam(block.view()).clips);
    }
    let paths = estimator.finish();
    Ok(Estimate {
        tx: recording.gmt_position_m,
        rx: recording.uav_position_m,
        measured: true,
        uav_quaternion_wb: recording.uav_quaternion_wb,
        frame: if attitude.is_some() {
            Axes::World
        } else {
            Axes::Body
        },
        mode,
        beams: recording.blocks.len(),
        clips,
        paths: paths
            .iter()
            .map(|path| estimated(&path.with_departure_in_world(&heading), attitude.as_ref()))
            .collect::<Result<_, _>>()?,
    })
}

fn estimated(
    found: &EstimatedPath<World>,
    attitude: Option<&Rotation<Body, World, f64>>,
) -> Result<Estimated, String> {
    let wide = |e| format!("the estimator gave no direction: {e}");
    let body = Path::<Body, f64> {
        c_tau_m: f64::from(found.path.c_tau_m),
        aoa: Direction::from_vector(found.path.aoa.vector().cast()).map_err(wide)?,
        aod: None,
        covariance: found.path.covariance.cast(),
    };
    let body_angles = angles(&body.aoa);
    let (seen, covariance) = match attitude {
        Some(attitude) => {
            let world = body.to_world(attitude, &Matrix3::zeros());
            (angles(&world.aoa), world.covariance)
        }
        None => (body_angles, body.covariance),
    };
    let departure = found
        .path
        .aod
        .map(|aod| Direction::<World, f64>::from_vector(aod.direction.vector().cast()).map(|d| angles(&d)))
        .transpose()
        .map_err(wide)?;
    Ok(Estimated {
        delay_s: body.c_tau_m / SPEED_OF_LIGHT_M_PER_S,
        aoa_zenith_rad: seen[0],
        aoa_azimuth_rad: seen[1],
        aoa_body_zenith_rad: body_angles[0],
        aoa_body_azimuth_rad: body_angles[1],
        aod_zenith_rad: departure.map(|d| d[0]),
        aod_azimuth_rad: departure.map(|d| d[1]),
        aod_sigma_rad: found.path.aod.map(|aod| f64::from(aod.sigma_rad)),
        snr_db: f64::from(found.snr_db),
        beam: found.beam,
        covariance: std::array::from_fn(|r| std::array::from_fn(|c| covariance[(r, c)])),
        found: *found,
    })
}

/// Zenith and azimuth, rad.
fn angles<F: Frame>(direction: &Direction<F, f64>) -> [f64; 2] {
    [direction.zenith_rad(), direction.azimuth_rad()]
}

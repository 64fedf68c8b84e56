//! The estimated paths of a recorded flight: what path estimation and beam squint made of its samples, a sweep a line.
//!
//! Numbers are those of the receiver to the last bit: single precision, written with as many digits as tell it from its neighbours.

use std::path::Path;

use cslam_core::beam_squint::{Bearing, Delay, Refusal};
use cslam_core::geometry::{Direction, Frame, Matrix3, Vector3};
use cslam_core::path::{self, Departure, RangeRate};
use cslam_core::paths::EstimatedPath;
use cslam_firmware::app::Estimated;
use nalgebra::Matrix2;
use serde::{Deserialize, Serialize};

use super::read::content;
use super::{Damage, FileEntry, MANIFEST, Manifest, crc32};
use crate::config::DepartureChoice;
use crate::estimate;
use crate::input::limits::ESTIMATED_PATHS;
use crate::input::{InputError, from_json_line, lines};

/// Name of the file.
pub(super) const ESTIMATED: &str = "estimated_paths.jsonl";

/// What a recording says of its estimated paths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Estimates {
    /// Who estimated the paths.
    pub estimator: estimate::Mode,
    /// How the bearings were read.
    pub departures: DepartureChoice,
    /// CRC-32 of the simulated world's configuration, as TOML with every key.
    pub world_crc32: u32,
    /// The file.
    pub file: FileEntry,
}

/// A line.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SweepLine {
    sweep: u32,
    beams: u16,
    #[serde(default, skip_serializing_if = "is_zero")]
    pilots: u16,
    squint_symbols: u16,
    whole: bool,
    paths: Vec<PathLine>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sighted: Option<SightedLine>,
}

/// A path of a line.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PathLine {
    c_tau_m: f32,
    aoa: [f32; 3],
    covariance: [[f32; 3]; 3],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    aod: Option<[f32; 3]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    aod_sigma_rad: Option<f32>,
    beam: u16,
    snr_db: f32,
    energy: f32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    range_rate: Option<RangeRateLine>,
}

/// How fast a path grows, as [`RangeRate`] has it.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RangeRateLine {
    m_per_s: f32,
    sigma_m_per_s: f32,
    period_m_per_s: f32,
}

/// What beam squint was told to listen to, and what it made of it: a bearing, or why there is none.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SightedLine {
    path: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    bearing: Option<BearingLine>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    refusal: Option<String>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BearingLine {
    face: usize,
    cosines: [f32; 2],
    covariance: [[f32; 2]; 2],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    c_tau_m: Option<f32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    c_tau_variance_m2: Option<f32>,
}

/// Writes the estimated paths of sweeps 0, 1, 2 ... into a directory; what the recording is to say of the file.
///
/// # Errors
/// [`InputError`] naming a sweep with a number that is none, or a file that cannot be written.
pub fn write_estimated(directory: &Path, sweeps: &[Estimated]) -> Result<FileEntry, InputError> {
    let text = text(sweeps)?;
    let file = directory.join(ESTIMATED);
    std::fs::write(&file, &text).map_err(|e| InputError::unwritable(&file, "cannot be written", &e))?;
    Ok(FileEntry {
        name: ESTIMATED.into(),
        records: sweeps.len() as u64,
        bytes: text.len() as u64,
        crc32: crc32(text.as_bytes()),
    })
}

fn text(sweeps: &[Estimated]) -> Result<String, InputError> {
    let mut text = String::new();
    for (sweep, estimated) in (0..).zip(sweeps) {
        let failed = |why: &str| InputError::new(format!("sweep {sweep}: its paths cannot be kept: {why}"));
        let line =
            serde_json::to_string(&SweepLine::of(sweep, estimated)).map_err(|e| failed(&e.to_string()))?;
        // Absent keys are left out, so a null is a number that is none.
        if line.contains("null") {
            return Err(failed("a number is not finite"));
        }
        text += &line;
        text.push('\n');
    }
    Ok(text)
}

/// Reads the estimated paths of a recording, sweeps 0, 1, 2 ...; `None` when it has none. A line that is damaged and counted is a sweep
/// without a block.
///
/// # Errors
/// [`InputError`] naming the file, the line and the key that is damaged, unless damage is counted.
pub fn read_estimated(
    directory: &Path,
    manifest: &Manifest,
    damage: &mut Damage,
) -> Result<Option<Vec<Estimated>>, InputError> {
    let Some(Estimates { file: entry, .. }) = &manifest.estimated else {
        return Ok(None);
    };
    check(directory, entry)?;
    read_file(directory, entry, damage).map(Some)
}

/// Reads the file that is described.
fn read_file(directory: &Path, entry: &FileEntry, damage: &mut Damage) -> Result<Vec<Estimated>, InputError> {
    let file = directory.join(ESTIMATED);
    let bytes = content(directory, entry, damage)?;
    let text = String::from_utf8_lossy(&bytes);
    let mut sweeps: Vec<Estimated> = Vec::new();
    for line in lines(&file, &text, &ESTIMATED_PATHS) {
        let (number, line) = line?;
        let at_line = |message| InputError::at_line(&file, number, message);
        let read = from_json_line(&file, number, line, "the paths of a sweep").and_then(|line: SweepLine| {
            let estimated = line.estimated().map_err(at_line)?;
            Ok((line.sweep, estimated))
        });
        match read {
            Ok((sweep, estimated)) => {
                let (at, expected) = (sweep as usize, sweeps.len());
                if at != expected {
                    let missing = at.saturating_sub(expected) as u64;
                    let error = at_line(format!("sweep is {sweep}, expected {expected}"));
                    damage.found(ESTIMATED, missing, error)?;
                }
                // One that comes again, or after the last, is left out.
                if at >= expected && u64::from(sweep) < entry.records {
                    sweeps.resize(at, Estimated::default());
                    sweeps.push(estimated);
                }
            }
            Err(error) => {
                damage.found(ESTIMATED, 1, error)?;
                sweeps.push(Estimated::default());
            }
        }
    }
    if sweeps.len() as u64 != entry.records {
        let message = format!(
            "{} records, expected {} as {MANIFEST} says",
            sweeps.len(),
            entry.records
        );
        damage.found(
            ESTIMATED,
            entry.records.saturating_sub(sweeps.len() as u64),
            InputError::in_file(&file, message),
        )?;
    }
    Ok(sweeps)
}

/// Whether the entry is one of a file of this kind.
fn check(directory: &Path, entry: &FileEntry) -> Result<(), InputError> {
    let wrong = |message| Err(InputError::in_file(&directory.join(MANIFEST), message));
    if entry.name != ESTIMATED {
        return wrong(format!("estimated: name is {}, expected {ESTIMATED}", entry.name));
    }
    if entry.bytes > ESTIMATED_PATHS.bytes {
        return wrong(format!(
            "bytes of {ESTIMATED} is {}, expected up to {}",
            entry.bytes, ESTIMATED_PATHS.bytes
        ));
    }
    Ok(())
}

impl SweepLine {
    fn of(sweep: u32, estimated: &Estimated) -> Self {
        Self {
            sweep,
            beams: estimated.beams,
            pilots: estimated.pilots,
            squint_symbols: estimated.squint_symbols,
            whole: estimated.whole,
            paths: estimated.paths.iter().map(PathLine::of).collect(),
            sighted: estimated
                .sighted
                .as_ref()
                .map(|(path, bearing)| SightedLine::of(*path, bearing)),
        }
    }

    /// What it says, or what is wrong with it.
    fn estimated(&self) -> Result<Estimated, String> {
        let mut paths = heapless::Vec::new();
        for (index, path) in self.paths.iter().enumerate() {
            let path = path.path().map_err(|why| format!("path {index}: {why}"))?;
            paths
                .push(path)
                .map_err(|_| format!("{} paths, expected up to {}", self.paths.len(), paths.capacity()))?;
        }
        let sighted = self.sighted.as_ref().map(SightedLine::sighted).transpose()?;
        if let Some((path, _)) = sighted.as_ref().filter(|(path, _)| *path >= paths.len()) {
            return Err(format!(
                "sighted: path is {path}, expected one of {}",
                paths.len()
            ));
        }
        Ok(Estimated {
            beams: self.beams,
            pilots: self.pilots,
            squint_symbols: self.squint_symbols,
            whole: self.whole,
            paths,
            sighted,
        })
    }
}

impl PathLine {
    fn of(estimated: &EstimatedPath) -> Self {
        let path = &estimated.path;
        Self {
            c_tau_m: path.c_tau_m,
            aoa: (*path.aoa.vector()).into(),
            covariance: std::array::from_fn(|i| std::array::from_fn(|j| path.covariance[(i, j)])),
            aod: path.aod.map(|departure| (*departure.direction.vector()).into()),
            aod_sigma_rad: path.aod.map(|departure| departure.sigma_rad),
            beam: estimated.beam,
            snr_db: estimated.snr_db,
            energy: estimated.energy,
            range_rate: estimated.range_rate.map(RangeRateLine::of),
        }
    }

    fn path(&self) -> Result<EstimatedPath, String> {
        let aod = match (self.aod, self.aod_sigma_rad) {
            (Some(unit), Some(sigma_rad)) => Some(Departure {
                direction: direction("aod", unit)?,
                sigma_rad,
            }),
            (None, None) => None,
            _ => return Err("aod and aod_sigma_rad: expected both or neither".into()),
        };
        Ok(EstimatedPath {
            path: path::Path {
                c_tau_m: self.c_tau_m,
                aoa: direction("aoa", self.aoa)?,
                aod,
                covariance: Matrix3::from_fn(|i, j| self.covariance[i][j]),
            },
            beam: self.beam,
            snr_db: self.snr_db,
            energy: self.energy,
            range_rate: self.range_rate.as_ref().map(RangeRateLine::rate).transpose()?,
        })
    }
}

impl RangeRateLine {
    fn of(rate: RangeRate) -> Self {
        let RangeRate {
            m_per_s,
            sigma_m_per_s,
            period_m_per_s,
        } = rate;
        Self {
            m_per_s,
            sigma_m_per_s,
            period_m_per_s,
        }
    }

    fn rate(&self) -> Result<RangeRate, String> {
        let Self {
            m_per_s,
            sigma_m_per_s,
            period_m_per_s,
        } = *self;
        // All are finite: a number beyond single precision has been refused when the line was read.
        for (key, value) in [
            ("sigma_m_per_s", sigma_m_per_s),
            ("period_m_per_s", period_m_per_s),
        ] {
            if value <= 0.0 {
                return Err(format!("range_rate: {key} is {value}, expected above 0"));
            }
        }
        Ok(RangeRate {
            m_per_s,
            sigma_m_per_s,
            period_m_per_s,
        })
    }
}

/// Whether a count is what one that is absent says.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands over a reference")]
fn is_zero(count: &u16) -> bool {
    *count == 0
}

fn direction<F: Frame>(key: &str, unit: [f32; 3]) -> Result<Direction<F>, String> {
    Direction::from_unit_vector(Vector3::from(unit)).map_err(|why| format!("{key}: {why}"))
}

impl SightedLine {
    fn of(path: usize, bearing: &Result<Bearing, Refusal>) -> Self {
        Self {
            path,
            bearing: bearing.as_ref().ok().map(BearingLine::of),
            refusal: bearing.as_ref().err().map(Refusal::to_string),
        }
    }

    fn sighted(&self) -> Result<(usize, Result<Bearing, Refusal>), String> {
        let bearing = match (&self.bearing, &self.refusal) {
            (Some(bearing), None) => Ok(bearing.bearing()?),
            (None, Some(told)) => {
                let refusal = Refusal::ALL
                    .into_iter()
                    .find(|refusal| refusal.to_string() == *told);
                Err(refusal
                    .ok_or_else(|| format!("refusal: found \"{told}\", expected why there is no bearing"))?)
            }
            _ => return Err("sighted: expected a bearing or a refusal".into()),
        };
        Ok((self.path, bearing))
    }
}

impl BearingLine {
    fn of(bearing: &Bearing) -> Self {
        Self {
            face: bearing.face,
            cosines: bearing.cosines,
            covariance: std::array::from_fn(|i| std::array::from_fn(|j| bearing.covariance[(i, j)])),
            c_tau_m: bearing.delay.map(|delay| delay.c_tau_m),
            c_tau_variance_m2: bearing.delay.map(|delay| delay.variance_m2),
        }
    }

    fn bearing(&self) -> Result<Bearing, String> {
        let delay = match (self.c_tau_m, self.c_tau_variance_m2) {
            (Some(c_tau_m), Some(variance_m2)) => Some(Delay { c_tau_m, variance_m2 }),
            (None, None) => None,
            _ => return Err("c_tau_m and c_tau_variance_m2: expected both or neither".into()),
        };
        Ok(Bearing {
            face: self.face,
            cosines: self.cosines,
            covariance: Matrix2::from_fn(|i, j| self.covariance[i][j]),
            delay,
        })
    }
}

#[cfg(test)]
mod tests;

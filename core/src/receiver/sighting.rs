//! What beam squint must know of the line of sight.

use super::PATHS;
use super::config::Localization;
use super::paths::MeasuredPath;
use super::receive::length_m;
use super::sight::{PLACED_M, sigma};
use crate::array::{GmtArrays, GmtFace};
use crate::beam_squint::{Expected, Sighting};
use crate::geometry::{Direction, Gmt, Vector3, World};
use crate::numeric::gather;
use crate::receiver::{Radio, Receiver};

/// How far from where the pose puts the line of sight beam squint looks for it, halves of a beam.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const POSE_RADIUS: f32 = 0.8;

impl<R: Radio, const VOXELS: usize, const STATES: usize> Receiver<'_, R, VOXELS, STATES> {
    /// What beam squint needs to know of the line of sight, path number `index`.
    pub(super) fn sighting(&self, measured: &[MeasuredPath], index: usize, time_ns: u64) -> Option<Sighting> {
        let paths: heapless::Vec<_, PATHS> = gather(measured.iter().map(|path| path.estimated));
        let period = self.delay_period();
        let face = self.radio.face(measured.get(index)?.estimated.beam)?;
        let mut sighting = Sighting::new(true, &paths, index, face, &period)?;
        // Without a pose it may be anywhere: of a GMT that stands low or high the sweep's beams know only the sidelobes.
        let Some((pose, (gmt, _))) = self.localizer.expected().zip(self.transmitter(time_ns)) else {
            return Some(sighting);
        };
        let from_gmt = pose.position.vector() - gmt.position_m;
        let filtered = matches!(self.config.localization, Localization::Filter(_));
        let range_m = if filtered {
            from_gmt.norm() as f32
        } else {
            // The paper's calibration does not know how far it has drifted; the path does not drift.
            let c_tau_m = measured.get(index)?.estimated.path.c_tau_m;
            length_m(c_tau_m, self.offset_m(time_ns)?, &period) as f32
        };
        // Through a sidelobe any face is heard: the pose knows better which one looks here.
        if filtered
            && sigma(&pose.position_covariance_m2) < PLACED_M
            && let Ok(left) = Direction::<World, f64>::from_vector(from_gmt)
        {
            let radio = self.radio.model();
            let left = gmt.attitude.inverse().apply(left);
            sighting.face = face_towards(&radio.faces, &left);
            let across = 4.0 * sigma(&pose.position_covariance_m2) / range_m;
            let [row, column] = radio.half_beam;
            let radius = POSE_RADIUS * row.max(column) as f32;
            let face = radio.faces.get(sighting.face);
            sighting.expected = face.map(|face| expected(face, &left, radius + across));
        }
        if let Some(ground_z_m) = self.config.accept.point.ground_z_m
            && let Ok(down) = Direction::<World>::from_vector(-Vector3::z())
            && let up = gmt.attitude.inverse().apply_vector(&Vector3::new(0.0, 0.0, 1.0))
            && let Ok(up) = Direction::<Gmt>::from_vector(up.map(|c| c as f32))
        {
            let height_m = gmt.position_m.z as f32 - ground_z_m;
            sighting = sighting.with_ground(range_m, height_m, &pose.attitude.inverse().apply(down), &up);
        }
        Some(sighting)
    }
}

/// Where a direction is, as a face has it.
fn expected(face: &GmtFace<f64>, u: &Direction<Gmt, f64>, radius: f32) -> Expected {
    Expected {
        cosines: GmtArrays::<f64>::cosines(face, u).map(|c| c as f32),
        radius,
    }
}

/// The face whose normal is nearest to a direction.
fn face_towards(faces: &[GmtFace<f64>], u: &Direction<Gmt, f64>) -> usize {
    let ahead = |face: usize| faces.get(face).map_or(-1.0, |face| face.normal.dot(u.vector()));
    (0..faces.len())
        .max_by(|a, b| ahead(*a).total_cmp(&ahead(*b)))
        .unwrap_or(0)
}

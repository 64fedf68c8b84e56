//! The true antennas of a radio: tilted linear arrays on the UAV, planar faces on the GMT, the beams and the beam squint
//! symbols that these send.
//!
//! Written from docs/signal-model.md ("Arrays", "Beam squint") for this simulation alone. The receiver has a model of its
//! own. Both are made from one description ([`cslam_core::radio`]) and share no code beyond it: what is wrong in either of the
//! two is seen, and what the true antennas have beyond the receiver's model has its place here.

pub(super) mod element;
pub(super) mod gmt;
pub(super) mod squint;
pub(super) mod uav;

#[cfg(test)]
mod tests;

use nalgebra::Vector3;

use super::C64;

/// `exp(j angle)`.
pub(super) fn phasor(angle_rad: f64) -> C64 {
    C64::new(libm::cos(angle_rad), libm::sin(angle_rad))
}

/// `exp(j 2 pi turns)`; whole turns are taken off first.
pub(super) fn phasor_of_turns(turns: f64) -> C64 {
    phasor(std::f64::consts::TAU * (turns - turns.floor()))
}

/// Place of element `index` of a row of `count`, in spacings from the row's centre: -3.5 to 3.5 for eight.
pub(super) fn place(index: usize, count: usize) -> f64 {
    index as f64 - 0.5 * (count as f64 - 1.0)
}

/// Outward normal of a vertical face that looks at `azimuth_rad`, and its horizontal tangent: the normal turned by +90
/// degrees about z.
fn face_axes(azimuth_rad: f64) -> (Vector3<f64>, Vector3<f64>) {
    let (sine, cosine) = (libm::sin(azimuth_rad), libm::cos(azimuth_rad));
    (Vector3::new(cosine, sine, 0.0), Vector3::new(-sine, cosine, 0.0))
}

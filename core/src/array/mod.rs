//! Antenna geometry: the four tilted linear arrays of the UAV and the planar arrays and transmit beams of the GMT.
//!
//! One description each ([`UavArrayConfig`], [`GmtArrayConfig`], [`CodebookConfig`]); everything else (axes, steering,
//! codewords) is made from it by code. All arithmetic is generic over [`Real`]: `f32` in flight,
//! `f64` in a simulation.
//!
//! Source: docs/signal-model.md, "Arrays".
//!
//! Not modelled: mutual coupling, polarisation other than vertical, squint inside one array (docs/signal-model.md, "Arrays": 0.04
//! rad at the band edge).
//!
//! ```text
//! element i of array j, half a wavelength apart:  exp(+j pi n_i (axis_j . u)),  n_i = i - 3.5
//! array j at p_j:                                c tau_j = c tau - p_j . u
//! ```
//!
//! # Example
//! A wave from the left, level: no phase from element to element of the array that looks there, which it reaches first, and nearly half a
//! turn at the one that looks ahead.
//! ```
//! use cslam_core::array::UavArrays;
//! use cslam_core::geometry::{Body, Direction};
//! use core::f64::consts::{FRAC_PI_2, PI};
//!
//! let arrays: UavArrays<f64> = UavArrays::default();
//! let left: Direction<Body, f64> = Direction::from_zenith_azimuth(FRAC_PI_2, FRAC_PI_2)?;
//! let step_rad = arrays.phase_step_rad(&left); // arrays ahead, left, behind, right
//! assert!(step_rad[1].abs() < 1e-9);
//! assert!((step_rad[0] - PI * 0.8165).abs() < 1e-3); // pi cos 35.264 deg
//! assert!((arrays.lead_m(&left)[1] - 0.2).abs() < 1e-9);
//! # Ok::<(), cslam_core::geometry::GeometryError>(())
//! ```

mod codebook;
mod element;
mod gmt;
mod reach;
mod receive_beam;
mod squint;
mod uav;

pub use codebook::{Beam, Codebook, CodebookConfig};
pub use element::{GmtElement, UavElement, half_wave_dipole};
pub use gmt::{GmtArrayConfig, GmtArrays, GmtFace, planar_factor};
pub use reach::BeamReach;
pub(crate) use receive_beam::{Null, ReceiveBeam};
pub use squint::{SquintConfig, SquintScheme, SquintSymbol};
pub use uav::{MOST_ARRAYS, UavArrayConfig, UavArrays, UavLayout, Ula};

use crate::geometry::{Complex, Real, Vector3};

/// `exp(j angle)`.
pub fn phasor<T: Real>(angle_rad: T) -> Complex<T> {
    let (sine, cosine) = angle_rad.sin_cos_libm();
    Complex::new(cosine, sine)
}

/// Place of element `index` of a row of `count`, in spacings from the row's centre: index - (count - 1)/2.
pub fn centred<T: Real>(index: usize, count: usize) -> T {
    T::of(index as f64 - (count as f64 - 1.0) / 2.0)
}

/// Outward normal and horizontal tangent of a vertical face that looks at `azimuth_rad`: the tangent is the normal
/// turned by +90 degrees about z.
fn face_axes<T: Real>(azimuth_rad: T) -> (Vector3<T>, Vector3<T>) {
    let (sine, cosine) = azimuth_rad.sin_cos_libm();
    (
        Vector3::new(cosine, sine, T::zero()),
        Vector3::new(-sine, cosine, T::zero()),
    )
}

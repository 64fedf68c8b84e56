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

mod codebook;
mod element;
mod gmt;
mod reach;
mod squint;
mod uav;

pub use codebook::{Beam, Codebook, CodebookConfig};
pub use element::{GmtElement, UavElement, half_wave_dipole};
pub use gmt::{GmtArrayConfig, GmtArrays, GmtFace, planar_factor};
pub use reach::BeamReach;
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

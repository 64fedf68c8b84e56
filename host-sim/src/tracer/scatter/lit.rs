//! Power that a piece of a face takes of the transmitter's wave and scatters to a receiver, were nothing in the way.

use core::f64::consts::{PI, TAU};

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;

use crate::scene::{Scene, Vec3};
use crate::tracer::LEAST_DISTANCE_M;
use crate::tracer::angles::theta_hat;
use crate::tracer::beam::SLACK_M;
use crate::tracer::field::dipole;
use crate::tracer::surface::{Surface, Surfaces};
use crate::tracer::tiles::Piece;

/// A piece of a face as the transmitter lights it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lit {
    pub(super) face: u32,
    pub(super) piece: Piece,
    /// Direction of the mirrored wave.
    pub(super) mirrored: Vec3,
    /// Power that the lobe scatters straight along it, times the square of the distance to the receiver, isotropic there.
    pub(super) lobe: f64,
    pub(super) exponent: u32,
    /// The same of what the grain scatters, straight off the face.
    pub(super) grain: f64,
    /// Place of its tile among all, if it is one that has quarters.
    pub(super) tile: Option<u32>,
    /// Share of it that the transmitter sees.
    pub(super) seen: f64,
}

/// What a piece takes of the transmitter's wave, were nothing in the way; `None` when it looks elsewhere.
pub(super) fn light(
    scene: &Scene,
    tx: &Vec3,
    face: u32,
    piece: &Piece,
    surfaces: &Surfaces<'_>,
) -> Option<Lit> {
    let polygon = &scene.faces()[face as usize];
    let (way, normal) = (piece.centre - tx, polygon.normal());
    let distance_m = way.norm();
    let direction = way / distance_m;
    let cos = -direction.dot(normal);
    if distance_m < LEAST_DISTANCE_M || polygon.height_m(tx) <= SLACK_M || cos <= 0.0 {
        return None;
    }
    let surface = surfaces.of(face);
    let lobe = surface.lobe()?;
    let wavelength = SPEED_OF_LIGHT_M_PER_S / scene.frequency_hz() / (4.0 * PI);
    let taken = reflectance(surface, &direction, normal, cos)
        * (wavelength * dipole(&direction)).powi(2)
        * (cos * piece.area_m2 / (distance_m * distance_m));
    let scattered = lobe.coefficient * lobe.coefficient;
    let left = 1.0 - surface.coherent(cos).powi(2);
    Some(Lit {
        face,
        piece: *piece,
        mirrored: direction + normal * (2.0 * cos),
        lobe: taken * scattered / half_space(lobe.exponent, cos),
        exponent: lobe.exponent,
        grain: taken * (1.0 - scattered) * left / PI,
        tile: None,
        seen: 1.0,
    })
}

/// Share of the power of a vertically polarised wave that a smooth surface reflects.
fn reflectance(surface: &Surface, direction: &Vec3, normal: &Vec3, cos: f64) -> f64 {
    let [r_s, r_p] = surface.smooth(cos).map(|r| r.norm_sqr());
    let across = direction.cross(normal);
    let sin2 = across.norm_squared();
    // At normal incidence both are the same.
    let share = if sin2 > 1e-24 {
        theta_hat(direction).dot(&across).powi(2) / sin2
    } else {
        0.5
    };
    share * r_s + (1.0 - share) * r_p
}

/// Power that a receiver hears of all of a piece, were nothing in the way; `None` when it looks elsewhere.
pub(super) fn hear(scene: &Scene, lit: &Lit, rx: &Vec3) -> Option<f64> {
    let way = rx - lit.piece.centre;
    let squared_m2 = way.norm_squared();
    let direction = way / squared_m2.sqrt();
    let cos = direction.dot(scene.faces()[lit.face as usize].normal());
    if cos <= 0.0 || squared_m2 < LEAST_DISTANCE_M * LEAST_DISTANCE_M {
        return None;
    }
    let lobe = power(0.5 * (1.0 + lit.mirrored.dot(&direction)).max(0.0), lit.exponent);
    let received = dipole(&direction).powi(2) / squared_m2;
    Some((lit.lobe * lobe + lit.grain * cos) * received)
}

/// Integral over the half-space of the lobe `((1 + cos psi)/2)^alpha` about the mirrored direction, sr.
///
/// `F = 2^-alpha sum over j of C(alpha, j) I_j`, `I_j = 2 pi/(j + 1)`, for odd j times
/// `cos sum over w to (j - 1)/2 of C(2w, w) (sin/2)^{2w}`.
pub(super) fn half_space(exponent: u32, cos: f64) -> f64 {
    let quarter_sin2 = 0.25 * (1.0 - cos * cos);
    let (mut sum, mut choose) = (0.0, 1.0);
    let (mut series, mut central, mut w) = (1.0, 1.0, 0.0);
    for j in 0..=exponent {
        let order = f64::from(j);
        let part = TAU / (order + 1.0);
        if j % 2 == 1 {
            sum += choose * part * cos * series;
            // C(2w + 2, w + 1) / C(2w, w) = (2w + 2)(2w + 1)/(w + 1)^2
            central *= (2.0 * w + 2.0) * (2.0 * w + 1.0) / ((w + 1.0) * (w + 1.0)) * quarter_sin2;
            series += central;
            w += 1.0;
        } else {
            sum += choose * part;
        }
        choose *= (f64::from(exponent) - order) / (order + 1.0);
    }
    sum * power(0.5, exponent)
}

/// A whole power by products alone, the same on every machine.
pub(super) fn power(base: f64, exponent: u32) -> f64 {
    (0..exponent).fold(1.0, |product, _| product * base)
}

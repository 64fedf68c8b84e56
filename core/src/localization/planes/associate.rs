//! Which plane did a reflection come from?
//!
//! Each plane predicts the path that it would have made: from the GMT's image, over its delay, its arrival, and the
//! departure that the mirror turns. The plane whose prediction the measurement meets within their joint uncertainty is
//! the one, if it is the only one; two that explain it about equally well are a reason to use neither.

use heapless::Vec;
use nalgebra::{SMatrix, Vector3};

use super::extract::{PlaneMap, Surface};
use super::plane::Plane;
use crate::geometry::{Position, World};
use crate::path::Path;
use crate::reflection::Ends;

/// Chi-square at 0.1 % of three degrees of freedom (delay and two angles), and of five (departure as well).
const GATES: [f32; 2] = [16.27, 20.52];
/// A second plane must explain the measurement worse by this, in chi-square.
const LEAD: f32 = 9.0;
/// Reflections happen within the extent that points have shown, and this much beyond, m.
const MARGIN_M: f32 = 2.0;
/// Both ends stand at least this far before the plane, m.
const LEAST_HEIGHT_M: f32 = 0.3;
/// Steps of the difference quotients: m and rad.
const STEP_M: f32 = 0.1;
const STEP_RAD: f32 = 0.01;

/// What a reflection measurement is to the planes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Association {
    /// It came from this plane; chi-square of the match, and its degrees of freedom (3, or 5 with departure).
    Surface {
        /// [`Surface::id`].
        id: u32,
        /// Squared normalised distance.
        chi_square: f32,
        /// Degrees of freedom.
        freedom: u8,
    },
    /// From none of them.
    None,
    /// From one of several.
    Ambiguous,
}

/// A path over a plane: delay in m, arrival at the UAV, departure from the GMT.
#[derive(Clone, Copy, Debug)]
struct Predicted {
    c_tau_m: f32,
    arrival: Vector3<f32>,
    departure: Vector3<f32>,
}

fn predict(plane: &Plane, gmt: &Vector3<f32>, uav: &Vector3<f32>) -> Predicted {
    let way = plane.image(gmt) - uav;
    let c_tau_m = way.norm();
    let arrival = way / c_tau_m;
    Predicted {
        c_tau_m,
        arrival,
        departure: plane.reflect(&-arrival),
    }
}

impl<const P: usize> PlaneMap<P> {
    /// Finds the plane that a path of one reflection came from. Its `c_tau_m` is free of the clock offset, its
    /// covariance holds attitude and clock ([`Path::to_world`]).
    #[must_use]
    pub fn associate(&self, ends: &Ends, path: &Path<World>) -> Association {
        let gate = GATES[usize::from(path.aod.is_some())];
        let (mut best, mut second) = (None, f32::INFINITY);
        let mut least = f32::INFINITY;
        for surface in self.surfaces() {
            let Some(chi_square) = match_one(surface, ends, path).filter(|chi| *chi <= gate) else {
                continue;
            };
            if chi_square < least {
                second = least;
                (least, best) = (chi_square, Some(surface.id));
            } else {
                second = second.min(chi_square);
            }
        }
        match best {
            None => Association::None,
            Some(_) if second < least + LEAD => Association::Ambiguous,
            Some(id) => Association::Surface {
                id,
                chi_square: least,
                freedom: if path.aod.is_some() { 5 } else { 3 },
            },
        }
    }
}

/// Squared normalised distance of a path from what a surface predicts; none when the surface cannot have made it.
fn match_one(surface: &Surface, ends: &Ends, path: &Path<World>) -> Option<f32> {
    let plane = &surface.plane;
    let (gmt, uav) = (ends.gmt.vector(), ends.uav.vector());
    let heights = [plane.height_m(gmt), plane.height_m(uav)];
    if heights[0] * heights[1] <= 0.0 || heights.iter().any(|h| h.abs() < LEAST_HEIGHT_M) {
        return None;
    }
    let expected = predict(plane, gmt, uav);
    // Where the line from the image meets the plane.
    let share = heights[1] / (heights[0] + heights[1]);
    let incidence = Position::from_vector(uav + expected.arrival * (expected.c_tau_m * share)).ok()?;
    if !surface.covers(&incidence, MARGIN_M) {
        return None;
    }
    let (e1, e2) = path.aoa.tangents();
    let leave = path.aod.map(|aod| (aod, aod.direction.tangents()));
    // Along the measured tangents: what the prediction is off.
    let along = |p: &Predicted| {
        let mut rows: Vec<f32, 5> = Vec::new();
        let _ = rows.extend_from_slice(&[p.c_tau_m - path.c_tau_m, e1.dot(&p.arrival), e2.dot(&p.arrival)]);
        if let Some((_, (d1, d2))) = &leave {
            let _ = rows.extend_from_slice(&[d1.dot(&p.departure), d2.dot(&p.departure)]);
        }
        SMatrix::<f32, 5, 1>::from_fn(|i, _| rows.get(i).copied().unwrap_or(0.0))
    };
    let residual = along(&expected);
    // A direction behind one's back has small components along the tangents too.
    if expected.arrival.dot(path.aoa.vector()) <= 0.0
        || leave.is_some_and(|(aod, _)| expected.departure.dot(aod.direction.vector()) <= 0.0)
    {
        return None;
    }
    let mut covariance = SMatrix::<f32, 5, 5>::identity();
    covariance
        .fixed_view_mut::<3, 3>(0, 0)
        .copy_from(&path.covariance);
    if let Some((aod, _)) = &leave {
        let variance = aod.sigma_rad * aod.sigma_rad;
        covariance.m44 = variance;
        covariance.m55 = variance;
    }
    // Difference quotients over the plane's three numbers and over the UAV's position.
    let mut over_plane = SMatrix::<f32, 5, 3>::zeros();
    let mut over_uav = SMatrix::<f32, 5, 3>::zeros();
    for i in 0..3 {
        let size = if i == 0 { STEP_M } else { STEP_RAD };
        let moved = |by: f32| {
            let step = core::array::from_fn(|k| if k == i { by } else { 0.0 });
            let plane = plane.corrected(step, plane.covariance)?;
            Some(along(&predict(&plane, gmt, uav)))
        };
        over_plane.set_column(i, &((moved(size)? - moved(-size)?) / (2.0 * size)));
        let step = Vector3::from_fn(|k, _| if k == i { STEP_M } else { 0.0 });
        let ahead = along(&predict(plane, gmt, &(uav + step)));
        let behind = along(&predict(plane, gmt, &(uav - step)));
        over_uav.set_column(i, &((ahead - behind) / (2.0 * STEP_M)));
    }
    covariance += over_plane * plane.covariance * over_plane.transpose();
    covariance += over_uav * ends.uav_covariance * over_uav.transpose();
    let chi_square = residual.dot(&(covariance.try_inverse()? * residual));
    // Without departure the last two rows are zeros of variance one: nothing.
    chi_square.is_finite().then_some(chi_square)
}

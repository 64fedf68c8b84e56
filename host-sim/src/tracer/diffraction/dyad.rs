//! The dyadic coefficient of an edge: the field behind it over that before it (uniform theory of diffraction with the Fresnel dyads of
//! both faces).

use nalgebra::Complex;

use crate::scene::Vec3;
use crate::tracer::edges::{Flank, Wedge};
use crate::tracer::field::{Bounce, Field, along, reflect};
use crate::tracer::surface::{Surface, Surfaces};
use crate::tracer::utd::Incidence;

/// The field behind an edge over that before it, spreading apart (sqrt(m)): the four scalars with the Fresnel dyads of the
/// faces, `-D2 I - D1 Mn M0 + D4 M0 + D3 Mn`, where face 0 is the one nearer to the incoming ray.
pub(super) fn diffract(
    field: &Field,
    wedge: &Wedge,
    incidence: &Incidence,
    incoming: &Vec3,
    outgoing: &Vec3,
    surfaces: &Surfaces<'_>,
) -> Field {
    let [first, second] = &wedge.flanks;
    let exterior_rad = wedge.exterior_rad;
    let turned = incidence.phi_in_rad > 0.5 * exterior_rad;
    let (near, far, z, incidence) = if turned {
        let other = |angle_rad: f64| exterior_rad - angle_rad;
        let incidence = Incidence {
            phi_in_rad: other(incidence.phi_in_rad),
            phi_out_rad: other(incidence.phi_out_rad),
            ..*incidence
        };
        (second, first, -wedge.along, incidence)
    } else {
        (first, second, wedge.along, *incidence)
    };
    let [d1, d2, d3, d4] = incidence.scalars();
    let before = frame_before(&z, incoming);
    let e = before.map(|unit| along(field, &unit));
    // Off face 0 the incoming ray is mirrored; into the outgoing ray one that comes in mirrored at face n.
    let mirrored = |ray: &Vec3, flank: &Flank| ray - flank.normal * (2.0 * ray.dot(&flank.normal));
    let m_near = dyad(
        near,
        &z,
        incoming,
        &mirrored(incoming, near),
        surfaces.of(near.face),
    );
    let m_far = dyad(far, &z, &mirrored(outgoing, far), outgoing, surfaces.of(far.face));
    let once = times(&m_near, &e);
    let (twice, last) = (times(&m_far, &once), times(&m_far, &e));
    let [b, phi] = frame_behind(&z, outgoing);
    let [e_b, e_phi] = [0, 1].map(|i| d4 * once[i] + d3 * last[i] - d2 * e[i] - d1 * twice[i]);
    b.map(|c| e_b * c) + phi.map(|c| e_phi * c)
}

/// Unit vectors `[b', phi']` of a ray that comes to an edge along z.
pub(super) fn frame_before(z: &Vec3, ray: &Vec3) -> [Vec3; 2] {
    let phi = -z.cross(ray).normalize();
    [phi.cross(ray), phi]
}

/// Unit vectors `[b, phi]` of a ray that leaves an edge along z.
pub(super) fn frame_behind(z: &Vec3, ray: &Vec3) -> [Vec3; 2] {
    let phi = z.cross(ray).normalize();
    [phi.cross(ray), phi]
}

/// Fresnel dyad of a face of the wedge, rows `[b, phi]` of the reflected ray, columns `[b', phi']` of the incoming one.
fn dyad(
    flank: &Flank,
    z: &Vec3,
    incoming: &Vec3,
    reflected: &Vec3,
    surface: &Surface,
) -> [[Complex<f64>; 2]; 2] {
    if flank.black {
        return [[Complex::new(0.0, 0.0); 2]; 2];
    }
    // Far from its boundaries a term may have a ray from behind; the coefficient of its angle serves.
    let normal = if incoming.dot(&flank.normal) > 0.0 {
        -flank.normal
    } else {
        flank.normal
    };
    let bounce = Bounce {
        normal: &normal,
        surface,
    };
    let columns = frame_before(z, incoming).map(|unit| {
        let field = reflect(&unit.map(|c| Complex::new(c, 0.0)), incoming, &bounce, reflected);
        frame_behind(z, reflected).map(|row| along(&field, &row))
    });
    [0, 1].map(|row| [columns[0][row], columns[1][row]])
}

fn times(m: &[[Complex<f64>; 2]; 2], e: &[Complex<f64>; 2]) -> [Complex<f64>; 2] {
    [0, 1].map(|row| m[row][0] * e[0] + m[row][1] * e[1])
}

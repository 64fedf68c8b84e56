//! What stands still: the true surfaces of the scene in both views.

use std::fmt::Write as _;

use super::panel::Panel;
use crate::flight_files::page::plan;
use crate::scene::{Face, Scene};

/// Shades of surfaces in the slanted view: darkest, and how much lighter one is that faces the light.
const DARKEST: f64 = 196.0;
const LIGHTER: f64 = 46.0;
/// Where the light comes from.
const LIGHT: [f64; 3] = [-0.25, -0.55, 0.8];

/// Roofs and walls from above.
pub(super) fn from_above(scene: &Scene, panel: &Panel) -> String {
    plan::walls(scene, |x, y| panel.at([x, y, 0.0]).into())
}

/// The fronts of all surfaces, the far ones first.
pub(super) fn slanted(scene: &Scene, panel: &Panel) -> String {
    let mut fronts: Vec<(f64, &Face)> = scene
        .faces()
        .iter()
        .filter(|face| panel.nearness((*face.normal()).into()) > 1e-6)
        .map(|face| (nearest(face, panel), face))
        .collect();
    fronts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut body = String::new();
    for (_, face) in fronts {
        let normal = face.normal();
        let lit = (0..3).map(|k| normal[k] * LIGHT[k]).sum::<f64>().max(0.0);
        let shade = (DARKEST + LIGHTER * lit).clamp(0.0, 255.0);
        let mut outline = String::new();
        for (k, vertex) in face.vertices().iter().enumerate() {
            let [x, y] = panel.at((*vertex).into());
            let _ = write!(outline, "{}{x:.1} {y:.1}", if k == 0 { 'M' } else { 'L' });
        }
        let _ = write!(
            body,
            r#"<path class="front" fill="rgb({shade:.0},{shade:.0},{:.0})" d="{outline}Z"/>"#,
            (shade + 3.0).min(255.0)
        );
    }
    body
}

/// How near the middle of a surface is; the ground is behind everything.
fn nearest(face: &Face, panel: &Panel) -> f64 {
    let vertices = face.vertices();
    let sum: f64 = vertices.iter().map(|v| panel.nearness((*v).into())).sum();
    let is_ground = face.normal().z > 0.5 && vertices.iter().all(|v| v.z < plan::ROOF_M);
    if is_ground {
        f64::NEG_INFINITY
    } else {
        sum / vertices.len() as f64
    }
}

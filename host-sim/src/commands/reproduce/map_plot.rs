//! A point cloud between the outlines of its scene: from above, and at a slant.

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::flight_files::views::{View, above, slanted};
use crate::scene::Scene;

const SIZE: (u32, u32) = (1400, 720);
const OUTLINE: RGBColor = RGBColor(190, 190, 190);
/// Colours of low and high points, and between.
const LOW_TO_HIGH: [[f64; 3]; 4] = [
    [49.0, 54.0, 149.0],
    [33.0, 145.0, 140.0],
    [120.0, 180.0, 60.0],
    [215.0, 48.0, 39.0],
];

/// The plot as an SVG drawing.
///
/// # Errors
/// What the drawing library says.
pub(super) fn svg(title: &str, scene: &Scene, points_m: &[[f64; 3]]) -> anyhow::Result<String> {
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let heights = [scene.bounds().min_m[2], scene.bounds().max_m[2]];
        let title = format!(
            "{title}: {} points, colour by height, {:.0} to {:.0} m",
            points_m.len(),
            heights[0],
            heights[1]
        );
        let root = root.titled(&title, ("sans-serif", 24))?;
        let (left, right) = root.split_horizontally(SIZE.0 / 2);
        panel(&left, scene, points_m, above, Some(["x m", "y m"]))?;
        panel(&right, scene, points_m, slanted, None)?;
        root.present()?;
    }
    Ok(text)
}

fn panel(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    scene: &Scene,
    points_m: &[[f64; 3]],
    view: View,
    axes: Option<[&str; 2]>,
) -> anyhow::Result<()> {
    let outlines: Vec<Vec<(f64, f64)>> = scene
        .faces()
        .iter()
        .map(|face| {
            let corners = face.vertices().iter().chain(face.vertices().first());
            corners
                .map(|v| view((*v).into()))
                .map(|[x, y, _]| (x, y))
                .collect()
        })
        .collect();
    let (x, y) = frame(area.dim_in_pixel(), outlines.iter().flatten());
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(if axes.is_some() { 36 } else { 0 })
        .y_label_area_size(if axes.is_some() { 48 } else { 0 })
        .build_cartesian_2d(x, y)?;
    if let Some([across, up]) = axes {
        chart
            .configure_mesh()
            .x_desc(across)
            .y_desc(up)
            .label_style(("sans-serif", 15))
            .max_light_lines(0)
            .bold_line_style(RGBColor(240, 240, 240))
            .draw()?;
    }
    chart.draw_series(
        outlines
            .into_iter()
            .map(|outline| PathElement::new(outline, OUTLINE)),
    )?;
    let bounds = scene.bounds();
    let span = (bounds.max_m[2] - bounds.min_m[2]).max(1e-6);
    let mut drawn: Vec<([f64; 3], RGBColor)> = points_m
        .iter()
        .map(|point| (view(*point), colour((point[2] - bounds.min_m[2]) / span)))
        .collect();
    // The nearest ones last: over the others.
    drawn.sort_by(|a, b| a.0[2].total_cmp(&b.0[2]));
    chart.draw_series(
        drawn
            .into_iter()
            .map(|([x, y, _], colour)| Circle::new((x, y), 2, colour.filled())),
    )?;
    Ok(())
}

type Range = std::ops::Range<f64>;

/// Ranges that hold all of it and show both axes at one scale.
fn frame<'p>((width, height): (u32, u32), points: impl Iterator<Item = &'p (f64, f64)>) -> (Range, Range) {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for (x, y) in points {
        low = [low[0].min(*x), low[1].min(*y)];
        high = [high[0].max(*x), high[1].max(*y)];
    }
    if low[0] > high[0] {
        return (0.0..1.0, 0.0..1.0);
    }
    let pixels = [f64::from(width.max(1)), f64::from(height.max(1))];
    let scale = [0, 1]
        .map(|k| (high[k] - low[k]) / pixels[k])
        .into_iter()
        .fold(1e-6, f64::max);
    let range = |k: usize| {
        let (middle, half) = (0.5 * (low[k] + high[k]), 0.52 * scale * pixels[k]);
        middle - half..middle + half
    };
    (range(0), range(1))
}

/// A colour between low (0) and high (1).
fn colour(share: f64) -> RGBColor {
    let at = share.clamp(0.0, 1.0) * (LOW_TO_HIGH.len() - 1) as f64;
    let below = (at.floor() as usize).min(LOW_TO_HIGH.len() - 2);
    let part = at - below as f64;
    let mix = |k: usize| {
        let [from, to] = [LOW_TO_HIGH[below][k], LOW_TO_HIGH[below + 1][k]];
        (from + (to - from) * part).round() as u8
    };
    RGBColor(mix(0), mix(1), mix(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_and_every_outline_is_drawn_twice() {
        let scene = Scene::load("indoor").expect("built in");
        let points = [[3.0, 4.0, 1.0], [20.0, 12.0, 2.5], [10.0, 8.0, 0.0]];
        let text = svg("indoor", &scene, &points).expect("drawn");
        assert_eq!(text.matches("<circle").count(), 2 * points.len());
        let lines = text.matches("<polyline").count();
        assert!(lines >= 2 * scene.faces().len(), "{lines}");
        assert!(text.contains("3 points"));
    }

    #[test]
    fn both_axes_have_one_scale() {
        let (x, y) = frame((700, 350), [(0.0, 0.0), (10.0, 40.0)].iter());
        let per_pixel = |range: &Range, pixels: f64| (range.end - range.start) / pixels;
        assert!((per_pixel(&x, 700.0) - per_pixel(&y, 350.0)).abs() < 1e-12);
        assert!(y.start <= 0.0 && y.end >= 40.0 && x.start <= 0.0 && x.end >= 10.0);
    }

    #[test]
    fn higher_points_are_redder() {
        assert_eq!(colour(-1.0), RGBColor(49, 54, 149));
        assert_eq!(colour(2.0), RGBColor(215, 48, 39));
    }
}

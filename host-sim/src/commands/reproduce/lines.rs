//! Panels of curves as an SVG drawing.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::input::InputError;

/// Size of a panel, pixels.
const PANEL: (u32, u32) = (700, 430);
const TITLE: u32 = 40;

/// A curve and its name; one without a name is not in the legend.
pub(super) struct Curve {
    pub(super) name: String,
    pub(super) points: Vec<(f64, f64)>,
}

/// Curves over one axis.
pub(super) struct Panel {
    /// What the axes show, x and y.
    pub(super) axes: [String; 2],
    /// Least and greatest y.
    pub(super) range: [f64; 2],
    pub(super) curves: Vec<Curve>,
}

/// Writes a drawing; its folder is made when missing.
///
/// # Errors
/// [`InputError`] naming what cannot be made or written.
pub(super) fn write(file: &Path, drawing: &str) -> Result<(), InputError> {
    if let Some(parent) = file.parent().filter(|p| !p.as_os_str().is_empty()) {
        std::fs::create_dir_all(parent)
            .map_err(|e| InputError::in_file(parent, format!("cannot be made: {e}")))?;
    }
    std::fs::write(file, drawing).map_err(|e| InputError::in_file(file, format!("cannot be written: {e}")))
}

/// Panels in two columns.
///
/// # Errors
/// What the drawing library says.
pub(super) fn svg(title: &str, panels: &[Panel]) -> anyhow::Result<String> {
    let columns = panels.len().clamp(1, 2);
    let rows = panels.len().div_ceil(2).max(1);
    let size = (PANEL.0 * columns as u32, PANEL.1 * rows as u32 + TITLE);
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        root.fill(&WHITE)?;
        let root = root.titled(title, ("sans-serif", 24))?;
        for (area, panel) in root.split_evenly((rows, columns)).iter().zip(panels) {
            draw(area, panel)?;
        }
        root.present()?;
    }
    Ok(text)
}

fn draw(area: &DrawingArea<SVGBackend<'_>, Shift>, panel: &Panel) -> anyhow::Result<()> {
    let xs = || {
        panel
            .curves
            .iter()
            .flat_map(|curve| curve.points.iter().map(|p| p.0))
    };
    let (low, high) = (
        xs().fold(f64::INFINITY, f64::min),
        xs().fold(f64::NEG_INFINITY, f64::max),
    );
    let (low, high) = if low < high { (low, high) } else { (0.0, 1.0) };
    let [bottom, top] = panel.range;
    let mut chart = ChartBuilder::on(area)
        .margin(14)
        .x_label_area_size(44)
        .y_label_area_size(60)
        .build_cartesian_2d(low..high, bottom..top)?;
    chart
        .configure_mesh()
        .x_desc(panel.axes[0].as_str())
        .y_desc(panel.axes[1].as_str())
        .label_style(("sans-serif", 15))
        .max_light_lines(0)
        .bold_line_style(RGBColor(225, 225, 225))
        .draw()?;
    for (index, curve) in panel.curves.iter().enumerate() {
        let colour = Palette99::pick(index).to_rgba();
        // What lies under the panel is cut off, not drawn outside of it.
        let inside = curve.points.iter().map(|(x, y)| (*x, y.clamp(bottom, top)));
        let drawn = chart.draw_series(LineSeries::new(inside, colour.stroke_width(2)))?;
        if !curve.name.is_empty() {
            drawn
                .label(curve.name.as_str())
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
        }
    }
    chart
        .configure_series_labels()
        .border_style(RGBColor(200, 200, 200))
        .background_style(WHITE.mix(0.85))
        .label_font(("sans-serif", 14))
        .draw()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_curve_of_every_panel_is_drawn() {
        let panel = |axis: &str| Panel {
            axes: [axis.into(), "gain dBi".into()],
            range: [0.0, 10.0],
            curves: ["one", "two"]
                .map(|name| Curve {
                    name: format!("{axis} {name}"),
                    points: (0..20).map(|i| (f64::from(i), f64::from(i) - 5.0)).collect(),
                })
                .into(),
        };
        let text = svg("three panels", &["a", "b", "c"].map(panel)).expect("drawn");
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        for word in ["three panels", "a one", "a two", "c two", "gain dBi"] {
            assert!(text.contains(word), "{word}");
        }
        let long = text.split("<polyline").filter(|line| {
            let points = line.split("points=\"").nth(1).and_then(|p| p.split('"').next());
            points.is_some_and(|p| p.split_whitespace().count() >= 20)
        });
        assert_eq!(long.count(), 6);
        assert!(svg("none", &[]).is_ok());
    }
}

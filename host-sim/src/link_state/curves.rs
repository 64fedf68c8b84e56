//! Training curves as a plot.

use plotters::prelude::*;

use super::training::Epoch;

const SIZE: (u32, u32) = (1200, 520);
const TRAINING: RGBColor = RGBColor(31, 119, 180);
const VALIDATION: RGBColor = RGBColor(214, 39, 40);

/// Loss and accuracy over the epochs as an SVG drawing.
///
/// # Errors
/// What the drawing library says.
pub fn svg(title: &str, curve: &[Epoch]) -> anyhow::Result<String> {
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let root = root.titled(title, ("sans-serif", 24))?;
        let (left, right) = root.split_horizontally(SIZE.0 / 2);
        let losses = |e: &Epoch| [e.training_loss, e.validation_loss];
        let accuracies = |e: &Epoch| [e.training_accuracy, e.validation_accuracy];
        panel(&left, "cross entropy, nat", curve, losses)?;
        panel(&right, "accuracy", curve, accuracies)?;
        root.present()?;
    }
    Ok(text)
}

fn panel<'t>(
    area: &DrawingArea<SVGBackend<'t>, plotters::coord::Shift>,
    what: &str,
    curve: &[Epoch],
    values: impl Fn(&Epoch) -> [f64; 2],
) -> anyhow::Result<()> {
    let all = || curve.iter().flat_map(&values);
    let (low, high) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
        (l.min(v), h.max(v))
    });
    let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
    let margin = 0.08 * (high - low).max(1e-3);
    let last = curve.len().max(2) as f64;
    let mut chart = ChartBuilder::on(area)
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(1.0..last, low - margin..high + margin)?;
    chart
        .configure_mesh()
        .x_desc("epoch")
        .y_desc(what)
        .x_label_formatter(&|x| format!("{x:.0}"))
        .y_label_formatter(&|y| format!("{y:.3}"))
        .label_style(("sans-serif", 16))
        .max_light_lines(0)
        .bold_line_style(RGBColor(225, 225, 225))
        .draw()?;
    for (index, (name, colour)) in [("training", TRAINING), ("validation", VALIDATION)]
        .into_iter()
        .enumerate()
    {
        let points = curve.iter().map(|e| (e.epoch as f64, values(e)[index]));
        chart
            .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .border_style(RGBColor(200, 200, 200))
        .background_style(WHITE)
        .label_font(("sans-serif", 16))
        .draw()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_curves_are_drawn() {
        let epoch = |i: usize| Epoch {
            epoch: i,
            training_loss: 1.0 / i as f64,
            training_accuracy: 1.0 - 0.5 / i as f64,
            validation_loss: 1.1 / i as f64,
            validation_accuracy: 0.9 - 0.4 / i as f64,
        };
        let curve: Vec<Epoch> = (1..=12).map(epoch).collect();
        let text = svg("paper, K = 9", &curve).expect("drawn");
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        for word in [
            "paper, K = 9",
            "cross entropy, nat",
            "accuracy",
            "training",
            "validation",
            "epoch",
        ] {
            assert!(text.contains(word), "{word}");
        }
        // Two lines a panel, each through all twelve epochs.
        let long = text.split("<polyline").filter(|line| {
            line.split("points=\"")
                .nth(1)
                .is_some_and(|p| p.split('"').next().unwrap_or("").split_whitespace().count() >= 12)
        });
        assert_eq!(long.count(), 4);
        assert!(svg("none", &[]).is_ok());
    }
}

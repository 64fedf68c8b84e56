//! Charts as SVG: axes, lines, bands and dots. Colours come from the page's style sheet by class, so one drawing serves
//! light and dark.

use std::fmt::Write as _;

/// Size of a chart in its own units; the page scales it.
const WIDTH: f64 = 520.0;
const HEIGHT: f64 = 230.0;
/// Room around the plot: left, right, top, bottom.
const MARGIN: [f64; 4] = [52.0, 10.0, 8.0, 36.0];

/// Series longer than this are thinned: more points than pixels.
const MOST_POINTS: usize = 1200;

/// How values become places along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Scale {
    /// Evenly from the first to the second value.
    Linear(f64, f64),
    /// By decades from the first to the second value, both positive.
    Log(f64, f64),
}

impl Scale {
    /// From zero to the next round value above `most`.
    pub(super) fn from_zero(most: f64) -> Self {
        let most = if most.is_finite() && most > 0.0 { most } else { 1.0 };
        let step = round_step(most, 4.0);
        Self::Linear(0.0, libm::ceil(most / step) * step)
    }

    /// Place of a value in 0..=1, clamped.
    fn place(self, value: f64) -> f64 {
        let share = match self {
            Self::Linear(low, high) => (value - low) / (high - low),
            Self::Log(low, high) => libm::log(value.max(low) / low) / libm::log(high / low),
        };
        share.clamp(0.0, 1.0)
    }

    /// Values that get a tick and a label.
    fn ticks(self) -> Vec<f64> {
        match self {
            Self::Linear(low, high) => {
                let step = round_step(high - low, 5.0);
                let first = libm::ceil(low / step - 1e-9) as i64;
                let last = libm::floor(high / step + 1e-9) as i64;
                (first..=last).map(|k| k as f64 * step).collect()
            }
            Self::Log(low, high) => {
                let first = libm::ceil(libm::log10(low) - 1e-9) as i32;
                let last = libm::floor(libm::log10(high) + 1e-9) as i32;
                (first..=last).map(|k| libm::pow(10.0, f64::from(k))).collect()
            }
        }
    }
}

/// A round number (1, 2 or 5 times a power of ten) of which `span` holds about `parts`.
fn round_step(span: f64, parts: f64) -> f64 {
    let rough = (span / parts).max(1e-12);
    let decade = libm::pow(10.0, libm::floor(libm::log10(rough)));
    let step = [1.0, 2.0, 5.0].into_iter().find(|k| k * decade >= rough * 0.999);
    step.unwrap_or(10.0) * decade
}

/// A value with as many digits as its neighbours need.
fn label(value: f64) -> String {
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    match text {
        "-0" | "" => "0".to_owned(),
        text => text.to_owned(),
    }
}

/// A chart under construction.
pub(super) struct Chart {
    x: Scale,
    y: Scale,
    x_label: &'static str,
    y_label: &'static str,
    body: String,
}

impl Chart {
    pub(super) fn new(x: Scale, y: Scale, x_label: &'static str, y_label: &'static str) -> Self {
        Self {
            x,
            y,
            x_label,
            y_label,
            body: String::new(),
        }
    }

    fn px(&self, x: f64) -> f64 {
        MARGIN[0] + self.x.place(x) * (WIDTH - MARGIN[0] - MARGIN[1])
    }

    fn py(&self, y: f64) -> f64 {
        HEIGHT - MARGIN[3] - self.y.place(y) * (HEIGHT - MARGIN[2] - MARGIN[3])
    }

    /// Shades spans of x over the full height.
    pub(super) fn spans(&mut self, spans: &[(f64, f64)], class: &str) -> &mut Self {
        for &(from, to) in spans {
            let (left, right) = (self.px(from), self.px(to));
            let _ = write!(
                self.body,
                r#"<rect class="{class}" x="{left:.1}" y="{:.1}" width="{:.1}" height="{:.1}"/>"#,
                MARGIN[2],
                (right - left).max(0.0),
                HEIGHT - MARGIN[2] - MARGIN[3]
            );
        }
        self
    }

    /// A line through points in order of x. It breaks where a value is not finite.
    pub(super) fn line(&mut self, points: &[(f64, f64)], class: &str) -> &mut Self {
        let mut path = String::new();
        let mut pen_down = false;
        for (x, y) in thinned(points) {
            if !y.is_finite() {
                pen_down = false;
                continue;
            }
            let _ = write!(
                path,
                "{}{:.1} {:.1}",
                if pen_down { 'L' } else { 'M' },
                self.px(x),
                self.py(y)
            );
            pen_down = true;
        }
        let _ = write!(self.body, r#"<path class="{class}" d="{path}"/>"#);
        self
    }

    /// The area between zero and a line.
    pub(super) fn area(&mut self, points: &[(f64, f64)], class: &str) -> &mut Self {
        let points = thinned(points);
        if let (Some(first), Some(last)) = (points.first(), points.last()) {
            let mut path = format!("M{:.1} {:.1}", self.px(first.0), self.py(0.0));
            for (x, y) in &points {
                let _ = write!(path, "L{:.1} {:.1}", self.px(*x), self.py(*y));
            }
            let _ = write!(path, "L{:.1} {:.1}Z", self.px(last.0), self.py(0.0));
            let _ = write!(self.body, r#"<path class="{class}" d="{path}"/>"#);
        }
        self
    }

    /// Dots: strokes of no length with round ends.
    pub(super) fn dots(&mut self, points: &[(f64, f64)], class: &str) -> &mut Self {
        let mut path = String::new();
        for &(x, y) in points {
            let _ = write!(path, "M{:.1} {:.1}h0", self.px(x), self.py(y));
        }
        let _ = write!(self.body, r#"<path class="dot {class}" d="{path}"/>"#);
        self
    }

    /// A level line across the plot.
    pub(super) fn level(&mut self, y: f64, class: &str) -> &mut Self {
        let at = self.py(y);
        let _ = write!(
            self.body,
            r#"<path class="{class}" d="M{} {at:.1}H{}"/>"#,
            MARGIN[0],
            WIDTH - MARGIN[1]
        );
        self
    }

    /// The drawing; `title` is what a screen reader says.
    pub(super) fn svg(&self, title: &str) -> String {
        let mut axes = String::new();
        for tick in self.y.ticks() {
            let at = self.py(tick);
            let _ = write!(
                axes,
                r#"<path class="grid" d="M{} {at:.1}H{}"/><text class="tick" x="{}" y="{:.1}" text-anchor="end">{}</text>"#,
                MARGIN[0],
                WIDTH - MARGIN[1],
                MARGIN[0] - 6.0,
                at + 4.0,
                label(tick)
            );
        }
        for tick in self.x.ticks() {
            let at = self.px(tick);
            let _ = write!(
                axes,
                r#"<path class="grid" d="M{at:.1} {}v4"/><text class="tick" x="{at:.1}" y="{}" text-anchor="middle">{}</text>"#,
                HEIGHT - MARGIN[3],
                HEIGHT - MARGIN[3] + 17.0,
                label(tick)
            );
        }
        let middle = (MARGIN[2] + HEIGHT - MARGIN[3]) / 2.0;
        format!(
            r#"<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{}">{axes}{}<text class="axis" x="{}" y="{}" text-anchor="end">{}</text><text class="axis" transform="translate(12 {middle}) rotate(-90)" text-anchor="middle">{}</text></svg>"#,
            super::escape(title),
            self.body,
            WIDTH - MARGIN[1],
            HEIGHT - 4.0,
            super::escape(self.x_label),
            super::escape(self.y_label)
        )
    }
}

/// At most [`MOST_POINTS`] of a series, the highest of each bunch: a peak must not vanish.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let bunch = points.len().div_ceil(MOST_POINTS).max(1);
    let highest = |some: &[(f64, f64)]| some.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
    points.chunks(bunch).filter_map(highest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within() {
        assert_eq!(Scale::Linear(0.0, 1.0).ticks().len(), 6);
        assert_eq!(Scale::from_zero(0.37), Scale::Linear(0.0, 0.4));
        assert_eq!(Scale::from_zero(123.0), Scale::Linear(0.0, 150.0));
        assert_eq!(Scale::from_zero(f64::NAN), Scale::Linear(0.0, 1.0));
        assert_eq!(Scale::Log(0.01, 100.0).ticks().len(), 5);
        assert_eq!(
            ["0", "0.25", "-3", "120"],
            [0.0, 0.25, -3.0, 120.0].map(label)[..]
        );
    }

    #[test]
    fn a_line_breaks_where_nothing_is_known_and_stays_in_the_plot() {
        let mut chart = Chart::new(Scale::Linear(0.0, 4.0), Scale::Linear(0.0, 1.0), "s", "m");
        chart.line(
            &[(0.0, 0.0), (1.0, 9.0), (2.0, f64::NAN), (3.0, 0.5), (4.0, 0.5)],
            "est",
        );
        let top = MARGIN[2];
        assert!(
            chart
                .body
                .contains(&format!(r#"d="M52.0 194.0L166.5 {top:.1}M395.5 "#)),
            "{}",
            chart.body
        );
    }

    #[test]
    fn thinning_keeps_the_peak() {
        let mut points: Vec<(f64, f64)> = (0..10_000).map(|k| (f64::from(k), 0.0)).collect();
        points[7777].1 = 5.0;
        let few = thinned(&points);
        assert!(few.len() <= MOST_POINTS && few.contains(&(7777.0, 5.0)));
    }
}

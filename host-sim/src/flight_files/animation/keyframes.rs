//! Times of the flight as shares of the animation's round, and the style sheet that makes things appear and move then.

use std::fmt::Write as _;

/// Length of one round, s; the flight takes this share of it, and its end stays in sight for the rest.
pub(super) const ROUND_S: f64 = 12.0;
const FLOWN_PERCENT: f64 = 88.0;
/// What is new is larger for so long, and a flash fades within it, percent of a round.
const NEW_PERCENT: f64 = 3.0;

/// A style sheet in the making.
pub(super) struct Keyframes {
    start_s: f64,
    flight_s: f64,
    css: String,
    count: usize,
}

impl Keyframes {
    /// For a flight from one time to another, s.
    pub(super) fn new(start_s: f64, end_s: f64) -> Self {
        Self {
            start_s,
            flight_s: (end_s - start_s).max(1e-3),
            css: String::new(),
            count: 0,
        }
    }

    /// What has flown by then, 0 to 1.
    pub(super) fn share(&self, time_s: f64) -> f64 {
        ((time_s - self.start_s) / self.flight_s).clamp(0.0, 1.0)
    }

    fn percent(&self, time_s: f64) -> f64 {
        FLOWN_PERCENT * self.share(time_s)
    }

    /// Dots that are there from a time on, so many times as large when they are new. `width` is that of their stroke.
    pub(super) fn dots_from(&mut self, time_s: f64, width: f64, larger: f64) -> String {
        let at = self.percent(time_s);
        let (large, settled) = (larger * width, at + NEW_PERCENT);
        self.add(&format!(
            "0%,{at:.2}%{{stroke-width:0}}{:.2}%{{stroke-width:{large:.1}px}}{settled:.2}%,to{{stroke-width:{width}px}}",
            at + 0.01
        ))
    }

    /// Something that flashes at a time and fades.
    pub(super) fn flash(&mut self, time_s: f64) -> String {
        let at = self.percent(time_s);
        self.add(&format!(
            "0%,{at:.2}%{{opacity:0}}{:.2}%{{opacity:1}}{:.2}%,to{{opacity:0}}",
            at + 0.01,
            at + NEW_PERCENT
        ))
    }

    /// Something that is there between two times; without a second one to the end of the round. Wants steps, not a slide.
    pub(super) fn between(&mut self, from_s: f64, until_s: Option<f64>) -> String {
        let from = self.percent(from_s);
        let end = until_s.map_or_else(String::new, |s| format!("{:.2}%{{opacity:0}}", self.percent(s)));
        self.add(&format!("0%{{opacity:0}}{from:.2}%{{opacity:1}}{end}"))
    }

    /// A property that goes through values in order of time, s, and keeps the last one.
    pub(super) fn through(&mut self, property: &str, values: impl Iterator<Item = (f64, String)>) -> String {
        let mut steps = String::new();
        let mut last = None;
        for (time_s, value) in values {
            let lead = if last.is_none() { "0%," } else { "" };
            let _ = write!(steps, "{lead}{:.2}%{{{property}:{value}}}", self.percent(time_s));
            last = Some(value);
        }
        let _ = last.map(|value| write!(steps, "to{{{property}:{value}}}"));
        self.add(&steps)
    }

    /// Names an animation of these steps.
    fn add(&mut self, steps: &str) -> String {
        let name = format!("k{}", self.count);
        self.count += 1;
        let _ = writeln!(self.css, "@keyframes {name}{{{steps}}}");
        name
    }

    /// The style sheet. Who asks for less motion sees the end of the flight.
    pub(super) fn style(self) -> String {
        format!(
            ".move{{animation:{ROUND_S}s linear infinite}}.step{{animation:{ROUND_S}s step-end infinite}}\n\
             @media (prefers-reduced-motion:reduce){{.move,.step{{animation:none}}}}\n{}",
            self.css
        )
    }
}

//! A rectangle of the drawing that shows the world in one view.

use crate::flight_files::views::View;

/// Room around what must be seen; what lies beyond is seen there.
const ROOM: f64 = 40.0;

/// From the world to the drawing.
pub(super) struct Panel {
    view: View,
    per_m: f64,
    /// Where the middle of what is shown lies: in the view, m, and in the drawing.
    middle_m: [f64; 2],
    middle: [f64; 2],
    rectangle: [f64; 4],
}

impl Panel {
    /// A view in which these places fill a rectangle (left, top, width, height).
    pub(super) fn new(view: View, rectangle: [f64; 4], places_m: impl Iterator<Item = [f64; 3]>) -> Self {
        let [left, top, width, height] = rectangle;
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for place in places_m.map(view) {
            for k in 0..2 {
                low[k] = low[k].min(place[k]);
                high[k] = high[k].max(place[k]);
            }
        }
        if low[0] > high[0] {
            (low, high) = ([0.0; 2], [1.0; 2]);
        }
        let [across, up] = [0, 1].map(|k| (high[k] - low[k]).max(1.0));
        let per_m = ((width - 2.0 * ROOM) / across).min((height - 2.0 * ROOM) / up);
        Self {
            view,
            per_m,
            middle_m: [0, 1].map(|k| (low[k] + high[k]) / 2.0),
            middle: [left + width / 2.0, top + height / 2.0],
            rectangle,
        }
    }

    /// Where a place lies in the drawing, across and down.
    pub(super) fn at(&self, place_m: [f64; 3]) -> [f64; 2] {
        let [across, up, _] = (self.view)(place_m);
        [
            self.middle[0] + (across - self.middle_m[0]) * self.per_m,
            self.middle[1] - (up - self.middle_m[1]) * self.per_m,
        ]
    }

    /// How near to who looks a place is, m, or how much a direction comes nearer.
    pub(super) fn nearness(&self, place: [f64; 3]) -> f64 {
        (self.view)(place)[2]
    }

    /// Units of the drawing to a metre.
    pub(super) fn per_m(&self) -> f64 {
        self.per_m
    }

    /// What is drawn, cut at the rectangle's edge.
    pub(super) fn framed(&self, name: &str, body: &str) -> String {
        let [left, top, width, height] = self.rectangle;
        let rectangle = format!(r#"<rect x="{left}" y="{top}" width="{width}" height="{height}" rx="8""#);
        format!(
            r##"<clipPath id="{name}">{rectangle}/></clipPath>{rectangle} class="ground"/><g clip-path="url(#{name})">{body}</g>"##
        )
    }
}

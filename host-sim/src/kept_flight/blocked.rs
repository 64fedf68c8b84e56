//! What is heard while the line of sight is blocked.

use std::sync::Arc;

use cslam_firmware::app::Estimated;

use crate::recording::Span;

/// The paths of a flight whose line of sight is blocked for a while.
#[derive(Clone, Debug)]
pub struct Blocked {
    /// When: this or a longer while.
    pub(super) span: Span,
    /// Of sweeps 0, 1, 2 ...
    pub(super) estimated: Arc<[Estimated]>,
}

impl Blocked {
    /// The same for the first part of it: after these seconds the line of sight is back.
    #[must_use]
    pub fn for_s(&self, length_s: f64) -> Self {
        let to_s = self.span.to_s.min(self.span.from_s + length_s);
        Self {
            span: Span { to_s, ..self.span },
            ..self.clone()
        }
    }
}

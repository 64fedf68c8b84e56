//! What the links of a path list are: either classifier over all paths of a link.

use cslam_core::link_state::{Classifier, LinkGeometry, PaperClassifier, Probabilities, Received};
use cslam_core::path::Path;
use cslam_core::reflection::Ends;
use cslam_core::signal::Waveform;

use crate::paths::LinkPath;

/// Either classifier.
#[derive(Clone, Copy, Debug)]
pub enum Judge<'m> {
    /// Every path for itself.
    Best(Classifier<'m>),
    /// The link by its strongest paths.
    Paper(PaperClassifier<'m>),
}

/// What a link and its paths are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Judged {
    /// Of the link; `None` in an outage.
    pub link: Option<Probabilities>,
    /// Of each path; `None` where its numbers are no measurement, and for all but the strongest with the paper's classifier.
    pub paths: Vec<Option<Probabilities>>,
}

/// A path as the classifiers take it, with its gain where the list has one.
pub fn received(path: Path<cslam_core::geometry::World>, listed: &LinkPath) -> Received {
    // A path without any power has no gain to speak of.
    let gain_db = listed.gain_db().filter(|gain| gain.is_finite());
    Received {
        path,
        gain_db: gain_db.map(|gain| gain as f32),
    }
}

impl Judge<'_> {
    /// Judges the paths of a link, strongest first.
    ///
    /// # Errors
    /// In words, when the ends of the link or the paper's inputs are no measurement.
    pub fn link(&self, ends: &Ends, received: &[Received]) -> Result<Judged, String> {
        if received.is_empty() {
            return Ok(Judged::default());
        }
        match self {
            Self::Best(classifier) => {
                let geometry =
                    LinkGeometry::new(ends, received, &Waveform::default()).map_err(|e| e.to_string())?;
                let paths: Vec<_> = received
                    .iter()
                    .map(|path| classifier.path(&geometry, path).ok())
                    .collect();
                // The strongest path that is a measurement stands for the link.
                let link = paths.iter().copied().flatten().next();
                Ok(Judged { link, paths })
            }
            Self::Paper(classifier) => {
                let link = classifier.link(received).map_err(|e| e.to_string())?;
                let paths = (0..received.len()).map(|path| link.filter(|_| path == 0));
                Ok(Judged {
                    link,
                    paths: paths.collect(),
                })
            }
        }
    }
}

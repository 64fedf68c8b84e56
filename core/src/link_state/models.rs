//! The models that fly, in flash: made by the recipe of docs/link-state.md from `host-sim/models`.

use super::{Model, ModelError, PathClassifier, Trees};

/// Bytes at an address that a model may have.
#[repr(C, align(8))]
struct Aligned<const N: usize>([u8; N]);

/// Static bytes of a file in `core/models`, aligned.
macro_rules! file {
    ($name:literal) => {{
        static FILE: Aligned<{ include_bytes!(concat!("../../models/", $name)).len() }> =
            Aligned(*include_bytes!(concat!("../../models/", $name)));
        &FILE.0
    }};
}

/// File of the geometric network for paths with angle of departure.
pub fn geometric_file() -> &'static [u8] {
    file!("geometric.lscn")
}

/// File of the geometric network for paths without angle of departure.
pub fn geometric_without_departure_file() -> &'static [u8] {
    file!("geometric-without-departure.lscn")
}

/// File of the trees for paths of a flight.
pub fn trees_file() -> &'static [u8] {
    file!("trees.lscn")
}

/// File of the paper's network, K = 9.
pub fn paper_file() -> &'static [u8] {
    file!("paper-k9.lscn")
}

/// The geometric network for paths with angle of departure.
///
/// # Errors
/// None in a sound image: a [`ModelError`] means that its flash is damaged.
pub fn geometric() -> Result<Model<'static>, ModelError> {
    Model::parse(geometric_file())
}

/// The geometric network for paths without angle of departure.
///
/// # Errors
/// As [`geometric`].
pub fn geometric_without_departure() -> Result<Model<'static>, ModelError> {
    Model::parse(geometric_without_departure_file())
}

/// The classifier of a flight's paths.
///
/// # Errors
/// As [`geometric`].
pub fn trees() -> Result<PathClassifier<'static>, ModelError> {
    PathClassifier::new(Trees::parse(trees_file())?)
}

/// The paper's network, K = 9.
///
/// # Errors
/// As [`geometric`].
pub fn paper() -> Result<Model<'static>, ModelError> {
    Model::parse(paper_file())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link_state::{Classifier, GEOMETRIC_INPUTS, GEOMETRIC_NAMES, PAPER_NAMES, PaperClassifier};

    #[test]
    fn shipped_models_take_the_features_there_are() {
        let (with, without) = (
            geometric().expect("sound"),
            geometric_without_departure().expect("sound"),
        );
        assert!(with.input_names().eq(GEOMETRIC_NAMES));
        assert!(
            without
                .input_names()
                .eq(GEOMETRIC_NAMES.into_iter().take(GEOMETRIC_INPUTS))
        );
        assert!(Classifier::new(with, without).is_ok());
        assert!(trees().expect("sound").trees().trees() > 100);
        let paper = paper().expect("sound");
        for (index, name) in paper.input_names().enumerate() {
            assert!(name.starts_with(PAPER_NAMES[index % 3]), "{name}");
        }
        let classifier = PaperClassifier::new(paper).expect("a paper model");
        assert_eq!((classifier.paths(), paper.shape().macs()), (9, 7030));
    }
}

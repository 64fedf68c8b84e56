//! Which network classifies what, and what comes out when there is nothing to classify.

#![allow(clippy::expect_used, reason = "a helper of a test fails by panicking")]

use nalgebra::Matrix3;

use cslam_core::geometry::{Direction, Position};
use cslam_core::link_state::{
    Classifier, ClassifyError, Description, GEOMETRIC_INPUTS, GEOMETRIC_WITH_DEPARTURE_INPUTS,
    InferenceError, InputScale, Kind, LinkGeometry, LinkState, Model, Outputs, PaperClassifier,
    Probabilities, Received, Rows, STATES, Shape, write,
};
use cslam_core::path::{Departure, Path, diagonal_covariance};
use cslam_core::reflection::{Ends, InputError};
use cslam_core::signal::Waveform;

#[repr(align(8))]
struct File([u8; 2048]);

/// A network of one layer that tells `state` of everything, and the first input's sign in favour of it.
fn file(kind: Kind, inputs: usize, state: usize) -> (File, usize) {
    let outputs: &[usize] = if kind == Kind::Paper {
        &[4, STATES]
    } else {
        &[STATES]
    };
    let shape = Shape::new(kind, inputs, outputs).expect("small");
    let layers: [_; 2] = core::array::from_fn(|layer| {
        let columns = if layer < shape.layers() {
            shape.columns(layer)
        } else {
            0
        };
        [0_i8; 256][..columns * outputs.get(layer).copied().unwrap_or(0)].to_vec()
    });
    let mut biases = [0; STATES];
    biases[state] = 1000;
    let last = shape.layers() - 1;
    let rows: Vec<Rows<'_>> = (0..=last)
        .map(|layer| Rows {
            weights: &layers[layer],
            biases: if layer == last { &biases } else { &[0; 4] },
            outputs: if layer == last {
                Outputs::Logits(&[1e-2; STATES])
            } else {
                Outputs::Requantised(&[1 << 24; 4])
            },
        })
        .collect();
    let names: Vec<String> = (0..inputs).map(|i| format!("x{i}")).collect();
    let mut file = File([0; 2048]);
    let scales = vec![
        InputScale {
            offset: 0.0,
            steps: 1.0,
        };
        inputs
    ];
    let description = Description {
        shape,
        temperature: 1.0,
        names: &names.join(","),
        inputs: &scales,
        layers: &rows,
    };
    let length = write(&description, &mut file.0).expect("room");
    (file, length)
}

fn model((file, length): &(File, usize)) -> Model<'_> {
    Model::parse(&file.0[..*length]).expect("as written")
}

fn received(aod: bool) -> Received {
    let aoa = Direction::from_zenith_azimuth(1.4, 0.3).expect("angles");
    Received {
        path: Path {
            c_tau_m: 60.0,
            aoa,
            aod: aod.then_some(Departure {
                direction: aoa,
                sigma_rad: 0.03,
            }),
            covariance: diagonal_covariance(0.1, 0.01),
        },
        gain_db: None,
    }
}

fn ends() -> Ends {
    Ends {
        uav: Position::new(0.0, 40.0, 9.0).expect("finite"),
        uav_covariance: Matrix3::identity() * 0.09,
        gmt: Position::new(3.0, 1.0, 1.5).expect("finite"),
    }
}

#[test]
fn a_path_goes_to_the_network_that_has_its_inputs() {
    let with = file(Kind::Geometric, GEOMETRIC_WITH_DEPARTURE_INPUTS, 1);
    let without = file(Kind::Geometric, GEOMETRIC_INPUTS, 2);
    let classifier = Classifier::new(model(&with), model(&without)).expect("fitting");
    let (ends, paths) = (ends(), [received(true), received(false)]);
    let link = LinkGeometry::new(&ends, &paths, &Waveform::default()).expect("apart");
    let state = |path: &Received| classifier.path(&link, path).expect("sound").state();
    assert_eq!(state(&paths[0]), LinkState::FirstOrder);
    assert_eq!(state(&paths[1]), LinkState::HigherOrder);
    let mut bad = paths[0];
    bad.path.c_tau_m = f32::NAN;
    assert_eq!(
        classifier.path(&link, &bad),
        Err(ClassifyError::Input(InputError::NotFinite))
    );
}

#[test]
fn models_that_do_not_fit_are_refused() {
    let with = file(Kind::Geometric, GEOMETRIC_WITH_DEPARTURE_INPUTS, 0);
    let without = file(Kind::Geometric, GEOMETRIC_INPUTS, 0);
    let paper = file(Kind::Paper, 9, 0);
    let refused = Classifier::new(model(&without), model(&without)).expect_err("swapped");
    assert_eq!(
        (refused.expected_inputs, refused.inputs),
        (GEOMETRIC_WITH_DEPARTURE_INPUTS, GEOMETRIC_INPUTS)
    );
    assert!(Classifier::new(model(&with), model(&with)).is_err());
    assert!(Classifier::new(model(&with), model(&paper)).is_err());
    let refused = PaperClassifier::new(model(&with)).expect_err("geometric");
    assert_eq!(
        (refused.expected_kind, refused.expected_inputs),
        (Kind::Paper, GEOMETRIC_WITH_DEPARTURE_INPUTS.next_multiple_of(3))
    );
}

#[test]
fn the_papers_network_tells_the_state_of_a_link_and_an_outage_is_one() {
    let file = file(Kind::Paper, 9, 0);
    let classifier = PaperClassifier::new(model(&file)).expect("the paper's");
    assert_eq!(classifier.paths(), 3);
    assert_eq!(classifier.link(&[]), Ok(None));
    let paths = [received(false); 5];
    for count in [1, 3, 5] {
        let told = classifier.link(&paths[..count]).expect("finite").expect("heard");
        assert_eq!(told.state(), LinkState::LineOfSight);
    }
    let mut bad = paths;
    bad[0].path.c_tau_m = f32::INFINITY;
    assert!(matches!(
        classifier.link(&bad),
        Err(ClassifyError::Inference(InferenceError::NotFinite { input: 0 }))
    ));
}

#[test]
fn the_most_probable_state_wins_and_the_lower_order_among_equals() {
    let state = |los, first_order, higher_order| {
        Probabilities {
            los,
            first_order,
            higher_order,
            artefact: 0.0,
        }
        .state()
    };
    assert_eq!(state(0.4, 0.3, 0.3), LinkState::LineOfSight);
    assert_eq!(state(0.3, 0.4, 0.3), LinkState::FirstOrder);
    assert_eq!(state(0.3, 0.3, 0.4), LinkState::HigherOrder);
    assert_eq!(state(0.4, 0.4, 0.2), LinkState::LineOfSight);
    assert_eq!(state(0.2, 0.4, 0.4), LinkState::FirstOrder);
}

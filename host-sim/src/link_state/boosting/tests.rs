//! Trees learn what no single input tells, the same for any number of threads, and lose nothing to rounding.

use super::*;

/// First order where exactly one of two inputs is above its middle, else line of sight; every tenth is said to be an artefact instead.
fn samples(count: u32) -> FlightSamples {
    let mut samples = FlightSamples::default();
    let mut draws = crate::random::Stream::new(u64::from(count), 0);
    for index in 0..count {
        let mut inputs = [0.0; TREE_INPUTS];
        (inputs[3], inputs[20]) = (draws.normal() as f32, draws.normal() as f32);
        let class = match (inputs[3] > 0.0) != (inputs[20] > 0.0) {
            _ if index % 10 == 0 => PathClass::Artefact,
            true => PathClass::FirstOrder,
            false => PathClass::LineOfSight,
        };
        samples.inputs.push(inputs);
        samples.classes.push(class);
        samples.strongest.push(index % 4 == 0);
    }
    samples
}

fn trained(samples: &FlightSamples) -> Boosted {
    train(samples, &Settings::default(), |_| ()).expect("trains")
}

#[test]
fn trees_learn_what_no_single_input_tells_and_how_sure_it_is() {
    let training = samples(4000);
    let file = trained(&training).to_file().expect("sound");
    let trees = Trees::parse(&file).expect("sound");
    let found = judge(&trees, &samples(1000)).expect("numbers");
    assert!(found.right.expect("some") > 0.88, "{found:?}");
    assert!(found.sure_precision.expect("some") > 0.87, "{found:?}");
    assert!(found.sure_recall.expect("some") > 0.8, "{found:?}");
    let all: Vec<_> = (training.inputs.iter())
        .map(|inputs| trees.classify(inputs).expect("numbers"))
        .collect();
    let artefacts = all.iter().map(|p| f64::from(p.artefact)).sum::<f64>() / all.len() as f64;
    assert!((artefacts - 0.1).abs() < 0.01, "{artefacts}");
}

#[test]
fn the_same_samples_make_the_same_file_for_any_number_of_threads() {
    let training = samples(600);
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a pool");
    let alone = one.install(|| trained(&training)).to_file().expect("sound");
    assert_eq!(alone, trained(&training).to_file().expect("sound"));
}

#[test]
fn rounded_leaves_say_what_the_trained_ones_said() {
    let training = samples(600);
    let boosted = trained(&training);
    let file = boosted.to_file().expect("sound");
    let trees = Trees::parse(&file).expect("sound");
    for (inputs, row) in training
        .inputs
        .iter()
        .zip(rounded(&training, &boosted.scales))
        .take(50)
    {
        let p = trees.classify(inputs).expect("numbers");
        let expected = softmax(&boosted.logits(&row));
        assert!((f64::from(p.first_order) - expected[1]).abs() < 1e-3);
    }
}

#[test]
fn one_factor_undoes_what_training_was_too_sure_of() {
    // Trained on what is certain, calibrated where every tenth is otherwise.
    let mut certain = samples(2000);
    for index in (0..certain.len()).step_by(10) {
        certain.classes[index] = PathClass::HigherOrder;
    }
    let mut boosted = trained(&certain);
    let sharpness = boosted.calibrate(&samples(1000));
    assert!((0.25..1.0).contains(&sharpness), "{sharpness}");
    let before = trained(&samples(2000)).calibrate(&samples(1000));
    assert!(before > sharpness && (0.7..1.3).contains(&before), "{before}");
}

#[test]
fn what_cannot_be_trained_on_is_said() {
    let none = train(&FlightSamples::default(), &Settings::default(), |_| ());
    assert!(none.expect_err("nothing").to_string().contains("no samples"));
    let rounds = Settings {
        rounds: 0,
        ..Settings::default()
    };
    let error = train(&samples(10), &rounds, |_| ()).expect_err("no rounds");
    assert!(error.to_string().contains("expected 1 to"));
}

//! Training gives the same bits on any number of threads, ends in time, and steps as Adam does.

use super::*;
use cslam_core::link_state::GEOMETRIC_INPUTS;

/// Three classes that a bent line separates.
fn samples(count: usize, seed: u64) -> Samples {
    let mut stream = Stream::new(seed, 5);
    let mut samples = Samples {
        width: GEOMETRIC_INPUTS,
        ..Samples::default()
    };
    for _ in 0..count {
        let row: Vec<f32> = (0..GEOMETRIC_INPUTS)
            .map(|_| (10.0 * stream.uniform() - 5.0) as f32)
            .collect();
        let height = row[0] - 0.4 * row[1] * row[1];
        samples.states.push(if height > 0.0 {
            0
        } else {
            1 + u8::from(row[2] > 1.0)
        });
        samples.strongest.push(true);
        samples.inputs.extend(row);
    }
    samples
}

fn settings() -> Settings {
    Settings {
        hidden: vec![16, 12],
        epochs: 24,
        // A dozen steps an epoch are few: each has to count.
        learning_rate: 0.02,
        ..Settings::of(Task::Geometric { departure: false })
    }
}

fn trained(threads: usize, seed: u64) -> Trained {
    let (training, validation) = (samples(6003, 1), samples(1000, 2));
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("a pool");
    let task = Task::Geometric { departure: false };
    let settings = Settings { seed, ..settings() };
    pool.install(|| train(task, &training, &validation, &settings, |_, _| true))
        .expect("trained")
}

#[test]
fn weights_are_the_same_bits_for_any_number_of_threads() {
    let one = trained(1, 1);
    let bits = |t: &Trained| t.model.to_bytes();
    assert_eq!(bits(&one), bits(&trained(4, 1)));
    assert_eq!(one.curve, trained(2, 1).curve);
    assert_ne!(bits(&one), bits(&trained(1, 2)), "the seed counts");
    let last = one.curve.last().expect("epochs");
    assert!(last.validation_accuracy > 0.75, "{last:?}");
    assert!(last.training_loss < 0.5 * one.curve[0].training_loss);
}

#[test]
fn training_ends_when_the_validation_loss_does_not_fall() {
    let training = samples(1500, 1);
    let mut validation = samples(500, 2);
    // Nothing learnt from the training samples can help here.
    validation.states.iter_mut().for_each(|s| *s = 2 - *s);
    let settings = Settings {
        epochs: 50,
        patience: 3,
        cosine: false,
        ..settings()
    };
    let task = Task::Geometric { departure: false };
    let trained = train(task, &training, &validation, &settings, |_, _| true).expect("trained");
    let losses: Vec<f64> = trained.curve.iter().map(|e| e.validation_loss).collect();
    let best = losses.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(
        losses.len() < 50 && losses[losses.len() - 4] == best,
        "{losses:?}"
    );
    let logits = logits_of(&trained.model, &validation);
    assert!(
        (loss_and_accuracy(&logits, &validation, &settings).0 - best).abs() < 1e-12,
        "the best epoch's weights"
    );
}

#[test]
fn adams_first_step_is_the_rate_against_the_gradients_sign() {
    let mut parameters = [1.0, 2.0, 3.0];
    Adam::new(3).step(&mut parameters, &[5.0, -1e-3, 0.0], 0.01);
    for (p, expected) in parameters.iter().zip([0.99, 2.01, 3.0]) {
        assert!((p - expected).abs() < 1e-5, "{parameters:?}");
    }
}

#[test]
fn nothing_to_train_on_is_said() {
    let task = Task::Geometric { departure: false };
    let error = train(task, &Samples::default(), &samples(10, 1), &settings(), |_, _| {
        true
    });
    assert!(error.expect_err("no samples").contains("found none"));
}

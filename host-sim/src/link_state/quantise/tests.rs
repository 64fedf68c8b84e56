use cslam_core::link_state::{Activations, Network};

use super::*;
use crate::link_state::float_model::Layer as FloatLayer;
use crate::random::Stream;

fn layer(inputs: usize, outputs: usize, random: &mut Stream) -> FloatLayer {
    let size = (2.0 / inputs as f64).sqrt();
    FloatLayer {
        inputs,
        weight: (0..inputs * outputs)
            .map(|_| (size * random.normal()) as f32)
            .collect(),
        bias: (0..outputs).map(|_| (0.1 * random.normal()) as f32).collect(),
    }
}

/// A network with the weights that training starts from, in the shapes that fly.
fn model(kind: Kind) -> FloatModel {
    let mut random = Stream::new(3, 0);
    let (n, sizes): (usize, &[(usize, usize)]) = match kind {
        Kind::Paper { .. } => (27, &[(3, 10), (34, 50), (50, 100), (100, 3)]),
        Kind::Geometric => (11, &[(11, 64), (64, 64), (64, 3)]),
    };
    let layers = sizes.iter().map(|&(c, r)| layer(c, r, &mut random)).collect();
    let names = (0..n).map(|i| format!("x{i}")).collect();
    let offset = (0..n).map(|i| i as f32 * 0.5).collect();
    FloatModel::new(kind, names, offset, vec![0.125; n], 1.3, layers).expect("fits")
}

fn rows(model: &FloatModel, count: usize) -> Vec<Vec<f32>> {
    let mut random = Stream::new(9, 1);
    (0..count)
        .map(|_| {
            let offsets = model.input_offset();
            offsets
                .iter()
                .map(|o| o + 16.0 * (random.uniform() as f32 - 0.5))
                .collect()
        })
        .collect()
}

fn quantised(model: &FloatModel) -> (Quantised, Vec<Vec<f32>>) {
    let rows = rows(model, 500);
    let largest = largest_activations(model, rows.iter().map(Vec::as_slice));
    (Quantised::new(model, &largest).expect("fits"), rows)
}

#[test]
fn the_flight_code_computes_what_the_plain_arithmetic_does() {
    for kind in [Kind::Paper { k: 9 }, Kind::Geometric] {
        let model = model(kind);
        let (quantised, rows) = quantised(&model);
        let file = quantised.to_file().expect("fits");
        let network: Network = Network::new(file.model().expect("sound"));
        let mut work = Activations::new();
        for row in &rows {
            let flow = quantised.flow(row);
            let sums = network.sums(row, &mut work).expect("finite");
            let sums: Vec<i64> = sums[..3].iter().map(|&s| i64::from(s)).collect();
            assert_eq!(sums, flow.sums);
            let logits = network.logits(row, &mut work).expect("finite");
            for (logit, exact) in logits.iter().zip(quantised.logits(&flow)) {
                assert!((f64::from(*logit) - exact).abs() <= 1e-6 * exact.abs());
            }
        }
    }
}

#[test]
fn integers_follow_the_float_network() {
    for (kind, least_db) in [(Kind::Paper { k: 9 }, 33.0), (Kind::Geometric, 33.0)] {
        let model = model(kind);
        let (quantised, rows) = quantised(&model);
        let states = rows.iter().map(|row| {
            let logits = model.logits(row);
            (row.as_slice(), report::most_likely(logits.map(f64::from)))
        });
        let report = report(&model, &quantised, states);
        println!("{report:#?}");
        for layer in &report.layers {
            assert!(layer.sqnr_db > least_db && layer.sqnr_db < 60.0, "{layer:?}");
        }
        // Over the samples that set the ranges, next to nothing clips.
        assert!(report.layers[0].clipped.is_some_and(|share| share < 1e-3));
        assert_eq!(report.float_accuracy, 1.0);
        assert_eq!(report.int8_accuracy, report.agreement);
        assert!(report.agreement > 0.97 && report.agreement < 1.0);
    }
}

#[test]
fn a_wide_and_a_narrow_unit_keep_their_own_steps() {
    // Two units of which one is a thousand times the other, both decisive for the logits.
    let first = FloatLayer {
        inputs: 1,
        weight: vec![1000.0, 1.0],
        bias: vec![0.0, 0.0],
    };
    let last = FloatLayer {
        inputs: 2,
        weight: vec![0.001, 0.0, 0.0, 1.0, 0.0, 0.0],
        bias: vec![0.0; 3],
    };
    let model = FloatModel::new(
        Kind::Geometric,
        vec!["x".into()],
        vec![0.0],
        vec![1.0],
        1.0,
        vec![first, last],
    )
    .expect("fits");
    let rows: Vec<Vec<f32>> = (0..=100).map(|i| vec![i as f32 / 100.0]).collect();
    let largest = largest_activations(&model, rows.iter().map(Vec::as_slice));
    // Units that hardly fire keep a sixteenth of the widest range: set what this test is about.
    assert_eq!(largest, [[1000.0, 1.0]]);
    let quantised = Quantised::new(&model, &[vec![1000.0, 1000.0]]).expect("fits");
    let logits = |x: f32| quantised.logits(&quantised.flow(&[x]));
    assert!((logits(0.5)[0] - 0.5).abs() < 0.005);
    assert_eq!(logits(0.05)[1], 0.0, "a range of another unit leaves it no step");
    let quantised = Quantised::new(&model, &[vec![16.0, 1.0]]).expect("fits");
    assert!((quantised.flow(&[0.5]).hidden[0][1] - 0.5).abs() < 0.005);
}

#[test]
fn rows_of_zeros_and_large_biases_fit() {
    let zero = FloatLayer {
        inputs: 2,
        weight: vec![0.0, 0.0, 1e-9, 0.0],
        bias: vec![3.0, 5e3],
    };
    let last = FloatLayer {
        inputs: 2,
        weight: vec![1.0, 0.0, 0.0, 0.001, 0.0, 0.0],
        bias: vec![0.0; 3],
    };
    let model = FloatModel::new(
        Kind::Geometric,
        vec!["x".into(), "y".into()],
        vec![0.0; 2],
        vec![1.0; 2],
        1.0,
        vec![zero, last],
    )
    .expect("fits");
    let largest = largest_activations(&model, [[0.0_f32, 0.0].as_slice()]);
    let quantised = Quantised::new(&model, &largest).expect("fits");
    quantised.to_file().expect("sound");
    let logits = quantised.logits(&quantised.flow(&[0.3, -0.3]));
    assert!((logits[1] - 5.0).abs() < 0.03, "{logits:?}");
    assert!((logits[0] - 3.0).abs() < 3.0, "{logits:?}");
}

#[test]
fn what_does_not_fit_is_said() {
    let model = model(Kind::Geometric);
    assert!(Quantised::new(&model, &[]).is_err_and(|e| e.contains("layer 1")));
    let mut random = Stream::new(1, 0);
    let wide = FloatModel::new(
        Kind::Geometric,
        vec!["x".into()],
        vec![0.0],
        vec![1.0],
        1.0,
        vec![layer(1, 200, &mut random), layer(200, 3, &mut random)],
    )
    .expect("fits");
    assert!(Quantised::new(&wide, &[vec![1.0; 200]]).is_err_and(|e| e.contains("more than")));
}

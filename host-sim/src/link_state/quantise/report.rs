//! What quantisation costs: noise of every layer, and of the answers.

use serde::Serialize;

use super::Quantised;
use crate::link_state::float_model::{FloatModel, STATES};

/// Signal and noise of a layer's outputs over some samples.
#[derive(Clone, Debug, Serialize)]
pub struct LayerNoise {
    /// Columns and rows, as `17x64`.
    pub layer: String,
    /// Power of the float network's values over that of the difference, dB.
    pub sqnr_db: f64,
    /// Share of outputs over the int8 range; none for the last layer.
    pub clipped: Option<f64>,
}

/// Float network against integer network.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Samples compared.
    pub samples: usize,
    /// Layers, in order; the last one's outputs are the logits.
    pub layers: Vec<LayerNoise>,
    /// Share of samples in which both find the same state.
    pub agreement: f64,
    /// Share of samples that the float network classifies rightly.
    pub float_accuracy: f64,
    /// Share of samples that the integer network classifies rightly.
    pub int8_accuracy: f64,
}

/// Compares over samples: inputs as the features come, and the true state 0, 1 or 2.
pub fn report<'a>(
    model: &FloatModel,
    quantised: &Quantised,
    samples: impl IntoIterator<Item = (&'a [f32], u8)>,
) -> Report {
    let layers = quantised.layers.len();
    let mut powers = vec![[0.0; 2]; layers];
    let mut clipped = vec![0; layers];
    let [mut count, mut agreed, mut float_right, mut int8_right] = [0_usize; 4];
    for (row, state) in samples {
        let (float, flow) = (model.activations(row), quantised.flow(row));
        let logits = quantised.logits(&flow);
        let outputs = flow.hidden.iter().chain([&logits]);
        for ((power, values), float) in powers.iter_mut().zip(outputs).zip(float.iter().skip(1)) {
            for (value, float) in values.iter().zip(float) {
                let float = f64::from(*float);
                power[0] += float * float;
                power[1] += (value - float) * (value - float);
            }
        }
        flow.clipped
            .iter()
            .zip(&mut clipped)
            .for_each(|(n, all)| *all += n);
        let of_float = most_likely(model.logits(row).map(f64::from));
        let of_int8 = most_likely(std::array::from_fn(|i| logits.get(i).copied().unwrap_or(0.0)));
        count += 1;
        agreed += usize::from(of_float == of_int8);
        float_right += usize::from(of_float == state);
        int8_right += usize::from(of_int8 == state);
    }
    let share = |n: usize| n as f64 / count.max(1) as f64;
    Report {
        samples: count,
        layers: (0..layers)
            .map(|index| {
                let rows = quantised.shape.outputs(index);
                let hidden = index + 1 < layers;
                LayerNoise {
                    layer: format!("{}x{rows}", quantised.shape.columns(index)),
                    sqnr_db: 10.0 * libm::log10(powers[index][0] / powers[index][1]),
                    clipped: hidden.then(|| share(clipped[index]) / rows as f64),
                }
            })
            .collect(),
        agreement: share(agreed),
        float_accuracy: share(float_right),
        int8_accuracy: share(int8_right),
    }
}

/// State of the greatest logit, the first one among equals.
pub(super) fn most_likely(logits: [f64; STATES]) -> u8 {
    (1..STATES as u8).fold(0, |best, state| {
        if logits[usize::from(state)] > logits[usize::from(best)] {
            state
        } else {
            best
        }
    })
}

//! The quantised network step by step in plain arithmetic, for what its rounding costs: values of every layer. A second
//! implementation of what `cslam_core::link_state::Network` does; a test holds them together.

use super::{LARGEST, Quantised};

/// What flows through the integer network.
pub(super) struct Flow {
    /// Value of each output of each hidden layer.
    pub(super) hidden: Vec<Vec<f64>>,
    /// How many outputs of each hidden layer were clipped at the top.
    pub(super) clipped: Vec<usize>,
    /// Sums of the last layer.
    pub(super) sums: Vec<i64>,
}

impl Quantised {
    /// Runs the network on inputs as the features come.
    pub(super) fn flow(&self, inputs: &[f32]) -> Flow {
        let mut x: Vec<i64> = inputs
            .iter()
            .zip(&self.inputs)
            .map(|(x, scale)| {
                let most = LARGEST as f32;
                let steps = ((x - scale.offset) * scale.steps).clamp(-most, most);
                // The flight code's sum, near 2^8, decides what is half.
                (steps + 384.5).floor() as i64 - 384
            })
            .collect();
        let mut aside = x.split_off(self.shape.head());
        let mut flow = Flow {
            hidden: Vec::new(),
            clipped: Vec::new(),
            sums: Vec::new(),
        };
        for (index, layer) in self.layers.iter().enumerate() {
            let sums: Vec<i64> = layer
                .weights
                .chunks_exact(layer.columns)
                .zip(&layer.biases)
                .map(|(row, &bias)| {
                    let products = row.iter().zip(&x).map(|(&w, x)| i64::from(w) * x);
                    i64::from(bias) + products.sum::<i64>()
                })
                .collect();
            if index + 1 == self.layers.len() {
                flow.sums = sums;
                break;
            }
            let scaled = sums
                .iter()
                .zip(&layer.multipliers)
                .map(|(sum, &m)| (sum * i64::from(m) + (1 << 31)) >> 32);
            let most = LARGEST as i64;
            flow.clipped.push(scaled.clone().filter(|y| *y > most).count());
            x = scaled.map(|y| y.clamp(0, most)).collect();
            let values = x.iter().zip(&layer.output_steps).map(|(&y, s)| y as f64 * s);
            flow.hidden.push(values.collect());
            x.append(&mut aside);
        }
        flow
    }

    /// Logits of a flow, before the temperature.
    pub(super) fn logits(&self, flow: &Flow) -> Vec<f64> {
        let steps = self.layers.last().map_or(&[][..], |layer| &layer.sum_steps);
        flow.sums
            .iter()
            .zip(steps)
            .map(|(&sum, t)| sum as f64 * t)
            .collect()
    }
}

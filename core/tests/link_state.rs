//! Model files and networks: round trips, every kind of damage, and inference against a plain reference.

#![allow(
    clippy::expect_used,
    clippy::panic,
    reason = "a helper of a test fails by panicking"
)]

use cslam_core::link_state::format::{HEADER, VERSION, length};
use cslam_core::link_state::{
    Activations, Description, InferenceError, InputScale, Kind, Model, ModelError, Network, Outputs, Rows,
    Shape, WriteError, write,
};
use proptest::prelude::*;

/// Bytes that start at a multiple of 8, as a board's flash has them.
#[repr(align(8))]
#[derive(Clone)]
struct Aligned([u8; 32 * 1024]);

/// Numbers of a network, owned.
struct Parts {
    shape: Shape,
    names: String,
    inputs: Vec<InputScale>,
    layers: Vec<(Vec<i8>, Vec<i32>, Vec<i32>)>,
    scales: [f32; 3],
}

fn xorshift(state: &mut u64) -> u64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    *state
}

/// A network with random weights.
fn parts(shape: Shape, seed: u64) -> Parts {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut below = |n: i64| (xorshift(&mut state) >> 11) as i64 % n;
    let names: Vec<_> = (0..shape.inputs()).map(|i| format!("x{i}")).collect();
    Parts {
        shape,
        names: names.join(","),
        inputs: (0..shape.inputs())
            .map(|_| InputScale {
                offset: below(2000) as f32 / 100.0 - 10.0,
                steps: below(1000) as f32 / 100.0 + 3.0,
            })
            .collect(),
        layers: (0..shape.layers())
            .map(|layer| {
                let (columns, rows) = (shape.columns(layer), shape.outputs(layer));
                (
                    (0..columns * rows).map(|_| (below(255) - 127) as i8).collect(),
                    (0..rows).map(|_| (below(200_000) - 100_000) as i32).collect(),
                    (0..rows).map(|_| (below(1 << 23) + (1 << 20)) as i32).collect(),
                )
            })
            .collect(),
        scales: [1e-5, 2e-5, 0.5e-5],
    }
}

impl Parts {
    fn with<R>(&self, use_it: impl FnOnce(&Description<'_>) -> R) -> R {
        let last = self.layers.len() - 1;
        let rows: Vec<_> = self
            .layers
            .iter()
            .enumerate()
            .map(|(index, (weights, biases, multipliers))| Rows {
                weights,
                biases,
                outputs: if index == last {
                    Outputs::Logits(&self.scales)
                } else {
                    Outputs::Requantised(multipliers)
                },
            })
            .collect();
        use_it(&Description {
            shape: self.shape,
            temperature: 1.5,
            names: &self.names,
            inputs: &self.inputs,
            layers: &rows,
        })
    }

    fn file(&self) -> (Box<Aligned>, usize) {
        let mut file = Box::new(Aligned([0; 32 * 1024]));
        let length = self.with(|d| write(d, &mut file.0)).expect("written");
        (file, length)
    }

    /// The sums of the last layer in plain arithmetic, from the definition in docs/link-state.md.
    fn reference(&self, inputs: &[f32]) -> Vec<i64> {
        let int8 = |(x, s): (&f32, &InputScale)| {
            let steps = ((x - s.offset) * s.steps).clamp(-127.0, 127.0);
            i64::from((steps + 384.5).floor() as i32 - 384)
        };
        let all: Vec<i64> = inputs.iter().zip(&self.inputs).map(int8).collect();
        let mut x = all[..self.shape.head()].to_vec();
        for (layer, (weights, biases, multipliers)) in self.layers.iter().enumerate() {
            let sums: Vec<i64> = weights
                .chunks(x.len())
                .zip(biases)
                .map(|(row, &b)| {
                    i64::from(b) + row.iter().zip(&x).map(|(&w, x)| i64::from(w) * x).sum::<i64>()
                })
                .collect();
            if layer + 1 == self.layers.len() {
                return sums;
            }
            x = sums
                .iter()
                .zip(multipliers)
                .map(|(sum, &m)| ((sum * i64::from(m) + (1 << 31)) >> 32).clamp(0, 127))
                .collect();
            if layer == 0 {
                x.extend(&all[self.shape.head()..]);
            }
        }
        panic!("a network has a last layer")
    }
}

fn paper(paths: usize) -> Shape {
    Shape::new(Kind::Paper, 3 * paths, &[10, 50, 100, 3]).expect("sound")
}

fn geometric(inputs: usize) -> Shape {
    Shape::new(Kind::Geometric, inputs, &[64, 64, 3]).expect("sound")
}

fn shapes() -> Vec<Shape> {
    let mut shapes: Vec<_> = [1, 2, 9, 15].map(paper).into();
    shapes.extend([1, 9, 11, 12, 64].map(geometric));
    shapes.push(Shape::new(Kind::Geometric, 5, &[3]).expect("sound"));
    shapes.push(Shape::new(Kind::Geometric, 7, &[9, 128, 21, 3]).expect("sound"));
    shapes
}

#[test]
fn inference_is_the_plain_arithmetic_for_every_shape() {
    for (seed, shape) in shapes().into_iter().enumerate() {
        let parts = parts(shape, seed as u64 + 1);
        let (file, length) = parts.file();
        let network: Network = Network::new(Model::parse(&file.0[..length]).expect("sound"));
        let (mut work, mut state) = (Activations::new(), 77);
        let mut distinct = std::collections::BTreeSet::new();
        for _ in 0..200 {
            let inputs: Vec<f32> = (0..shape.inputs())
                .map(|_| (xorshift(&mut state) % 4000) as f32 / 100.0 - 20.0)
                .collect();
            let sums = network.sums(&inputs, &mut work).expect("finite");
            let expected = parts.reference(&inputs);
            assert_eq!(
                sums[..3].iter().map(|&s| i64::from(s)).collect::<Vec<_>>(),
                expected,
                "{shape:?}"
            );
            assert_eq!(sums[3], 0);
            let logits = network.logits(&inputs, &mut work).expect("finite");
            for ((logit, sum), scale) in logits.iter().zip(expected).zip(parts.scales) {
                assert_eq!(*logit, sum as f32 * scale);
            }
            distinct.insert(sums);
        }
        assert!(
            distinct.len() > 20,
            "{shape:?}: the test sees {} results",
            distinct.len()
        );
    }
}

#[test]
fn a_model_file_tells_what_was_written() {
    let parts = parts(geometric(11), 5);
    let (file, length) = parts.file();
    let model = Model::parse(&file.0[..length]).expect("sound");
    assert_eq!((model.kind(), *model.shape()), (Kind::Geometric, parts.shape));
    assert_eq!(model.temperature(), 1.5);
    assert_eq!(model.input_names().collect::<Vec<_>>().join(","), parts.names);
    assert!(model.input_scales().eq(parts.inputs.iter().copied()));
}

/// Parses after a change; the checksum is put right when asked for.
fn changed(change: impl FnOnce(&mut Vec<u8>), repair: bool) -> Result<(), ModelError> {
    let (file, length) = parts(geometric(3), 9).file();
    let mut bytes = file.0[..length].to_vec();
    change(&mut bytes);
    if repair {
        seal(&mut bytes);
    }
    let mut file = Box::new(Aligned([0; 32 * 1024]));
    file.0[..bytes.len()].copy_from_slice(&bytes);
    Model::parse(&file.0[..bytes.len()]).map(|_| ())
}

fn seal(bytes: &mut [u8]) {
    let end = bytes.len() - 4;
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&bytes[..end]);
    bytes[end..].copy_from_slice(&crc.to_le_bytes());
}

#[test]
fn every_fault_is_refused_by_its_name() {
    // Names x0,x1,x2 take 8 bytes, padded 8; three scales; then the first record: biases, one block of weights, multipliers.
    let scales = HEADER + 8;
    let record = scales + 24;
    let put = |at: usize, value: &[u8]| {
        let value = value.to_vec();
        move |b: &mut Vec<u8>| b[at..at + value.len()].copy_from_slice(&value)
    };
    assert_eq!(changed(|_| (), false), Ok(()));
    assert_eq!(
        changed(|b| b.truncate(HEADER - 1), false),
        Err(ModelError::TooShort)
    );
    assert_eq!(changed(put(0, b"M"), true), Err(ModelError::Magic));
    let version = ModelError::Version { found: VERSION + 1 };
    assert_eq!(changed(put(4, &[2]), true), Err(version));
    let (stated, found) = (length(&geometric(3), 8) as u32, length(&geometric(3), 8) - 4);
    assert_eq!(
        changed(|b| b.truncate(b.len() - 4), false),
        Err(ModelError::Length { stated, found })
    );
    assert_eq!(
        changed(put(record, &[1, 2, 3, 4]), false),
        Err(ModelError::Checksum)
    );
    assert_eq!(changed(put(6, &[3]), true), Err(ModelError::Kind));
    assert_eq!(changed(put(7, &[9]), true), Err(ModelError::Shape));
    assert_eq!(changed(put(12, &[4]), true), Err(ModelError::Shape));
    assert_eq!(changed(put(20, &[60]), true), Err(ModelError::Shape));
    assert_eq!(changed(put(HEADER, b"\xff"), true), Err(ModelError::Names));
    assert_eq!(changed(put(HEADER, b","), true), Err(ModelError::Names));
    assert_eq!(
        changed(put(16, &0.0_f32.to_le_bytes()), true),
        Err(ModelError::Temperature)
    );
    assert_eq!(
        changed(put(16, &f32::NAN.to_le_bytes()), true),
        Err(ModelError::Temperature)
    );
    assert_eq!(
        changed(put(scales + 4, &f32::INFINITY.to_le_bytes()), true),
        Err(ModelError::InputScale)
    );
    assert_eq!(
        changed(put(record + 16, &128_i16.to_le_bytes()), true),
        Err(ModelError::Weight)
    );
    assert_eq!(
        changed(put(record, &[0, 0, 0, 0x41]), true),
        Err(ModelError::Bias)
    );
    assert_eq!(
        changed(put(record + 48, &[0, 0, 0, 0x80]), true),
        Err(ModelError::Multiplier)
    );
    assert_eq!(
        changed(
            |b| {
                let at = b.len() - 8 - 4;
                b[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes())
            },
            true
        ),
        Err(ModelError::Multiplier)
    );
}

#[test]
fn a_misaligned_file_is_refused() {
    let (file, length) = parts(geometric(3), 9).file();
    for shift in 1..4 {
        let mut moved = Box::new(Aligned([0; 32 * 1024]));
        moved.0[shift..shift + length].copy_from_slice(&file.0[..length]);
        assert_eq!(
            Model::parse(&moved.0[shift..shift + length]).map(|_| ()),
            Err(ModelError::Misaligned)
        );
    }
}

#[test]
fn the_writer_refuses_what_the_reader_would() {
    let mut parts = parts(geometric(3), 9);
    let needed = length(&parts.shape, parts.names.len());
    let mut file = Box::new(Aligned([0; 32 * 1024]));
    let short = parts.with(|d| write(d, &mut file.0[..needed - 1]));
    assert_eq!(short, Err(WriteError::Buffer { needed }));
    parts.layers[0].0[5] = -128;
    assert_eq!(
        parts.with(|d| write(d, &mut file.0)),
        Err(WriteError::Model(ModelError::Weight))
    );
    parts.layers[0].0[5] = -127;
    assert_eq!(parts.with(|d| write(d, &mut file.0)), Ok(needed));
    parts.layers[1].1.pop();
    assert_eq!(parts.with(|d| write(d, &mut file.0)), Err(WriteError::Parts));
}

#[test]
fn inputs_that_do_not_fit_are_refused() {
    let (file, length) = parts(geometric(9), 3).file();
    let network: Network = Network::new(Model::parse(&file.0[..length]).expect("sound"));
    let (mut inputs, mut work) = ([0.25_f32; 9], Activations::new());
    assert!(network.classify(&inputs, &mut work).is_ok());
    let count = InferenceError::Count {
        expected: 9,
        found: 8,
    };
    assert_eq!(network.sums(&inputs[..8], &mut work), Err(count));
    inputs[6] = f32::NAN;
    inputs[8] = f32::INFINITY;
    assert_eq!(
        network.classify(&inputs, &mut work),
        Err(InferenceError::NotFinite { input: 6 })
    );
    // Finite, however large, is clamped.
    inputs[6] = f32::MAX;
    inputs[8] = f32::MIN;
    let p = network.classify(&inputs, &mut work).expect("finite");
    assert!((p.los + p.first_order + p.higher_order - 1.0).abs() < 1e-5);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Any change of the bytes is noticed by the checksum; whoever repairs it gets an error or a network that runs.
    #[test]
    fn damage_is_refused_or_harmless(
        seed in 0_u64..4,
        flips in prop::collection::vec((0_usize..64 * 1024, 0_u8..8), 1..4),
        head in prop::collection::vec((0_usize..64, any::<u8>()), 0..3),
        cut in prop::option::of(0_usize..32 * 1024),
    ) {
        let shape = if seed % 2 == 0 { geometric(4) } else { paper(2) };
        let (mut file, length) = parts(shape, seed + 1).file();
        let original = file.clone();
        for (at, bit) in flips {
            file.0[at % length] ^= 1 << bit;
        }
        for (at, value) in head {
            file.0[at] = value;
        }
        let whole = length;
        let length = cut.map_or(whole, |cut| cut % (whole + 1));
        let bytes = &mut file.0[..length];
        let unchanged = length == whole && bytes == &original.0[..whole];
        prop_assert_eq!(Model::parse(bytes).is_ok(), unchanged);
        if length >= HEADER + 4 {
            bytes[8..12].copy_from_slice(&(length as u32).to_le_bytes());
            seal(bytes);
        }
        if let Ok(model) = Model::parse(bytes) {
            let inputs = vec![1.0; model.shape().inputs()];
            let network: Network = Network::new(model);
            let p = network.classify(&inputs, &mut Activations::new());
            prop_assert!(p.is_ok());
        }
    }
}

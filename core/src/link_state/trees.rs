//! Boosted decision trees: each adds to the logit of one class what the leaf holds that the inputs lead to.
//!
//! ```text
//! f32 inputs --offset, scale, round--> int8 --three comparisons a tree--> leaves --sum a class in i32--> logits --softmax-->
//! ```
//! Inputs are rounded as the networks round theirs, comparisons and sums are integers, and the softmax is the networks'. A tree has three levels: seven
//! nodes, of which it asks three, and eight leaves. Node `n` leads to node `2 n + 1` when its input is at most its threshold, else to `2 n + 2`.
//! Sources: Friedman, "Greedy function approximation: a gradient boosting machine", 2001; docs/link-state.md.
//!
//! The file has the header of the networks' ([`format`](mod@super::format)) with kind 3, the number of levels where these have that of layers, for
//! the temperature the worth of a unit of the leaves, and where these have the outputs of their layers the number of rounds (u16) and of classes (u8). After
//! names and scales follow the trees, class by class in each round, 32 bytes each: input of each node (u8), threshold of each node (i8), leaves
//! (i16), two bytes of padding.

use super::error::ModelError;
use super::format::{CHECKSUM, HEADER, Header, MAGIC, SCALE, TREES, VERSION, names};
use super::model::InputScale;
use super::network::InferenceError;
use super::probability::{CLASSES, Probabilities};
use super::shape::MAX_INPUTS;
use super::write::WriteError;
use crate::numeric::CRC;

/// Levels of a tree.
pub const LEVELS: usize = 3;
/// Nodes of a tree.
pub const NODES: usize = (1 << LEVELS) - 1;
/// Leaves of a tree.
pub const LEAVES: usize = 1 << LEVELS;
/// Most rounds: the sums stay within `i32`.
pub const MAX_ROUNDS: usize = 1 << 15;

/// Bytes of a tree.
const TREE: usize = 32;

/// A tree, as it is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tree {
    /// Input that a node asks.
    pub inputs: [u8; NODES],
    /// What it is compared with.
    pub thresholds: [i8; NODES],
    /// What is added to the logit, in units of the model.
    pub leaves: [i16; LEAVES],
}

impl Tree {
    /// As it lies in a file.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; TREE] {
        let inputs = self.inputs.into_iter();
        let thresholds = self.thresholds.into_iter().map(i8::cast_unsigned);
        let leaves = self.leaves.into_iter().flat_map(i16::to_le_bytes);
        let mut bytes = [0; TREE];
        let all = inputs.chain(thresholds).chain(leaves);
        bytes.iter_mut().zip(all).for_each(|(place, byte)| *place = byte);
        bytes
    }
}

/// Trees in a model file, checked once and then read where they lie.
#[derive(Clone, Copy, Debug)]
pub struct Trees<'m> {
    unit: f32,
    names: &'m str,
    scales: &'m [[u8; SCALE]],
    /// Class by class in each round.
    trees: &'m [[u8; TREE]],
}

impl<'m> Trees<'m> {
    /// Checks a model file and reads its header. Afterwards nothing can fail or overflow but the inputs themselves.
    ///
    /// # Errors
    /// A [`ModelError`].
    pub fn parse(file: &'m [u8]) -> Result<Self, ModelError> {
        let (header, content) = Header::parse(file)?;
        if header.kind != TREES {
            return Err(ModelError::Kind);
        }
        let [low, high, classes, _] = header.outputs;
        let rounds = usize::from(u16::from_le_bytes([low, high]));
        let sizes = usize::from(header.layers) == LEVELS && usize::from(classes) == CLASSES;
        if !sizes || rounds == 0 || rounds > MAX_ROUNDS || header.inputs == 0 || header.inputs > MAX_INPUTS {
            return Err(ModelError::Shape);
        }
        let (names, content) = names(content, header.names, header.inputs)?;
        if !(header.temperature.is_finite() && header.temperature > 0.0) {
            return Err(ModelError::Temperature);
        }
        let (scales, content) = content
            .split_at_checked(SCALE * header.inputs)
            .ok_or(ModelError::Shape)?;
        let scales = scales.as_chunks().0;
        let finite = |scale: &InputScale| scale.offset.is_finite() && scale.steps.is_finite();
        if !scales
            .iter()
            .map(InputScale::from_bytes)
            .all(|scale| finite(&scale))
        {
            return Err(ModelError::InputScale);
        }
        let (trees, rest) = content.as_chunks::<TREE>();
        if trees.len() != rounds * CLASSES || !rest.is_empty() {
            return Err(ModelError::Shape);
        }
        let asks = |tree: &[u8; TREE]| {
            tree.iter()
                .take(NODES)
                .all(|input| usize::from(*input) < header.inputs)
        };
        if !trees.iter().all(asks) {
            return Err(ModelError::Node);
        }
        Ok(Self {
            unit: header.temperature,
            names,
            scales,
            trees,
        })
    }

    /// Names of the inputs, in order.
    pub fn input_names(&self) -> impl Iterator<Item = &'m str> + use<'m> {
        self.names.split(',')
    }

    /// How each input becomes an int8, in order.
    pub fn input_scales(&self) -> impl Iterator<Item = InputScale> + use<'m> {
        self.scales.iter().map(InputScale::from_bytes)
    }

    /// Number of trees.
    #[must_use]
    pub fn trees(&self) -> usize {
        self.trees.len()
    }

    /// Calibrated probabilities of the classes.
    ///
    /// # Errors
    /// [`InferenceError`] for another number of inputs, or one that is not finite.
    pub fn classify(&self, inputs: &[f32]) -> Result<Probabilities, InferenceError> {
        let sums = self.sums(inputs)?;
        Ok(Probabilities::softmax(
            sums.map(|sum| sum as f32 * self.unit),
            1.0,
        ))
    }

    /// Sums of the leaves a class: all that integer arithmetic gives.
    ///
    /// # Errors
    /// As [`Self::classify`].
    pub fn sums(&self, inputs: &[f32]) -> Result<[i32; CLASSES], InferenceError> {
        if inputs.len() != self.scales.len() {
            return Err(InferenceError::Count {
                expected: self.scales.len(),
                found: inputs.len(),
            });
        }
        if let Some(input) = inputs.iter().position(|x| !x.is_finite()) {
            return Err(InferenceError::NotFinite { input });
        }
        let mut rounded = [0_i8; MAX_INPUTS];
        for ((place, x), scale) in rounded.iter_mut().zip(inputs).zip(self.scales) {
            *place = InputScale::from_bytes(scale).int8(*x);
        }
        let mut sums = [0; CLASSES];
        for round in self.trees.as_chunks::<CLASSES>().0 {
            for (sum, tree) in sums.iter_mut().zip(round) {
                *sum += i32::from(leaf(tree, &rounded));
            }
        }
        Ok(sums)
    }
}

/// The leaf that inputs lead to. Both masks change nothing in trees that were checked: they spare the comparisons with the lengths.
fn leaf(tree: &[u8; TREE], inputs: &[i8; MAX_INPUTS]) -> i16 {
    let at = |index: usize| tree.get(index % TREE).copied().unwrap_or(0);
    let mut node = 0;
    for _ in 0..LEVELS {
        let input = inputs
            .get(usize::from(at(node)) % MAX_INPUTS)
            .copied()
            .unwrap_or(0);
        node = 2 * node + 1 + usize::from(input > at(NODES + node).cast_signed());
    }
    // Behind the nodes' inputs and thresholds; the first leaf is number NODES in the order of the nodes.
    let first = 2 * node;
    i16::from_le_bytes([first, first + 1].map(at))
}

/// Trees to be written.
#[derive(Clone, Copy, Debug)]
pub struct TreesDescription<'a> {
    /// What a unit of the leaves adds to a logit, positive.
    pub unit: f32,
    /// Names of the inputs, separated by commas.
    pub names: &'a str,
    /// Offset and steps of each input.
    pub inputs: &'a [InputScale],
    /// Class by class in each round.
    pub trees: &'a [Tree],
}

impl TreesDescription<'_> {
    /// Bytes of its file.
    #[must_use]
    pub fn length(&self) -> usize {
        HEADER
            + self.names.len().next_multiple_of(4)
            + SCALE * self.inputs.len()
            + TREE * self.trees.len()
            + CHECKSUM
    }

    /// Writes the file to the start of `out`; gives its length.
    ///
    /// # Errors
    /// [`WriteError::Buffer`] when there is no room, [`WriteError::Model`] for what the reader would refuse.
    pub fn write(&self, out: &mut [u8]) -> Result<usize, WriteError> {
        let needed = self.length();
        let file = out.get_mut(..needed).ok_or(WriteError::Buffer { needed })?;
        let (body, checksum) = file.split_last_chunk_mut::<CHECKSUM>().ok_or(WriteError::Parts)?;
        let [low, high] = ((self.trees.len() / CLASSES) as u16).to_le_bytes();
        let head = MAGIC
            .into_iter()
            .chain(VERSION.to_le_bytes())
            .chain([TREES, LEVELS as u8])
            .chain((needed as u32).to_le_bytes())
            .chain((self.inputs.len() as u16).to_le_bytes())
            .chain((self.names.len() as u16).to_le_bytes())
            .chain(self.unit.to_le_bytes())
            .chain([low, high, CLASSES as u8, 0]);
        let padding = self.names.len().next_multiple_of(4) - self.names.len();
        let names = self.names.bytes().chain(core::iter::repeat_n(0, padding));
        let scales = self.inputs.iter().flat_map(|scale| {
            let [offset, steps] = [scale.offset, scale.steps].map(f32::to_le_bytes);
            offset.into_iter().chain(steps)
        });
        let trees = self.trees.iter().flat_map(Tree::to_bytes);
        let bytes = head.chain(names).chain(scales).chain(trees);
        body.iter_mut().zip(bytes).for_each(|(place, byte)| *place = byte);
        *checksum = CRC.checksum(body).to_le_bytes();
        Trees::parse(file).map(|_| needed).map_err(WriteError::Model)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::vec;
    use std::vec::Vec;

    use super::*;
    use crate::link_state::Model;

    /// Two rounds: the first asks input 1 and then input 0, the second asks nothing.
    fn file(change: impl Fn(&mut [Tree])) -> Vec<u8> {
        let asks = |class: i16| Tree {
            inputs: [1, 0, 0, 0, 0, 0, 0],
            thresholds: [10, -5, 100, i8::MAX, i8::MAX, i8::MAX, i8::MAX],
            leaves: [1, -1, 2, -1, 3, -1, 4, -1].map(|leaf| leaf * (class + 1)),
        };
        let nothing = |class: i16| Tree {
            thresholds: [i8::MAX; NODES],
            leaves: [1000 * class, 0, 0, 0, 0, 0, 0, 0],
            ..Tree::default()
        };
        let mut trees: Vec<Tree> = (0..4).map(asks).chain((0..4).map(nothing)).collect();
        change(&mut trees);
        let inputs = [(0.0, 100.0), (2.0, 10.0)].map(|(offset, steps)| InputScale { offset, steps });
        let description = TreesDescription {
            unit: 0.001,
            names: "a,b",
            inputs: &inputs,
            trees: &trees,
        };
        let mut file = vec![0; description.length()];
        description.write(&mut file).expect("sound");
        file
    }

    #[test]
    fn three_comparisons_lead_to_a_leaf() {
        let file = file(|_| ());
        let trees = Trees::parse(&file).expect("sound");
        assert_eq!(trees.trees(), 8);
        assert!(trees.input_names().eq(["a", "b"]));
        // b is 10 at 3.0: not above. a is -5 at -.05, -4 at -.04.
        for ([a, b], leaf) in [
            ([-0.05, 3.0], 1),
            ([-0.04, 3.0], 2),
            ([1.0, 3.1], 3),
            ([1.01, 3.1], 4),
            ([9e9, 9e9], 4),
            ([-9e9, -9e9], 1),
        ] {
            let expected = [0, 1, 2, 3].map(|class| leaf * (class + 1) + 1000 * class);
            assert_eq!(trees.sums(&[a, b]), Ok(expected), "{a} {b}");
        }
        let p = trees.classify(&[-0.05, 3.0]).expect("numbers");
        let expected = Probabilities::softmax([0.001, 1.002, 2.003, 3.004], 1.0);
        assert!((p.artefact - expected.artefact).abs() < 1e-6 && (p.los - expected.los).abs() < 1e-6);
    }

    #[test]
    fn what_is_no_input_is_refused() {
        let file = file(|_| ());
        let trees = Trees::parse(&file).expect("sound");
        let count = InferenceError::Count {
            expected: 2,
            found: 1,
        };
        assert_eq!(trees.sums(&[1.0]), Err(count));
        assert_eq!(
            trees.sums(&[1.0, f32::NAN]),
            Err(InferenceError::NotFinite { input: 1 })
        );
    }

    #[test]
    fn what_is_no_file_of_trees_is_refused() {
        let good = file(|_| ());
        let sealed = |change: &dyn Fn(&mut Vec<u8>)| {
            let mut bad = good.clone();
            bad.truncate(good.len() - CHECKSUM);
            change(&mut bad);
            let length = (bad.len() + CHECKSUM) as u32;
            bad[8..12].copy_from_slice(&length.to_le_bytes());
            bad.extend(CRC.checksum(&bad).to_le_bytes());
            Trees::parse(&bad).map(|_| ()).expect_err("damaged")
        };
        let first_tree = good.len() - CHECKSUM - 8 * TREE;
        assert_eq!(sealed(&|file| file[6] = 2), ModelError::Kind);
        assert_eq!(sealed(&|file| file[7] = 4), ModelError::Shape);
        assert_eq!(sealed(&|file| file[20] = 3), ModelError::Shape);
        assert_eq!(sealed(&|file| file[22] = 3), ModelError::Shape);
        assert_eq!(sealed(&|file| file[12] = 65), ModelError::Shape);
        assert_eq!(sealed(&|file| file.truncate(first_tree)), ModelError::Shape);
        assert_eq!(sealed(&|file| file.push(0)), ModelError::Shape);
        assert_eq!(sealed(&|file| file[24] = b','), ModelError::Names);
        assert_eq!(sealed(&|file| file[16..20].fill(0)), ModelError::Temperature);
        assert_eq!(sealed(&|file| file[28..32].fill(0xff)), ModelError::InputScale);
        assert_eq!(sealed(&|file| file[first_tree + 6] = 2), ModelError::Node);
        let mut bad = good.clone();
        bad[40] ^= 1;
        assert_eq!(Trees::parse(&bad).expect_err("flipped"), ModelError::Checksum);
        for length in 0..good.len() {
            assert!(Trees::parse(&good[..length]).is_err(), "{length}");
        }
        let aligned: Vec<u32> = good
            .as_chunks::<4>()
            .0
            .iter()
            .map(|word| u32::from_le_bytes(*word))
            .collect();
        let bytes: Vec<u8> = aligned.iter().flat_map(|word| word.to_le_bytes()).collect();
        assert!(Model::parse(&bytes).is_err(), "no network");
    }

    #[test]
    fn what_the_reader_refuses_is_not_written() {
        let inputs = [InputScale {
            offset: 0.0,
            steps: 1.0,
        }];
        let description = TreesDescription {
            unit: 1.0,
            names: "a",
            inputs: &inputs,
            trees: &[Tree::default(); 5],
        };
        let mut room = [0; 512];
        assert_eq!(
            description.write(&mut room),
            Err(WriteError::Model(ModelError::Shape))
        );
        let needed = description.length();
        assert_eq!(
            description.write(&mut room[..needed - 1]),
            Err(WriteError::Buffer { needed })
        );
    }
}

//! What a network looks like: its inputs, the width of its layers, and what joins what.

/// Most inputs of a network: three for each of 15 paths need 45.
pub const MAX_INPUTS: usize = 64;
/// Most inputs or outputs of a layer, padding included.
pub const MAX_WIDTH: usize = 128;
/// Most layers.
pub const MAX_LAYERS: usize = 4;
/// Outputs of the last layer: line of sight, first order, higher order.
pub const STATES: usize = 3;
/// Most paths of the paper's network.
const MAX_PATHS: usize = 15;

/// What a network takes and tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Kind {
    /// The paper's network: delay, zenith and azimuth of the K strongest paths of a link, state of the link. The first
    /// layer sees the strongest path, the second its outputs and the other paths.
    Paper,
    /// Geometric features of one path, state of that path: a chain of dense layers.
    Geometric,
}

/// Topology of a network. Made by [`Shape::new`], which checks it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Shape {
    kind: Kind,
    inputs: u8,
    layers: u8,
    outputs: [u8; MAX_LAYERS],
}

impl Shape {
    /// A network of `kind` with so many inputs and these outputs of its layers, the last of them [`STATES`].
    ///
    /// `None` for more inputs, layers or outputs than [`MAX_INPUTS`], [`MAX_LAYERS`], [`MAX_WIDTH`], for none, and for a
    /// paper network whose inputs are not 3 K with K = 1..=15 or that has fewer than two layers.
    pub fn new(kind: Kind, inputs: usize, outputs: &[usize]) -> Option<Self> {
        let mut widths = [0; MAX_LAYERS];
        for (index, &width) in outputs.iter().enumerate() {
            if width == 0 || width > MAX_WIDTH {
                return None;
            }
            *widths.get_mut(index)? = u8::try_from(width).ok()?;
        }
        let shape = Self {
            kind,
            inputs: u8::try_from(inputs).ok()?,
            layers: outputs.len() as u8,
            outputs: widths,
        };
        let sound = match kind {
            Kind::Paper => inputs.is_multiple_of(3) && inputs <= 3 * MAX_PATHS && outputs.len() >= 2,
            Kind::Geometric => inputs <= MAX_INPUTS,
        };
        let fits = (0..outputs.len()).all(|layer| 4 * shape.quads(layer) <= MAX_WIDTH);
        (sound && fits && inputs > 0 && outputs.last() == Some(&STATES)).then_some(shape)
    }

    /// What it takes.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        usize::from(self.inputs)
    }

    /// Number of layers.
    pub fn layers(&self) -> usize {
        usize::from(self.layers)
    }

    /// Outputs of a layer, padding excluded; 0 for a layer that does not exist.
    pub fn outputs(&self, layer: usize) -> usize {
        self.outputs.get(layer).copied().map_or(0, usize::from)
    }

    /// Inputs that the first layer sees; the others join its outputs.
    pub fn head(&self) -> usize {
        match self.kind {
            Kind::Paper => 3,
            Kind::Geometric => self.inputs(),
        }
    }

    /// Columns of a layer's weights, padding excluded. Those of the second layer are the outputs of the first, then the
    /// inputs that the first did not see.
    pub fn columns(&self, layer: usize) -> usize {
        match layer {
            0 => self.head(),
            1 => self.outputs(0) + self.inputs().saturating_sub(self.head()),
            _ => self.outputs(layer - 1),
        }
    }

    /// Place of a column of a layer among its padded inputs.
    pub(crate) fn place(&self, layer: usize, column: usize) -> usize {
        let joined = column.checked_sub(self.outputs(0)).filter(|_| layer == 1);
        joined.map_or(column, |rest| 4 * self.outputs(0).div_ceil(4) + rest)
    }

    /// Quads of inputs of a layer.
    pub(crate) fn quads(&self, layer: usize) -> usize {
        match layer {
            0 => self.head().div_ceil(4),
            1 => self.outputs(0).div_ceil(4) + self.inputs().saturating_sub(self.head()).div_ceil(4),
            _ => self.outputs(layer - 1).div_ceil(4),
        }
    }

    /// Groups of four rows of a layer.
    pub(crate) fn groups(&self, layer: usize) -> usize {
        self.outputs(layer).div_ceil(4)
    }

    /// Multiplications of an inference, padding excluded.
    pub fn macs(&self) -> usize {
        (0..self.layers())
            .map(|layer| self.columns(layer) * self.outputs(layer))
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_network_joins_the_other_paths_after_the_first_layer() {
        let shape = Shape::new(Kind::Paper, 27, &[10, 50, 100, 3]).expect("sound");
        assert_eq!(
            (0..4).map(|l| shape.columns(l)).collect::<std::vec::Vec<_>>(),
            [3, 34, 50, 100]
        );
        assert_eq!(
            (0..4).map(|l| shape.quads(l)).collect::<std::vec::Vec<_>>(),
            [1, 9, 13, 25]
        );
        assert_eq!(shape.macs(), 7030);
        // Ten outputs and two places of padding, then the fourth input.
        assert_eq!(
            (shape.place(1, 9), shape.place(1, 10), shape.place(1, 33)),
            (9, 12, 35)
        );
        assert_eq!((shape.place(0, 2), shape.place(2, 20)), (2, 20));
        let single = Shape::new(Kind::Paper, 3, &[10, 50, 100, 3]).expect("one path");
        assert_eq!((single.columns(1), single.quads(1)), (10, 3));
    }

    #[test]
    fn shapes_out_of_bounds_are_refused() {
        let geometric = |inputs, outputs: &[usize]| Shape::new(Kind::Geometric, inputs, outputs);
        assert!(geometric(11, &[64, 64, 3]).is_some_and(|s| s.macs() == 4992 && s.head() == 11));
        assert!(geometric(64, &[128, 3]).is_some());
        assert!(geometric(5, &[3]).is_some());
        assert_eq!(geometric(65, &[64, 3]), None);
        assert_eq!(geometric(300, &[64, 3]), None);
        assert_eq!(geometric(0, &[64, 3]), None);
        assert_eq!(geometric(9, &[129, 3]), None);
        assert_eq!(geometric(9, &[0, 3]), None);
        assert_eq!(geometric(9, &[64, 4]), None);
        assert_eq!(geometric(9, &[]), None);
        assert_eq!(geometric(9, &[8, 8, 8, 8, 3]), None);
        let paper = |inputs, outputs: &[usize]| Shape::new(Kind::Paper, inputs, outputs);
        assert_eq!(paper(28, &[10, 3]), None);
        assert_eq!(paper(48, &[10, 3]), None);
        assert_eq!(paper(27, &[3]), None);
        assert_eq!(paper(45, &[100, 3]), None, "100 outputs and 42 inputs make 144");
    }

    extern crate std;
}

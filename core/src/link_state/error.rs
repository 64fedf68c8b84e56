//! Why a model file could not be used.

use core::fmt;

use super::layout::{ALIGNMENT, HEADER, MAX_BIAS, VERSION};

/// A model file that is damaged, of another version, or not one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ModelError {
    /// The first byte lies at an address that is no multiple of [`ALIGNMENT`].
    Misaligned,
    /// There are fewer bytes than a header has.
    TooShort,
    /// It does not begin as a model file does.
    Magic,
    /// It is of another version of the layout.
    Version {
        /// The file's.
        found: u16,
    },
    /// The length that it states is not the number of bytes.
    Length {
        /// What it states.
        stated: u32,
        /// Bytes there are.
        found: usize,
    },
    /// The checksum does not match.
    Checksum,
    /// It is of no known kind.
    Kind,
    /// Inputs or layers are out of bounds, do not fit the kind, or do not add up to the length.
    Shape,
    /// The names are no ASCII list of as many names as there are inputs.
    Names,
    /// The temperature is not a positive number.
    Temperature,
    /// Offset or steps of an input are not finite.
    InputScale,
    /// A weight lies outside -127..=127.
    Weight,
    /// A bias lies outside +-[`MAX_BIAS`].
    Bias,
    /// A multiplier is negative, or a scale of the last layer not finite.
    Multiplier,
    /// A node of a tree asks an input that there is not.
    Node,
    /// It takes other inputs than the paths have that it is for.
    Inputs,
}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Misaligned => write!(f, "the model does not start at a multiple of {ALIGNMENT} bytes"),
            Self::TooShort => write!(f, "the model is shorter than its header of {HEADER} bytes"),
            Self::Magic => f.write_str("not a model file: it does not begin with LSCN"),
            Self::Version { found } => write!(f, "the model is of version {found}, expected {VERSION}"),
            Self::Length { stated, found } => {
                write!(
                    f,
                    "the model states a length of {stated} bytes, there are {found}"
                )
            }
            Self::Checksum => f.write_str("the checksum of the model does not match"),
            Self::Kind => f.write_str("the model is of no known kind"),
            Self::Shape => f.write_str("inputs or layers of the model are out of bounds"),
            Self::Names => f.write_str("the names of the model's inputs do not match their number"),
            Self::Temperature => f.write_str("the model's temperature is not a positive number"),
            Self::InputScale => f.write_str("the scale of an input of the model is not finite"),
            Self::Weight => f.write_str("a weight of the model lies outside -127..127"),
            Self::Bias => write!(f, "a bias of the model lies outside +-{MAX_BIAS}"),
            Self::Inputs => f.write_str("the model takes other inputs than it is to be given"),
            Self::Node => f.write_str("a node of the model asks an input that there is not"),
            Self::Multiplier => f.write_str("a multiplier of the model is negative or not finite"),
        }
    }
}

impl core::error::Error for ModelError {}

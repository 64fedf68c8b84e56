//! Why there is no bearing.

use core::fmt;

/// Why there is no bearing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Refusal {
    /// The link state is not line of sight: the pattern would point at a reflector.
    NotLineOfSight,
    /// The sighting's delay is not finite.
    NotFinite,
    /// The interferers come from where the line of sight comes from: nothing is left beside their nulls.
    Masked,
    /// No sighting was given.
    NotBegun,
    /// The symbols that were heard do not sweep both axes.
    SymbolsMissing,
    /// Nothing stands out of the noise.
    TooWeak,
    /// No peak that a parabola fits.
    NoPeak,
    /// Two directions explain what was heard about equally well.
    Ambiguous,
    /// The fit did not settle, or left the half space before the face or the place where it was told to look.
    Unsettled,
}

impl Refusal {
    /// Every reason.
    pub const ALL: [Self; 9] = [
        Self::NotLineOfSight,
        Self::NotFinite,
        Self::Masked,
        Self::NotBegun,
        Self::SymbolsMissing,
        Self::TooWeak,
        Self::NoPeak,
        Self::Ambiguous,
        Self::Unsettled,
    ];
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotLineOfSight => "the link is not line of sight",
            Self::NotFinite => "the delay of the line of sight is not finite",
            Self::Masked => "the line of sight cannot be told from an interferer",
            Self::NotBegun => "no line of sight was given",
            Self::SymbolsMissing => "the symbols that were heard do not sweep both axes",
            Self::TooWeak => "the symbols do not stand out of the noise",
            Self::NoPeak => "the power over subcarriers has no peak",
            Self::Ambiguous => "two directions explain the symbols equally well",
            Self::Unsettled => "the fit found no place where it should look",
        })
    }
}

impl core::error::Error for Refusal {}

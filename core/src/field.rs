//! What a number of a configuration may be, and which one is not.
//!
//! Every configuration has a `check`, which names the first of its fields that nothing could be reckoned with:
//!
//! ```
//! use cslam_core::estimator::FilterConfig;
//!
//! let mut config = FilterConfig::default();
//! config.radio.two_way_m = -0.1;
//! let error = config.check().expect_err("a standard deviation below zero");
//! assert_eq!(error.field, "radio.two_way_m");
//! assert_eq!(error.wrong.to_string(), "is -0.1, expected a number above 0");
//! ```

use core::fmt;

/// Most that a share or a probability may be.
pub const MOST_SHARE: f64 = 0.9999;

/// What a number may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Range {
    /// Finite and above 0.
    AboveZero,
    /// From the first to the second.
    Within(f64, f64),
}

impl Range {
    fn holds(self, value: f64) -> bool {
        match self {
            Self::AboveZero => value.is_finite() && value > 0.0,
            // In single precision, which most numbers are of.
            Self::Within(least, most) => (least as f32..=most as f32).contains(&(value as f32)),
        }
    }
}

/// What is wrong with a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrong {
    /// As it is.
    pub value: f64,
    /// As it may be.
    pub range: Range,
}

impl fmt::Display for Wrong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Most numbers are of single precision, and all are told apart in it.
        let value = self.value as f32;
        match self.range {
            Range::AboveZero => write!(f, "is {value}, expected a number above 0"),
            Range::Within(least, most) => write!(f, "is {value}, expected {least} to {most}"),
        }
    }
}

/// A field of a configuration that cannot be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldError {
    /// The configuration within the one that was checked, where it is not that itself.
    pub table: Option<&'static str>,
    /// Name of the field, with those that lead to it.
    pub field: &'static str,
    /// What is wrong with it.
    pub wrong: Wrong,
}

impl FieldError {
    /// The same, of a configuration that holds this one under a name.
    #[must_use]
    pub fn under(self, table: &'static str) -> Self {
        Self {
            table: Some(table),
            ..self
        }
    }
}

impl fmt::Display for FieldError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(table) = self.table {
            write!(f, "{table}.")?;
        }
        write!(f, "{} {}", self.field, self.wrong)
    }
}

impl core::error::Error for FieldError {}

/// The first of these numbers that is not in this range.
pub(crate) fn all_in(range: Range, numbers: &[(&'static str, f64)]) -> Result<(), FieldError> {
    let wrong = numbers.iter().find(|(_, value)| !range.holds(*value));
    wrong.map_or(Ok(()), |(field, value)| {
        Err(FieldError {
            table: None,
            field,
            wrong: Wrong { value: *value, range },
        })
    })
}

/// A number of single precision as it is compared.
pub(crate) fn wide((field, value): (&'static str, f32)) -> (&'static str, f64) {
    (field, f64::from(value))
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;

    #[test]
    fn the_first_number_that_cannot_be_is_named() {
        let above = |value| all_in(Range::AboveZero, &[("a", 1.0), ("b_m", value)]);
        assert!(above(0.5).is_ok());
        for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(above(value).expect_err("not above zero").field, "b_m");
        }
        let error = all_in(Range::Within(0.5, MOST_SHARE), &[("share", 1.0)]).expect_err("too much");
        assert_eq!(error.to_string(), "share is 1, expected 0.5 to 0.9999");
        assert_eq!(
            error.under("surfaces").to_string(),
            "surfaces.share is 1, expected 0.5 to 0.9999"
        );
        assert!(all_in(Range::Within(0.0, 1.0), &[("share", f64::NAN)]).is_err());
    }
}

//! Figures against the ranges that they may have.

use std::fmt::Display;

use super::InputError;

/// A key with its value and the least and greatest one that it may have.
type Range<'k, T> = (&'k str, T, T, T);

/// Checks values against their ranges; what is no number is in none.
///
/// # Errors
/// [`InputError`] naming the key of the first value that is out of its range.
pub fn within<T: PartialOrd + Display>(ranges: &[Range<'_, T>]) -> Result<(), InputError> {
    match ranges
        .iter()
        .find(|(_, value, low, high)| !(low..=high).contains(&value))
    {
        None => Ok(()),
        Some((key, value, low, high)) => {
            let message = format!("is {value}, expected {low} to {high}");
            Err(InputError::at_key(*key, message))
        }
    }
}

/// Checks that values are finite and above zero.
///
/// # Errors
/// [`InputError`] naming the key of the first value that is not.
pub fn above_zero(figures: &[(&str, f64)]) -> Result<(), InputError> {
    match figures
        .iter()
        .find(|(_, value)| !(value.is_finite() && *value > 0.0))
    {
        Some((key, value)) => Err(InputError::at_key(
            *key,
            format!("is {value}, expected a number above 0"),
        )),
        None => Ok(()),
    }
}

//! Lines of a text, for messages.

/// Number of the line that holds a byte, from 1.
pub(super) fn line_at(text: &[u8], byte: usize) -> usize {
    1 + text.iter().take(byte).filter(|b| **b == b'\n').count()
}

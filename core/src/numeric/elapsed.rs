//! The time between two stamps of a clock.

/// Time from one stamp to another, s; negative when the other is the earlier one.
pub(crate) fn elapsed_s(from_ns: u64, to_ns: u64) -> f64 {
    let apart_s = to_ns.abs_diff(from_ns) as f64 * 1e-9;
    if to_ns >= from_ns { apart_s } else { -apart_s }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_has_the_sign_of_the_order() {
        assert_eq!(elapsed_s(1_000_000_000, 3_500_000_000), 2.5);
        assert_eq!(elapsed_s(3_500_000_000, 1_000_000_000), -2.5);
        assert_eq!(elapsed_s(7, 7), 0.0);
    }
}

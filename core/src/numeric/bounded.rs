//! Filling what is bounded.

use heapless::Vec;

/// As many items as there is room for. `collect` would panic at one more, and the compiler does not see that there is none.
pub(crate) fn gather<T, const N: usize>(items: impl Iterator<Item = T>) -> Vec<T, N> {
    let mut gathered = Vec::new();
    for item in items {
        if gathered.push(item).is_err() {
            break;
        }
    }
    gathered
}

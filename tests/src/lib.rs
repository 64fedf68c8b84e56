//! Cross-crate tests are in `tests/`, the verify driver (`cargo verify`) in `src/bin/verify`.

//! Cross-crate tests live in `tests/`, the verify driver in `src/bin/verify.rs`.

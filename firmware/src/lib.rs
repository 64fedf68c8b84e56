//! Binds the receiver to a chip.
#![no_std]

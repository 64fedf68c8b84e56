//! The library's self-test on a Cortex-M4F (MPS2+ with the AN386 image), as QEMU emulates it.
#![no_std]
#![no_main]

mod check;

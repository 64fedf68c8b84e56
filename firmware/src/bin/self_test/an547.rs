//! The library's self-test on a Cortex-M55 (MPS3 with the AN547 image), as QEMU emulates it.
#![no_std]
#![no_main]

mod check;

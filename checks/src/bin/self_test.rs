//! The self-test for processors beside the Cortex-M7: a Cortex-M4F (MPS2+ with the AN386 image) and a Cortex-M55 (MPS3 with the AN547
//! image), as QEMU emulates them. Nothing of the board is used but its memory.
//!
//! First a line `kernels` with those that the target runs, of path estimation and of the networks. Then one line a block of
//! samples, `block index digest clips unexamined exponent`, through the front end of path estimation, and one line a link,
//! `link index digest`, through the networks of the link state. They must be the host's lines. Exit code 0.
#![no_std]
#![no_main]

use core::panic::PanicInfo;

use cortex_m_rt::entry;
use cslam_checks::front_end::{self, BLOCKS};
use cslam_checks::link_state::{LINKS, Link, Networks};
use cslam_core::kernels::{Native, Native as NativeLayers};
use cslam_core::link_state::Activations;
use cslam_core::profile::Samples;
use cslam_core::profile::quad_4x8_gmt_72::CHANNELS;
use cslam_core::signal::{Correlator, Iq, SAMPLES, Waveform, Workspace};
use defmt_semihosting as _;
use semihosting::process::exit;

#[entry]
fn main() -> ! {
    let buffers =
        cortex_m::singleton!(: (Samples, Workspace) = ([[Iq::ZERO; SAMPLES]; CHANNELS], Workspace::new()));
    let Some((block, work)) = buffers else { exit(101) };
    defmt::println!(
        "kernels {=str} {=str}",
        name_of::<Native>(),
        name_of::<NativeLayers>()
    );
    let correlator = Correlator::<Native>::new(&Waveform::default());
    for index in 0..BLOCKS {
        let outcome = front_end::run(&correlator, block, index, work);
        defmt::println!("block {=u32} {}", index, defmt::Display2Format(&outcome));
    }
    let Ok(networks) = Networks::<NativeLayers>::shipped() else {
        defmt::error!("the models in flash are damaged");
        exit(1)
    };
    let mut activations = Activations::new();
    for index in 0..LINKS {
        let digest = Link::random(index)
            .ok()
            .and_then(|link| networks.digest(&link, &mut activations).ok());
        defmt::println!("link {=u32} {=u64:016x}", index, digest.unwrap_or(0));
    }
    exit(0)
}

/// Name of a type without its path.
fn name_of<T>() -> &'static str {
    core::any::type_name::<T>()
        .rsplit("::")
        .next()
        .unwrap_or_default()
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    defmt::error!("{}", defmt::Display2Format(info));
    exit(101)
}

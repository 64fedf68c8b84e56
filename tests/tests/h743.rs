//! The image for an STM32H743: it links, fits the budgets of the design, and lies where memory.x says. Run by `cargo verify`, stage
//! `h743`.

use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

use cslam_tests::cost::{counts, rises};
use cslam_tests::elf::{Section, code, frame, sections};
use cslam_tests::root;

/// Bytes that the design allows (docs/signal-model.md, "Error budget"). Flash: the slot of the active image, 640 KiB, behind 256 KiB of a
/// bootloader and its state; the second MiB has an update of that size plus a sector, and the settings.
const FLASH: u32 = 640 * 1024;
const STATIC: u32 = 400 * 1024;

/// Sections of the image.
fn image() -> &'static [Section] {
    static SECTIONS: OnceLock<Vec<Section>> = OnceLock::new();
    SECTIONS.get_or_init(|| sections(file()).expect("an ELF file"))
}

/// Builds the image, once for all tests.
fn file() -> &'static [u8] {
    static FILE: OnceLock<Vec<u8>> = OnceLock::new();
    FILE.get_or_init(|| {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let output = Command::new(cargo)
            .current_dir(root())
            .args(["build", "-q", "--locked", "--profile=board"])
            .args(["--target=thumbv7em-none-eabihf", "--package=cslam-firmware"])
            .args([
                "--features=stm32h743",
                "--bin=cslam-h743",
                "--message-format=json",
            ])
            .env_remove("RUSTFLAGS")
            .env_remove("CARGO_ENCODED_RUSTFLAGS")
            .output()
            .expect("cargo starts");
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(
            output.status.success(),
            "{text}{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let path: PathBuf = text
            .split('"')
            .find(|part| part.ends_with("/cslam-h743"))
            .expect("cargo names the image")
            .into();
        std::fs::read(path).expect("the image")
    })
}

/// Bytes within a range of addresses; of flash, what is loaded.
fn within(range: std::ops::Range<u32>) -> u32 {
    let inside = |section: &&Section| range.contains(&section.address);
    image().iter().filter(inside).map(|section| section.length).sum()
}

fn flash() -> u32 {
    image()
        .iter()
        .filter(|section| section.is_loaded)
        .map(|section| section.length)
        .sum()
}

fn table() -> String {
    let length = |name: &str| {
        let named = image().iter().filter(|section| section.name == name);
        named.map(|section| section.length).sum::<u32>()
    };
    format!(
        "flash, all: {}\nflash, code: {}\nflash, constants: {}\nAXI SRAM, static data: {}\nSRAM1 and SRAM2, frames: {}\nSRAM3, other DMAs: {}\nDTCM, fault record: {}\n",
        flash(),
        length(".text"),
        length(".rodata"),
        within(0x2400_0000..0x2408_0000),
        within(0x3000_0000..0x3004_0000),
        within(0x3004_0000..0x3004_8000),
        within(0x2000_0000..0x2002_0000),
    )
}

#[test]
fn it_is_within_the_budgets() {
    assert!(
        flash() <= FLASH,
        "{} bytes of flash, {FLASH} are allowed",
        flash()
    );
    let data = within(0x2400_0000..0x2408_0000);
    assert!(
        (1..=STATIC).contains(&data),
        "{data} bytes of static data, {STATIC} are allowed"
    );
}

#[test]
fn it_takes_no_more_than_committed() {
    let measured = table();
    println!("{measured}");
    let committed = std::fs::read_to_string(root().join("tests/golden/h743_size.txt")).expect("the table");
    let rises = rises(&counts(&committed), &counts(&measured));
    assert!(rises.is_empty(), "{}", rises.join("\n"));
}

/// `main` never ends, so whatever it has on the stack while it builds the receiver would stay there in flight.
#[test]
fn main_leaves_the_stack_to_the_flight() {
    let main = code(file(), "__cortex_m_rt_main").expect("the image has a main");
    let bytes = frame(main);
    println!("main's frame: {bytes} bytes");
    assert!(
        (1..=4096).contains(&bytes),
        "{bytes} bytes of stack are held by main"
    );
}

#[test]
fn everything_lies_where_it_belongs() {
    let of = |name: &str| {
        let section = image().iter().find(|section| section.name == name);
        section.unwrap_or_else(|| panic!("no section {name}")).clone()
    };
    assert_eq!(of(".vector_table").address, 0x0800_0000);
    // Bank 2 is erased while the receiver flies: nothing that it needs may be there.
    let banks = [0x0800_0000..0x0810_0000, 0x0810_0000..0x0820_0000].map(within);
    assert!(banks[0] > 0 && banks[1] == 0, "bytes in banks: {banks:?}");
    assert_eq!(of(".fault").address, 0x2001_ffe0);
    let frames = of(".sram12");
    // Three frames, each on a cache line.
    assert_eq!((frames.address, frames.length), (0x3000_0000, 3 * 65_600));
    assert_eq!(of(".sram3").address, 0x3004_0000);
    // What is not cached (memory.rs) must lie in one region of 32 KiB, and nothing else may be loaded there.
    assert!(!of(".sram3").is_loaded && !frames.is_loaded && !of(".fault").is_loaded);
    assert!(of(".bss").address >= 0x2400_0000);
}

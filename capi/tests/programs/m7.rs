//! C on the emulated Cortex-M7: the same programs print the same characters.

use std::path::Path;
use std::process::{Command, Stdio};

use crate::recording::Recorded;
use crate::{ROOT, assert_success, built_for_a_chip, printed, rust_example};

/// The processor: double precision in hardware, arguments in its registers.
const PROCESSOR: [&str; 4] = ["-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard"];

/// Compiles an example for the emulated board, with newlib and semihosting.
fn compiled(example: &str, library: &Path, to: &Path) {
    let mut command = Command::new("arm-none-eabi-gcc");
    command
        .current_dir(Path::new(ROOT).join("capi"))
        .args(PROCESSOR)
        .args([
            "-std=c11",
            "-O2",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-D_GNU_SOURCE",
            "-Iinclude",
        ])
        .args([&format!("examples/{example}.c"), "examples/m7/startup.c"])
        .arg(library)
        .args([
            "--specs=rdimon.specs",
            "-nostartfiles",
            "-Texamples/m7/mps2-an500.ld",
            "-lm",
            "-Wl,--gc-sections",
        ])
        .arg("-o")
        .arg(to);
    let output = command.output().expect("arm-none-eabi-gcc");
    assert_success(&command, &output);
}

/// What a program prints on the emulated board.
fn emulated(program: &Path, words: &[&str]) -> String {
    let arguments: String = words.iter().map(|word| format!(",arg={word}")).collect();
    let console = format!("enable=on,target=native,chardev=console{arguments}");
    let mut command = Command::new("timeout");
    command
        .args([
            "120",
            "qemu-system-arm",
            "-machine",
            "mps2-an500",
            "-display",
            "none",
            "-monitor",
            "none",
        ])
        .args([
            "-serial",
            "none",
            "-chardev",
            "stdio,id=console",
            "-semihosting-config",
            &console,
            "-kernel",
        ])
        .arg(program)
        .stdin(Stdio::null());
    printed(&mut command)
}

#[test]
#[ignore = "needs arm-none-eabi-gcc and QEMU: the stage capi-chip runs it"]
fn chip_prints_what_rust_and_the_command_print() {
    let library = built_for_a_chip();
    let folder = tempfile::tempdir().expect("a folder");
    let program = folder.path().join("program.elf");
    compiled("solve", &library, &program);
    assert_eq!(emulated(&program, &["solve"]), rust_example("solve", &[]));
    compiled("estimate", &library, &program);
    let recorded = Recorded::new();
    let meta = recorded.meta().to_str().expect("a name");
    assert_eq!(emulated(&program, &["estimate", meta]), recorded.by_the_command());
}

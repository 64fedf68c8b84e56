//! The table of stages: what is checked, in which order, by which command. Long: one table.

use crate::command::{Expect, Program, Step};
use crate::setup;

/// A stage.
pub(crate) struct Stage {
    pub(crate) name: &'static str,
    /// What it does, for people.
    pub(crate) what: &'static str,
    /// Stages without which it cannot run. When one of them is not asked for, it is taken to be in order.
    pub(crate) needs: &'static [&'static str],
    pub(crate) lane: Lane,
    pub(crate) work: Work,
}

/// What runs beside what: a lane has one stage at a time, and the two have their own folders of builds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Lane {
    /// Builds of the profiles dev and test.
    Unoptimised,
    /// Set-up, and builds of the other profiles.
    Optimised,
}

/// What a stage does.
pub(crate) enum Work {
    SetUp(fn() -> Result<(), String>),
    Steps(&'static [Step]),
}

const fn step(arguments: &'static [&'static str]) -> Step {
    Step {
        program: Program::Cargo,
        arguments,
        expect: Expect::Success,
    }
}

/// A command of `cslam`, or of another binary of the stage `release`.
const fn built(binary: &'static str, arguments: &'static [&'static str]) -> Step {
    Step {
        program: Program::Release(binary),
        arguments,
        expect: Expect::Success,
    }
}

const fn oldest(arguments: &'static [&'static str]) -> Step {
    Step {
        program: Program::OldestCargo,
        arguments,
        expect: Expect::Success,
    }
}

const fn docs(arguments: &'static [&'static str]) -> Step {
    Step {
        program: Program::Cargo,
        arguments,
        expect: Expect::CleanDocs,
    }
}

const fn refused(arguments: &'static [&'static str], reason: &'static str) -> Step {
    Step {
        program: Program::Cargo,
        arguments,
        expect: Expect::Refusal(reason),
    }
}

const THUMB: &str = "--target=thumbv7em-none-eabihf";
/// Features of the tests' package: the verify driver and the emulated tests.
const ALL_TESTS: &str = "--features=cslam-tests/verify,cslam-tests/constants,cslam-tests/emulated,cslam-tests/outputs,cslam-tests/ground";
const EMULATED_BOARD: &str = "--features=qemu-an500";
/// The emulated board with the rivals of the networks' table.
const ALL_BOARD: &str = "--features=qemu-an500,rivals";
const REAL_BOARD: &str = "--features=stm32h743";
const LINK_CHECK: &str = "--features=link-check";
const UNOPTIMISED_DEV: &str = "--config=profile.dev.opt-level=0";
const UNOPTIMISED: &str = "--config=profile.release.opt-level=0";

/// Every stage, in order.
pub(crate) const STAGES: &[Stage] = &[
    Stage {
        name: "toolchain",
        what: "the chips' targets, rustfmt and clippy are there, or rustup adds them",
        needs: &[],
        lane: Lane::Optimised,
        work: Work::SetUp(setup::toolchain),
    },
    Stage {
        name: "oldest-rustc",
        what: "the oldest compiler that is promised is there, or rustup adds it",
        needs: &[],
        lane: Lane::Optimised,
        work: Work::SetUp(setup::oldest_toolchain),
    },
    Stage {
        name: "qemu",
        what: "qemu-system-arm is there, or the package manager installs it",
        needs: &[],
        lane: Lane::Optimised,
        work: Work::SetUp(setup::qemu),
    },
    Stage {
        name: "defmt-print",
        what: "the decoder of the chip's log is there, or cargo installs it",
        needs: &["toolchain"],
        lane: Lane::Optimised,
        work: Work::SetUp(setup::defmt_print),
    },
    Stage {
        name: "python",
        what: "evo, Open3D, plyfile, pymavlink and the mcap reader load, or pip installs them under target/",
        needs: &[],
        lane: Lane::Optimised,
        work: Work::SetUp(setup::python),
    },
    Stage {
        name: "browser",
        what: "chromium is there, or the package manager installs it",
        needs: &[],
        lane: Lane::Optimised,
        work: Work::SetUp(setup::browser),
    },
    Stage {
        name: "node",
        what: "node and npm are there, the browser's driver is installed under target/, three.js is what its sources give",
        needs: &[],
        lane: Lane::Optimised,
        work: Work::SetUp(setup::node),
    },
    Stage {
        name: "c-compiler",
        what: "cc and c++ are there, or the package manager installs them",
        needs: &[],
        lane: Lane::Optimised,
        work: Work::SetUp(setup::c_compiler),
    },
    Stage {
        name: "chip-c-compiler",
        what: "arm-none-eabi-gcc with newlib is there, or the package manager installs it",
        needs: &[],
        lane: Lane::Optimised,
        work: Work::SetUp(setup::chip_c_compiler),
    },
    Stage {
        name: "fmt",
        what: "every file is formatted",
        needs: &["toolchain"],
        lane: Lane::Unoptimised,
        work: Work::Steps(&[step(&["fmt", "--all", "--check"])]),
    },
    Stage {
        name: "clippy-host",
        what: "no warning in any target on the host",
        needs: &["toolchain"],
        lane: Lane::Unoptimised,
        work: Work::Steps(&[
            step(&[
                "clippy",
                "--locked",
                "--workspace",
                "--all-targets",
                ALL_TESTS,
                "--",
                "-Dwarnings",
            ]),
            step(&[
                "clippy",
                "--locked",
                UNOPTIMISED_DEV,
                "-p=cslam-tests",
                "--features=book",
                "--bin=book",
                "--",
                "-Dwarnings",
            ]),
            // Fuzz targets run under a nightly compiler only, but they must not rot.
            step(&[
                "clippy",
                "--locked",
                "--manifest-path=fuzz/Cargo.toml",
                "--",
                "-Dwarnings",
            ]),
        ]),
    },
    Stage {
        name: "clippy-chip",
        what: "no warning in what is built for the chip",
        needs: &["toolchain"],
        lane: Lane::Unoptimised,
        work: Work::Steps(&[
            step(&[
                "clippy",
                "--locked",
                THUMB,
                "-p=cslam-checks",
                ALL_BOARD,
                "--",
                "-Dwarnings",
            ]),
            step(&[
                "clippy",
                "--locked",
                THUMB,
                "-p=cslam-checks",
                "--features=qemu-an386",
                "--",
                "-Dwarnings",
            ]),
            step(&[
                "clippy",
                "--locked",
                THUMB,
                "-p=cslam-firmware",
                REAL_BOARD,
                "--",
                "-Dwarnings",
            ]),
            step(&[
                "clippy",
                "--locked",
                THUMB,
                "-p=cslam-firmware",
                LINK_CHECK,
                "--",
                "-Dwarnings",
            ]),
        ]),
    },
    Stage {
        name: "test",
        what: "every test and doctest on the host",
        needs: &["toolchain"],
        lane: Lane::Unoptimised,
        work: Work::Steps(&[step(&[
            "test",
            "--locked",
            "--workspace",
            "--no-fail-fast",
            "--features=cslam-tests/verify,cslam-tests/constants",
        ])]),
    },
    Stage {
        name: "release",
        what: "the command and the driver of the emulated chip build with optimisation",
        needs: &["toolchain"],
        lane: Lane::Optimised,
        work: Work::Steps(&[step(&cslam_tests::RELEASE)]),
    },
    Stage {
        name: "telemetry",
        what: "a point of the outdoor flight costs the ground link less than 8 bytes, everything included",
        needs: &["release"],
        lane: Lane::Optimised,
        work: Work::Steps(&[built("cslam", &["reproduce", "telemetry", "bytes", "--check"])]),
    },
    Stage {
        name: "picture",
        what: "the first page's moving picture is that of the flight beside it",
        needs: &["release"],
        lane: Lane::Optimised,
        work: Work::Steps(&[Step {
            program: Program::Release("cslam"),
            arguments: &["fly", "--export=animation", "--out=target/verify-flight"],
            expect: Expect::Same("target/verify-flight/flight.svg", "docs/flight.svg"),
        }]),
    },
    Stage {
        name: "accuracy",
        what: "path estimation gives the committed figures, byte for byte, and every figure asked for is reached",
        needs: &["release"],
        lane: Lane::Optimised,
        work: Work::Steps(&[built(
            "cslam",
            &["accuracy", "--check=host-sim/golden/accuracy.txt"],
        )]),
    },
    Stage {
        name: "doc",
        what: "the documentation builds without a warning",
        needs: &["toolchain"],
        lane: Lane::Unoptimised,
        work: Work::Steps(&[
            docs(&["doc", "--locked", "--workspace", "--no-deps"]),
            docs(&[
                "doc",
                "--locked",
                THUMB,
                "-p=cslam-checks",
                EMULATED_BOARD,
                "--no-deps",
                "--bin=receiver-an500",
            ]),
        ]),
    },
    Stage {
        name: "book",
        what: "the documents build as a site; their links lead somewhere, their tables are those of the committed measurements",
        needs: &["toolchain"],
        lane: Lane::Unoptimised,
        work: Work::Steps(&[
            // As `cargo book` does.
            step(&[
                "run",
                "--locked",
                UNOPTIMISED_DEV,
                "-p=cslam-tests",
                "--features=book",
                "--bin=book",
            ]),
            step(&["test", "--locked", "--workspace", ALL_TESTS, "--test=documents"]),
        ]),
    },
    Stage {
        name: "core-targets",
        what: "the core builds for 32- and 64-bit processors with and without DSP instructions and floating point, and with defmt",
        needs: &["toolchain"],
        lane: Lane::Optimised,
        // Built, not checked: only then are the kernels in assembly assembled, where the target has any. Not optimised:
        // how fast the code is, is asked of the images.
        work: Work::Steps(&[
            step(&[
                "build",
                "--locked",
                "--release",
                UNOPTIMISED,
                "-p=cslam-core",
                "--target=thumbv6m-none-eabi",
                "--target=thumbv7m-none-eabi",
                "--target=thumbv7em-none-eabi",
                "--target=thumbv7em-none-eabihf",
                "--target=thumbv8m.main-none-eabihf",
                "--target=aarch64-unknown-none",
                "--target=riscv32imac-unknown-none-elf",
            ]),
            step(&[
                "build",
                "--locked",
                "--release",
                UNOPTIMISED,
                "-p=cslam-core",
                THUMB,
                "--features=defmt",
            ]),
        ]),
    },
    Stage {
        name: "oldest-compiler",
        what: "the core compiles with the oldest compiler that is promised, its `rust-version`: host and chip, without features and with all",
        needs: &["oldest-rustc"],
        lane: Lane::Optimised,
        work: Work::Steps(&[
            oldest(&[
                "check",
                "--locked",
                "--release",
                "-p=cslam-core",
                "--target=host-tuple",
                THUMB,
            ]),
            oldest(&[
                "check",
                "--locked",
                "--release",
                "-p=cslam-core",
                "--target=host-tuple",
                THUMB,
                "--all-features",
            ]),
        ]),
    },
    Stage {
        name: "firmware",
        what: "the images for the emulated board link; two boards, and a board for the host, are refused",
        needs: &["toolchain"],
        lane: Lane::Optimised,
        work: Work::Steps(&[
            step(&[
                "build",
                "--locked",
                "--profile=firmware",
                THUMB,
                "-p=cslam-checks",
                EMULATED_BOARD,
            ]),
            refused(
                &[
                    "check",
                    "--locked",
                    THUMB,
                    "-p=cslam-checks",
                    "--features=qemu-an500,qemu-an386",
                ],
                "two boards are chosen",
            ),
            refused(
                &["check", "--locked", "-p=cslam-checks", EMULATED_BOARD],
                "board `qemu-an500` needs a chip's target",
            ),
        ]),
    },
    Stage {
        name: "h743",
        what: "the image for the STM32H743 links, fits the budgets and lies where it should; committed sizes",
        needs: &["toolchain"],
        lane: Lane::Unoptimised,
        work: Work::Steps(&[step(&[
            "test",
            "--locked",
            "--workspace",
            ALL_TESTS,
            "--test=h743",
            "--",
            "--nocapture",
        ])]),
    },
    Stage {
        name: "panic-free",
        what: "the flight path links for the STM32H743, and for Armv8-M, without a reachable panic",
        needs: &["toolchain"],
        lane: Lane::Optimised,
        work: Work::Steps(&[
            step(&[
                "build",
                "--locked",
                "--profile=firmware",
                THUMB,
                "-p=cslam-firmware",
                LINK_CHECK,
                "--bin=panic-free",
            ]),
            step(&[
                "build",
                "--locked",
                "--profile=firmware",
                "--target=thumbv8m.main-none-eabihf",
                "-p=cslam-firmware",
                LINK_CHECK,
                "--bin=panic-free",
            ]),
        ]),
    },
    Stage {
        name: "loop",
        what: "the emulated Cortex-M7 flies a minute in the loop with the world: bytes of the host, budgets, committed counts",
        needs: &["qemu", "defmt-print", "c-compiler", "release", "firmware"],
        lane: Lane::Optimised,
        work: Work::Steps(&[
            built(
                "fw",
                &[
                    "--world=budget",
                    "--seconds=60",
                    "--faults",
                    "--count",
                    "--check=tests/golden/receiver_cost.txt",
                ],
            ),
            built(
                "fw",
                &[
                    "--world=budget",
                    "--seconds=60",
                    "--faults",
                    "--profile",
                    "--check=tests/golden/receiver_cycles.txt",
                ],
            ),
        ]),
    },
    Stage {
        name: "emulated",
        what: "panics, faults, hangs and overflows on the emulated Cortex-M7 leave a record, and its exit codes say how a run ended",
        needs: &["toolchain", "qemu", "defmt-print", "firmware"],
        lane: Lane::Unoptimised,
        work: Work::Steps(&[step(&[
            "test",
            "--locked",
            "--workspace",
            ALL_TESTS,
            "--test=emulated",
            "--",
            "--nocapture",
        ])]),
    },
    Stage {
        name: "outputs",
        what: "the tools of the field read a flight's files and agree with its report; a browser draws the page; a recording by NumPy flies",
        needs: &["toolchain", "python", "browser"],
        lane: Lane::Unoptimised,
        work: Work::Steps(&[step(&[
            "test",
            "--locked",
            "--workspace",
            ALL_TESTS,
            "--test=outputs",
        ])]),
    },
    Stage {
        name: "ground",
        what: "the ground station's page in a browser while UAVs fly, its MAVLink by pymavlink, 100 UAVs at full rate",
        needs: &["toolchain", "python", "browser", "node", "release"],
        lane: Lane::Unoptimised,
        work: Work::Steps(&[
            step(&[
                "test",
                "--locked",
                "--workspace",
                ALL_TESTS,
                "--test=page",
                "--",
                "--nocapture",
            ]),
            built("cslam", &["bench", "ground", "--seconds=15"]),
        ]),
    },
    Stage {
        name: "uplink",
        what: "ten million hostile packets against the receiver in flight: none taken, pose and clock unmoved",
        needs: &["release"],
        lane: Lane::Optimised,
        work: Work::Steps(&[built("cslam", &["bench", "uplink"])]),
    },
    Stage {
        name: "publish",
        what: "the core could be published: it builds from its package alone (needs the index of the package registry)",
        needs: &["toolchain"],
        lane: Lane::Optimised,
        work: Work::Steps(&[step(&[
            "publish",
            "--dry-run",
            "--locked",
            "--allow-dirty",
            "-p=cslam-core",
        ])]),
    },
    Stage {
        name: "capi",
        what: "cslam.h is what its sources give; C, Rust and the command print the same paths; a million wrong calls under sanitizers",
        needs: &["toolchain", "c-compiler"],
        lane: Lane::Optimised,
        work: Work::Steps(&[step(&[
            "test",
            "--locked",
            "--release",
            "-p=cslam-c",
            "-p=cslam-python",
            "--",
            "--include-ignored",
            "--skip=python",
            "--skip=chip",
        ])]),
    },
    Stage {
        name: "capi-chip",
        what: "the C examples print the same paths on the emulated Cortex-M7",
        needs: &["toolchain", "qemu", "chip-c-compiler"],
        lane: Lane::Optimised,
        work: Work::Steps(&[step(&[
            "test",
            "--locked",
            "--release",
            "-p=cslam-c",
            "-p=cslam-python",
            "--test=programs",
            "--",
            "--ignored",
            "chip",
        ])]),
    },
    Stage {
        name: "own-python",
        what: "pip builds the Python package and installs it under target/",
        needs: &["toolchain"],
        lane: Lane::Optimised,
        work: Work::SetUp(setup::own_python),
    },
    Stage {
        name: "python-package",
        what: "the Python package passes its tests with the newest NumPy and the oldest, and prints and flies what the command does",
        needs: &["own-python"],
        lane: Lane::Optimised,
        work: Work::Steps(&[step(&[
            "test",
            "--locked",
            "--release",
            "-p=cslam-c",
            "-p=cslam-python",
            "--test=programs",
            "--",
            "--ignored",
            "--nocapture",
            "python",
        ])]),
    },
    Stage {
        name: "kernels",
        what: "kernels, whole sweeps, networks and data association on the emulated Cortex-M7: bits of the host, committed counts; on a Cortex-M4F and a Cortex-M55 the bits",
        needs: &["toolchain", "qemu", "defmt-print", "firmware"],
        lane: Lane::Unoptimised,
        work: Work::Steps(&[step(&[
            "test",
            "--locked",
            "--workspace",
            ALL_TESTS,
            "--test=association",
            "--test=chips",
            "--test=kernels",
            "--test=sweeps",
            "--test=link_state",
        ])]),
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_needs_come_first() {
        for (index, stage) in STAGES.iter().enumerate() {
            let earlier = &STAGES[..index];
            assert!(
                earlier.iter().all(|other| other.name != stage.name),
                "{} twice",
                stage.name
            );
            for need in stage.needs {
                assert!(
                    earlier.iter().any(|other| other.name == *need),
                    "{} needs {need}",
                    stage.name
                );
            }
        }
    }
}

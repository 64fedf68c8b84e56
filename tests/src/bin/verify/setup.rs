//! What the checks need, installed when it is missing.

use std::path::Path;
use std::{fs, io};

use crate::command::{OLDEST_COMPILER, output_of, status, tool};

/// Targets without a system: those of a Cortex-M7 and of its successors, and the others that the core is built for.
const TARGETS: [&str; 7] = [
    "thumbv7em-none-eabihf",
    "thumbv8m.main-none-eabihf",
    "thumbv6m-none-eabi",
    "thumbv7m-none-eabi",
    "thumbv7em-none-eabi",
    "aarch64-unknown-none",
    "riscv32imac-unknown-none-elf",
];
/// Parts of the compiler that the checks call.
const COMPONENTS: [&str; 2] = ["rustfmt", "clippy"];
/// Reads the log of an image built with the `defmt` of Cargo.lock.
const DECODER: [&str; 5] = ["install", "--locked", "defmt-print", "--version", "1.2.0"];

/// The compiler's components and the chips' targets, by rustup.
pub(crate) fn toolchain() -> Result<(), String> {
    let Some(targets) = output_of("rustup", &["target", "list", "--installed"]) else {
        return toolchain_without_rustup();
    };
    for target in TARGETS {
        if !targets.lines().any(|line| line.trim() == target) {
            install("rustup", &["target", "add", target])?;
        }
    }
    let components = output_of("rustup", &["component", "list", "--installed"]).unwrap_or_default();
    for component in COMPONENTS {
        if !components.lines().any(|line| line.starts_with(component)) {
            install("rustup", &["component", "add", component])?;
        }
    }
    Ok(())
}

/// The oldest compiler that is promised, with the board's target, by rustup.
pub(crate) fn oldest_toolchain() -> Result<(), String> {
    let target = TARGETS[0];
    let installed = || {
        output_of(
            "rustup",
            &["target", "list", "--installed", "--toolchain", OLDEST_COMPILER],
        )
        .is_some_and(|targets| targets.lines().any(|line| line.trim() == target))
    };
    if !installed() {
        let arguments = [
            "toolchain",
            "install",
            OLDEST_COMPILER,
            "--profile",
            "minimal",
            "--target",
            target,
        ];
        install("rustup", &arguments)?;
    }
    let version = output_of("rustup", &["run", OLDEST_COMPILER, "rustc", "--version"]);
    println!(
        "{}",
        version
            .ok_or("the oldest compiler was installed and does not run")?
            .trim()
    );
    Ok(())
}

/// A compiler of the system may have it all as well.
fn toolchain_without_rustup() -> Result<(), String> {
    let has_target = |target| {
        let library = output_of("rustc", &["--print", "target-libdir", "--target", target]);
        library.is_some_and(|folder| Path::new(folder.trim()).is_dir())
    };
    let has = |program| output_of(program, &["--version"]).is_some();
    if TARGETS.into_iter().all(has_target) && has("cargo-clippy") && has("rustfmt") {
        Ok(())
    } else {
        Err(format!(
            "rustup is missing, and with it a target of {TARGETS:?}; install it from https://rustup.rs"
        ))
    }
}

/// The emulator, by the system's package manager.
pub(crate) fn qemu() -> Result<(), String> {
    let version = || output_of("qemu-system-arm", &["--version"]);
    if version().is_none() {
        let elsewhere = "Debian, Ubuntu, Fedora, Arch: qemu-system-arm; Homebrew: qemu";
        install_package("qemu-system-arm", "qemu-system-arm", elsewhere)?;
    }
    let version = version().ok_or("qemu-system-arm was installed and does not run")?;
    println!("{}", version.lines().next().unwrap_or_default());
    let machines = output_of("qemu-system-arm", &["-machine", "help"]).unwrap_or_default();
    if machines.lines().any(|line| line.starts_with("mps2-an500 ")) {
        Ok(())
    } else {
        Err("this qemu-system-arm has no machine mps2-an500; install QEMU 4.2 or newer".to_owned())
    }
}

/// Installs a Debian package, or says how to get it. `elsewhere` names the package on other systems.
fn install_package(program: &str, package: &str, elsewhere: &str) -> Result<(), String> {
    let missing =
        format!("{program} is missing; install it with your system's package manager ({elsewhere})");
    if output_of("apt-get", &["--version"]).is_none() {
        return Err(missing);
    }
    let is_root = output_of("id", &["-u"]).is_some_and(|id| id.trim() == "0");
    let sudo = !is_root && output_of("sudo", &["-n", "true"]).is_some();
    if !is_root && !sudo {
        return Err(format!(
            "{missing}; apt-get needs root, and sudo asks for a password"
        ));
    }
    let apt = |arguments: &[&str]| {
        let words = [
            if sudo { &["sudo", "-n"][..] } else { &[] },
            &["apt-get"],
            arguments,
        ]
        .concat();
        install(words[0], &words[1..])
    };
    let installed =
        apt(&["update"]).and_then(|()| apt(&["install", "--yes", "--no-install-recommends", package]));
    installed.map_err(|error| format!("{missing}; {error}"))
}

/// A browser, by the system's package manager.
pub(crate) fn browser() -> Result<(), String> {
    let version = || output_of("chromium", &["--version"]);
    if version().is_none() {
        let elsewhere = "Debian, Fedora, Arch: chromium; Ubuntu: a chromium on the path";
        install_package("chromium", "chromium", elsewhere)?;
    }
    let version = version().ok_or("chromium was installed and does not run")?;
    println!("{}", version.lines().next().unwrap_or_default());
    Ok(())
}

/// Where the checks' Python packages are installed, from the workspace's root.
const PYTHON: &str = "target/verify-python";
/// The packages, and a line that loads them all.
const REQUIREMENTS: &str = "tests/tools/requirements.txt";
const IMPORTS: &str = "import evo, mcap, mcap_protobuf, mcap_ros2, numpy, open3d, plyfile, pymavlink, rosbags, safetensors; print(f'open3d {open3d.__version__}')";

/// The tools that read a flight's files: evo, Open3D, plyfile and the mcap reader, in an environment of their own.
pub(crate) fn python() -> Result<(), String> {
    let python = format!("{PYTHON}/bin/python");
    let loads = || output_of(&python, &["-c", IMPORTS]);
    if loads().is_none() {
        if output_of("python3", &["-c", "import venv, ensurepip"]).is_none() {
            let elsewhere = "Debian, Ubuntu: python3-venv; elsewhere it comes with python3";
            install_package("python3 with venv", "python3-venv", elsewhere)?;
        }
        install("python3", &["-m", "venv", PYTHON])?;
        install(
            &python,
            &["-m", "pip", "install", "--quiet", "--requirement", REQUIREMENTS],
        )?;
    }
    let version = loads().ok_or("the Python packages were installed and do not load")?;
    println!("{}", version.trim());
    Ok(())
}

/// Where the project's own Python package is installed, from the workspace's root.
const OWN_PYTHON: &str = "target/verify-bindings";
/// Where an old NumPy lies, for who puts it before the environment's own: a copy of the environment would have the package built twice.
const OLDEST_NUMPY: &str = "target/verify-bindings/oldest-numpy";

/// The project's Python package with its tests' needs, built by pip as a user has it built.
pub(crate) fn own_python() -> Result<(), String> {
    let python = format!("{OWN_PYTHON}/bin/python");
    if output_of(&python, &["-m", "pip", "--version"]).is_none() {
        if output_of("python3", &["-c", "import venv, ensurepip"]).is_none() {
            let elsewhere = "Debian, Ubuntu: python3-venv; elsewhere it comes with python3";
            install_package("python3 with venv", "python3-venv", elsewhere)?;
        }
        install("python3", &["-m", "venv", OWN_PYTHON])?;
    }
    install(
        &python,
        &["-m", "pip", "install", "--quiet", "./python[campaign,test]"],
    )?;
    if !Path::new(OLDEST_NUMPY).is_dir() {
        let which = ["--requirement", "python/tests/oldest_numpy.txt"];
        let arguments = [
            "-m",
            "pip",
            "install",
            "--quiet",
            "--no-deps",
            "--target",
            OLDEST_NUMPY,
        ];
        install(&python, &[&arguments[..], &which[..]].concat())?;
    }
    let loads = output_of(
        &python,
        &[
            "-c",
            "import cslam, distributed, numpy; print(f'cslam {cslam.__version__}, numpy {numpy.__version__}, Dask {distributed.__version__}')",
        ],
    );
    println!(
        "{}",
        loads.ok_or("the package was installed and does not load")?.trim()
    );
    Ok(())
}

/// A C compiler and one for C++, by the system's package manager.
pub(crate) fn c_compiler() -> Result<(), String> {
    for (program, package) in [("cc", "gcc libc6-dev"), ("c++", "g++")] {
        if output_of(program, &["--version"]).is_none() {
            for package in package.split(' ') {
                install_package(program, package, "a C and a C++ compiler by the names cc and c++")?;
            }
        }
    }
    let version = output_of("cc", &["--version"]).ok_or("cc was installed and does not run")?;
    println!("{}", version.lines().next().unwrap_or_default());
    Ok(())
}

/// A C compiler for the emulated Cortex-M7 with its library, by the system's package manager.
pub(crate) fn chip_c_compiler() -> Result<(), String> {
    let program = "arm-none-eabi-gcc";
    let library = || {
        output_of(program, &["--print-file-name=rdimon.specs"])
            .is_some_and(|file| file.trim() != "rdimon.specs")
    };
    if output_of(program, &["--version"]).is_none() {
        let elsewhere =
            "Debian, Ubuntu: gcc-arm-none-eabi; Fedora: arm-none-eabi-gcc-cs; Arch: arm-none-eabi-gcc";
        install_package(program, "gcc-arm-none-eabi", elsewhere)?;
    }
    if !library() {
        let elsewhere = "Debian, Ubuntu: libnewlib-arm-none-eabi; Fedora, Arch: arm-none-eabi-newlib";
        install_package("newlib for arm-none-eabi", "libnewlib-arm-none-eabi", elsewhere)?;
    }
    let version =
        output_of(program, &["--version"]).ok_or("arm-none-eabi-gcc was installed and does not run")?;
    println!("{}", version.lines().next().unwrap_or_default());
    Ok(())
}

/// Where the checks' JavaScript packages are installed, from the workspace's root: what is copied from where.
const NODE: [(&str, &str); 2] = [
    ("tests/tools/browser", "target/verify-node/browser"),
    ("host-sim/assets/ground/vendor", "target/verify-node/vendor"),
];

/// What drives the browser, and what three.js was built with: the committed build must be what the sources give.
pub(crate) fn node() -> Result<(), String> {
    let version = || output_of("node", &["--version"]);
    for (program, package) in [("node", "nodejs"), ("npm", "npm")] {
        if output_of(program, &["--version"]).is_none() {
            let elsewhere = "Debian, Fedora, Arch: nodejs and npm; version 20 or newer";
            install_package(program, package, elsewhere)?;
        }
    }
    let version = version().ok_or("node was installed and does not run")?;
    println!("node {}", version.trim());
    for (from, to) in NODE {
        let lock = |folder: &str| fs::read(Path::new(folder).join("package-lock.json")).ok();
        let is_there = Path::new(to).join("node_modules").is_dir() && lock(from) == lock(to);
        copy_files(from, to).map_err(|error| format!("{from} cannot be copied to {to}: {error}"))?;
        if !is_there {
            let quiet = ["--no-audit", "--no-fund", "--ignore-scripts"];
            install("npm", &[&["ci", "--prefix", to], &quiet[..]].concat())?;
        }
    }
    install("node", &["target/verify-node/vendor/build.mjs", "--check"])
}

/// Copies the files of a folder, not its folders.
fn copy_files(from: &str, to: &str) -> io::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let file = entry?.path();
        if let (true, Some(name)) = (file.is_file(), file.file_name()) {
            fs::copy(&file, Path::new(to).join(name))?;
        }
    }
    Ok(())
}

/// The decoder of the image's log, by cargo.
pub(crate) fn defmt_print() -> Result<(), String> {
    let version = || output_of("defmt-print", &["--version"]);
    if version().is_none() {
        install("cargo", &DECODER)?;
    }
    let version = version().ok_or("defmt-print was installed and does not run")?;
    println!("{}", version.lines().next().unwrap_or_default());
    Ok(())
}

fn install(program: &str, arguments: &[&str]) -> Result<(), String> {
    let line = format!("{program} {}", arguments.join(" "));
    println!("-- {line}");
    status(
        tool(program)
            .args(arguments)
            .env("DEBIAN_FRONTEND", "noninteractive"),
        &line,
    )
}

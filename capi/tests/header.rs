//! `include/cslam.h` is what cbindgen makes of the sources; and a C++ compiler takes it too.

use std::path::Path;
use std::process::Command;
use std::{env, fs};

const SOURCES: [&str; 9] = [
    "status",
    "values",
    "estimator_values",
    "estimator",
    "solver",
    "classifier",
    "receiver_values",
    "receiver",
    "receiver_outputs",
];

#[test]
fn the_header_is_made_of_the_sources() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(root.join("cbindgen.toml")).expect("a configuration");
    let builder = SOURCES
        .iter()
        .map(|name| root.join("src").join(name).with_extension("rs"))
        .fold(cbindgen::Builder::new().with_config(config), |builder, file| {
            builder.with_src(file)
        });
    let mut made = Vec::new();
    builder.generate().expect("a header").write(&mut made);
    let made = String::from_utf8(made).expect("text");
    let file = root.join("include/cslam.h");
    if env::var_os("CSLAM_WRITE_HEADER").is_some() {
        fs::write(&file, &made).expect("writable");
    }
    assert!(
        fs::read_to_string(&file).is_ok_and(|there| there == made),
        "include/cslam.h is not what the sources give: CSLAM_WRITE_HEADER=1 cargo test -p cslam-c --test header"
    );
}

#[test]
fn compilers_take_the_header() {
    let header = concat!(env!("CARGO_MANIFEST_DIR"), "/include/cslam.h");
    for (compiler, standard, language) in [("cc", "-std=c11", "c"), ("c++", "-std=c++14", "c++")] {
        let Ok(output) = Command::new(compiler)
            .args([
                "-fsyntax-only",
                "-Wall",
                "-Wextra",
                "-Werror",
                "-pedantic",
                standard,
                "-x",
                language,
                header,
            ])
            .output()
        else {
            eprintln!("{compiler} is not here: not tried");
            continue;
        };
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
}

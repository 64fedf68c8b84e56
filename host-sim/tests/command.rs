//! The command as a whole: what it says on the side, completions and manual pages.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn cslam(directory: &Path, args: &[&str]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_cslam"))
        .current_dir(directory)
        .args(args)
        .output()
        .expect("the binary runs");
    assert!(
        output.status.success(),
        "{args:?}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    output
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("text")
}

fn fixture() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/indoor.jsonl.gz")
}

#[test]
fn quiet_leaves_results_alone() {
    let directory = tempfile::tempdir().expect("a directory");
    let fixture = fixture();
    let fixture = fixture.to_str().expect("text");
    for args in [
        &["solve", "--json", "--paths", fixture][..],
        &["classify", "--json", "--paths", fixture],
        &["fly", "--paths", "bundled", "--steps", "9", "--out", "out"],
        &[
            "record",
            "--scene",
            "street",
            "--duration",
            "1",
            "--no-samples",
            "--out",
            "recorded",
        ],
    ] {
        let usual = cslam(directory.path(), args);
        assert!(!usual.stderr.is_empty(), "{args:?}");
        for quiet in ["-q", "--quiet"] {
            let output = cslam(directory.path(), &[args, &[quiet]].concat());
            assert_eq!(text(&output.stderr), "", "{args:?}");
            let result = |output: &Output| {
                let lines = text(&output.stdout).lines().map(str::to_owned);
                lines
                    .filter(|line| !line.starts_with("computed in"))
                    .collect::<Vec<_>>()
            };
            assert_eq!(result(&output), result(&usual), "{args:?}");
        }
    }
}

#[test]
fn a_shell_completes_commands_and_options() {
    let directory = tempfile::tempdir().expect("a directory");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let output = cslam(directory.path(), &["completions", shell]);
        let script = text(&output.stdout);
        for word in [
            "cslam",
            "classify",
            "completions",
            "covariance-free-word-that-is-nowhere",
        ] {
            assert_eq!(
                script.contains(word),
                !word.starts_with("covariance"),
                "{shell}: {word}"
            );
        }
        assert!(
            script.contains("position-sigma-m"),
            "{shell}: options of subcommands"
        );
    }
}

/// The shell itself: what it offers after a word that was begun.
#[cfg(unix)]
#[test]
fn bash_offers_the_options_of_a_subcommand() {
    let directory = tempfile::tempdir().expect("a directory");
    let script = cslam(directory.path(), &["completions", "bash"]).stdout;
    fs::write(directory.path().join("cslam.bash"), script).expect("writable");
    let asked = "source ./cslam.bash; COMP_WORDS=(cslam classify --ignore); COMP_CWORD=2; _cslam cslam --ignore classify; \
                 printf '%s\\n' \"${COMPREPLY[@]}\"";
    let output = Command::new("bash")
        .current_dir(directory.path())
        .args(["--norc", "-c", asked])
        .output()
        .expect("bash runs");
    assert_eq!(
        text(&output.stdout).trim(),
        "--ignore-aod",
        "{}",
        text(&output.stderr)
    );
}

#[test]
fn every_subcommand_has_a_manual_page() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    let page = cslam(at, &["man"]).stdout;
    assert!(text(&page).contains(".TH cslam 1"), "{}", text(&page));
    cslam(at, &["man", "--out", "man1"]);
    let help = cslam(at, &["--help"]).stdout;
    let commands: Vec<&str> = text(&help)
        .lines()
        .skip_while(|line| *line != "Commands:")
        .skip(1)
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .collect();
    assert!(commands.len() > 12, "{commands:?}");
    for name in commands {
        let page = fs::read_to_string(at.join(format!("man1/cslam-{name}.1"))).expect("a page");
        assert!(page.contains(&format!(".TH cslam-{name} 1")), "{name}: {page}");
    }
    let page = fs::read_to_string(at.join("man1/cslam-fly.1")).expect("a page");
    assert!(page.contains("is replaced whole"), "{page}");
}

#[test]
fn people_read_a_line_for_every_path() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("two.jsonl");
    let path = r#"{"delay_s":1.8868e-7,"aoa_zenith_rad":1.5708,"aoa_azimuth_rad":2.3562,"aod_zenith_rad":1.5708,"aod_azimuth_rad":0.7854}"#;
    let sight = r#"{"delay_s":1.33426e-7,"aoa_zenith_rad":1.5708,"aoa_azimuth_rad":3.1416,"aod_zenith_rad":1.5708,"aod_azimuth_rad":0.0}"#;
    let ends = r#""tx":[0,0,10],"rx":[40,0,10]"#;
    let lines = [
        format!("{{{ends},\"paths\":[{sight},{path}]}}"),
        format!("{{{ends},\"paths\":[]}}"),
    ];
    fs::write(&file, lines.join("\n")).expect("writable");
    let output = cslam(directory.path(), &["classify", "--paths", "two.jsonl"]);
    let stdout = text(&output.stdout);
    let rows: Vec<Vec<&str>> = stdout
        .lines()
        .map(|line| line.split_whitespace().collect())
        .collect();
    assert_eq!(
        rows[0],
        ["link", "path", "state", "P(first", "order)", "map"],
        "{stdout}"
    );
    assert_eq!(rows[1][..5], ["0", "0", "line", "of", "sight"], "{stdout}");
    assert_eq!(rows[2][..4], ["0", "1", "first", "order"], "{stdout}");
    assert_eq!(rows[2].last(), Some(&"accepted"), "{stdout}");
    assert_eq!(rows[3], ["1", "-", "outage", "-", "-"], "{stdout}");
    assert!(stdout.contains("accepted for the map: 1 paths"), "{stdout}");
    // The JSON of the same says the same.
    let json = cslam(directory.path(), &["classify", "--json", "--paths", "two.jsonl"]);
    let link: serde_json::Value =
        serde_json::from_str(text(&json.stdout).lines().next().expect("a line")).expect("JSON");
    let p = link["paths"][1]["first_order"].as_f64().expect("a number");
    assert_eq!(rows[2][4], format!("{p:.3}"));
}

//! `cslam campaign`: flights that are flown once, lists that are not mixed, and two campaigns side by side.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::SystemTime;

fn cslam(args: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_cslam"))
        .args(args)
        .output()
        .expect("runs");
    let text = |bytes| String::from_utf8(bytes).expect("text");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn changed(file: &Path) -> SystemTime {
    fs::metadata(file).and_then(|m| m.modified()).expect("there")
}

#[test]
fn a_campaign_goes_on_where_it_was_and_is_compared() {
    let directory = tempfile::tempdir().expect("a directory");
    let [one, other] = ["one", "other"].map(|name| directory.path().join(name));
    let [out, compared] = [&one, &other].map(|path| path.to_str().expect("text"));
    let fly =
        |out: &str, last: &str| cslam(&["campaign", "--out", out, "--seeds", "1", last, "--steps", "14"]);
    let (code, table, errors) = fly(out, "1");
    assert_eq!(code, Some(0), "{errors}");
    assert!(
        table.contains("real, best, 1 flights") && table.contains("position, rms, m"),
        "{table}"
    );
    let first = one.join("real.best.outdoor.1.json");
    let before = changed(&first);
    let (code, table, _) = fly(out, "2");
    assert!(code == Some(0) && table.contains("2 flights"), "{table}");
    assert_eq!(changed(&first), before, "flown again");
    let summary: serde_json::Value =
        serde_json::from_slice(&fs::read(one.join("summary.json")).expect("written")).expect("JSON");
    assert_eq!(summary["real, best"]["flights"], 2);

    // The same flights in another directory: nothing differs. One that is put right is found.
    fs::create_dir(&other).expect("writable");
    fs::copy(&first, other.join("real.best.outdoor.1.json")).expect("copied");
    let (code, text, _) = cslam(&["campaign", "--compare", out, compared]);
    assert!(
        code == Some(0) && text.contains("no figure of any flight differs"),
        "{text}"
    );

    // What another build has flown is no part of this campaign.
    let mut shard: serde_json::Value =
        serde_json::from_slice(&fs::read(&first).expect("there")).expect("JSON");
    shard["build"]["executable_crc"] = 1.into();
    fs::write(&first, shard.to_string()).expect("writable");
    let (code, _, errors) = fly(out, "1");
    assert_eq!(code, Some(2), "{errors}");
    assert!(
        errors.contains("another build") && errors.contains("real.best.outdoor.1.json"),
        "{errors}"
    );
}

/// The report of a flight without what depends on the machine.
fn report(directory: &Path, name: &str) -> serde_json::Value {
    let shard = fs::read(directory.join(name)).expect("flown");
    let shard: serde_json::Value = serde_json::from_slice(&shard).expect("JSON");
    shard["report"].clone()
}

#[test]
fn a_campaign_from_kept_paths_is_that_through_the_world() {
    let directory = tempfile::tempdir().expect("a directory");
    let [first, again, kept] = ["first", "again", "kept"].map(|name| directory.path().join(name));
    let kept_text = kept.to_str().expect("text");
    let fly = |out: &Path, extra: &[&str]| {
        let out = out.to_str().expect("text");
        let args = [
            "campaign",
            "--out",
            out,
            "--seeds",
            "1",
            "2",
            "--keep-paths",
            kept_text,
        ];
        cslam(&[&args[..], extra].concat())
    };
    let both = ["--modes", "best", "paper", "--steps", "14"];
    let (code, _, errors) = fly(&first, &both);
    assert_eq!(code, Some(0), "{errors}");
    let names = |directory: &Path| -> Vec<String> {
        let entries = fs::read_dir(directory).expect("there");
        let mut names: Vec<_> = entries
            .map(|entry| {
                entry
                    .expect("an entry")
                    .file_name()
                    .to_string_lossy()
                    .into_owned()
            })
            .collect();
        names.sort();
        names
    };
    let flights = names(&kept);
    assert_eq!(flights.len(), 4, "{flights:?}");
    assert!(flights[0].starts_with("real-") && flights[0].contains(".best-fit.outdoor.1"));
    let before = changed(&kept.join(&flights[0]).join("flight.json"));

    let (code, _, errors) = fly(&again, &both);
    assert_eq!(code, Some(0), "{errors}");
    assert_eq!(names(&kept), flights);
    assert_eq!(
        changed(&kept.join(&flights[0]).join("flight.json")),
        before,
        "kept again"
    );
    for name in names(&first).iter().filter(|name| *name != "summary.json") {
        let [a, b] = [&first, &again].map(|out| report(out, name));
        assert!(a["measurements"].as_u64() > Some(10), "{name}");
        for key in ["measurements", "verdicts", "counters", "health", "map", "sweeps"] {
            assert_eq!(a[key], b[key], "{name}: {key}");
        }
    }

    // Fewer sweeps are a part of it, more are not there, and of a damaged one the file is named.
    let few = directory.path().join("few");
    let (code, _, errors) = fly(&few, &["--steps", "6"]);
    assert_eq!(code, Some(0), "{errors}");
    assert_eq!(report(&few, "real.best.outdoor.1.json")["sweeps"], 6);
    fs::write(kept.join(&flights[0]).join("estimated_paths.jsonl"), "").expect("writable");
    let more = directory.path().join("more");
    let (code, _, errors) = fly(&more, &["--steps", "15"]);
    assert_eq!(code, Some(0), "{errors}");
    let error = |seed: u32| {
        let shard = fs::read_to_string(more.join(format!("real.best.outdoor.{seed}.json"))).expect("there");
        let shard: serde_json::Value = serde_json::from_str(&shard).expect("JSON");
        shard["error"].as_str().expect("not flown").to_owned()
    };
    assert!(error(1).contains("estimated_paths.jsonl"), "{}", error(1));
    assert!(
        error(2).contains("holds 14 sweeps of the flight, expected 15"),
        "{}",
        error(2)
    );
}

#[test]
fn what_makes_no_campaign_is_refused_in_one_line() {
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().to_str().expect("text");
    for (args, expected) in [
        (&["--seeds", "200", "201"][..], "flown to report only"),
        (&["--seeds", "2", "1"], "nothing to fly"),
        (&["--scenes", "nowhere.json"], "nowhere.json"),
        (&["--steps", "0"], "nothing to fly"),
    ] {
        let (code, _, errors) = cslam(&[&["campaign", "--out", out], args].concat());
        assert_eq!(code, Some(2), "{args:?}: {errors}");
        assert!(
            errors.contains(expected) && errors.lines().count() == 1,
            "{args:?}: {errors}"
        );
    }
    let (code, _, errors) = cslam(&["campaign", "--compare", out, out]);
    assert!(code == Some(2) && errors.contains("holds no flight"), "{errors}");
}

#[test]
fn shards_of_several_processes_are_one_campaign() {
    let directory = tempfile::tempdir().expect("a directory");
    let [whole, pieces] = ["whole", "pieces"].map(|name| directory.path().join(name));
    let fly = |out: &Path, more: &[&str]| {
        let out = out.to_str().expect("text");
        let args = [
            "campaign", "--out", out, "--seeds", "1", "2", "--steps", "6", "--modes", "best", "paper",
            "--world", "ideal", "budget",
        ];
        cslam(&[&args[..], more].concat())
    };
    let missing = || {
        let (code, printed, errors) = fly(&pieces, &["--missing"]);
        assert_eq!(code, Some(0), "{errors}");
        serde_json::from_str::<serde_json::Value>(&printed).expect("JSON")
    };
    assert_eq!(fly(&whole, &[]).0, Some(0));
    assert_eq!(
        missing(),
        serde_json::json!({"shards": 4, "missing": [0, 1, 2, 3]})
    );
    assert!(!pieces.exists(), "asking made a directory");
    for shard in ["2/4", "0/2"] {
        let (code, printed, errors) = fly(&pieces, &["--shard", shard, "--threads", "1"]);
        assert!(code == Some(0) && printed.is_empty(), "{errors}{printed}");
        assert!(!pieces.join("summary.json").exists(), "a part has no summary");
    }
    assert_eq!(missing()["missing"], serde_json::json!([1, 3]));
    let names = ["ideal.best.outdoor.1.json", "ideal.paper.outdoor.1.json"];
    assert!(
        names.iter().all(|name| pieces.join(name).exists()),
        "modes stay together"
    );
    assert_eq!(fly(&pieces, &["--shard", "1/2"]).0, Some(0));
    assert_eq!(missing()["missing"], serde_json::json!([]));
    let (code, _, errors) = fly(&pieces, &[]);
    assert_eq!(code, Some(0), "{errors}");
    let summary = |out: &Path| fs::read(out.join("summary.json")).expect("written");
    assert!(summary(&whole) == summary(&pieces), "the summaries differ");
    for (args, expected) in [
        (&["--shard", "4/4"][..], "--shard 4/4: expected I/N"),
        (
            &["--shard", "0/2", "--keep-paths", "kept"],
            "--keep-paths: expected one world",
        ),
        (
            &["--missing", "--keep-paths", "kept"],
            "--keep-paths: expected one world",
        ),
    ] {
        let (code, _, errors) = fly(&pieces, args);
        assert!(code == Some(2) && errors.contains(expected), "{args:?}: {errors}");
    }
}

#[test]
fn a_smoothed_campaign_shows_both_flights() {
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().join("flights");
    let at = out.to_str().expect("text");
    let fly = [
        "campaign", "--out", at, "--world", "budget", "--seeds", "1", "1", "--steps", "60",
    ];
    let (code, table, errors) = cslam(&[&fly[..], &["--smooth"]].concat());
    assert_eq!(code, Some(0), "{errors}");
    let titles = table
        .lines()
        .filter(|line| line.starts_with("budget, best, 1 flights"));
    let smoothed: Vec<bool> = titles.map(|title| title.contains("smoothed")).collect();
    assert_eq!(smoothed, [false, true], "{table}");
    let report = report(&out, "budget.best.outdoor.1.json");
    let position_m = |of: &serde_json::Value| {
        of["trajectory"]["position_rmse_m"]
            .as_f64()
            .expect("a trajectory")
    };
    let (on_board_m, smoothed_m) = (position_m(&report), position_m(&report["smoothed"]));
    println!("{on_board_m} m on board, {smoothed_m} m smoothed");
    assert!(smoothed_m < 0.8 * on_board_m);
}

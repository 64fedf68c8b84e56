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
        table.contains("budget, best, 1 flights") && table.contains("position, rms, m"),
        "{table}"
    );
    let first = one.join("budget.best.outdoor.1.json");
    let before = changed(&first);
    let (code, table, _) = fly(out, "2");
    assert!(code == Some(0) && table.contains("2 flights"), "{table}");
    assert_eq!(changed(&first), before, "flown again");
    let summary: serde_json::Value =
        serde_json::from_slice(&fs::read(one.join("summary.json")).expect("written")).expect("JSON");
    assert_eq!(summary["budget, best"]["flights"], 2);

    // The same flights in another directory: nothing differs. One that is put right is found.
    fs::create_dir(&other).expect("writable");
    fs::copy(&first, other.join("budget.best.outdoor.1.json")).expect("copied");
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
        errors.contains("another build") && errors.contains("budget.best.outdoor.1.json"),
        "{errors}"
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

//! What a measurement cannot say is refused in one line.

use super::*;

#[test]
fn what_a_measurement_cannot_say_is_refused_in_one_line() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path();
    let path = json!({"delay_s": 1e-7, "aoa_zenith_rad": 1.5, "aoa_azimuth_rad": 0.1});
    let line = json!({"tx": [0, 0, 2], "rx": [10, 0, 2], "paths": [path]});
    let with = |key: &str, value: Value| {
        let mut line = line.clone();
        line[key] = value;
        line
    };
    let of_path = |key: &str, value: Value| {
        let mut path = path.clone();
        path[key] = value;
        with("paths", json!([path]))
    };
    let without = |key: &str| {
        let mut line = line.clone();
        line.as_object_mut().expect("a line").remove(key);
        line
    };
    let (timed, earlier) = (with("time_s", json!(3.0)), with("time_s", json!(2.5)));
    for (command, lines, expected) in [
        (
            "solve",
            vec![without("rx")],
            "add the receiver (UAV)'s position, \"rx\":[x,y,z] in m",
        ),
        (
            "solve",
            vec![without("tx")],
            "add the transmitter (GMT)'s position, \"tx\":[x,y,z] in m",
        ),
        (
            "classify",
            vec![line.clone(), without("rx")],
            "mine.jsonl:2: `rx` is missing",
        ),
        (
            "solve",
            vec![with("time_s", json!(-1.0))],
            "mine.jsonl:1: `time_s` is -1",
        ),
        (
            "solve",
            vec![with("time_s", json!(1.7e9))],
            "expected seconds from the start of the flight",
        ),
        (
            "solve",
            vec![with("uav_quaternion_wb", json!([0, 0, 0, 0]))],
            "`uav_quaternion_wb`",
        ),
        (
            "solve",
            vec![with("frame", json!("ned"))],
            "expected \"world\" or \"body\"",
        ),
        (
            "solve",
            vec![of_path("aod_sigma_rad", json!(0.1))],
            "path 0: `aod_sigma_rad` needs",
        ),
        (
            "fly",
            vec![timed.clone(), line.clone()],
            "link 1 of the path list has no `time_s`",
        ),
        (
            "fly",
            vec![timed.clone(), earlier],
            "link 1 of the path list has `time_s` 2.5",
        ),
    ] {
        let text: Vec<String> = lines.iter().map(Value::to_string).collect();
        fs::write(at.join("mine.jsonl"), text.join("\n")).expect("writable");
        let error = refused(at, &[command, "--paths", "mine.jsonl"]);
        assert!(error.contains(expected), "{error}");
    }
    assert!(!at.join("out").exists(), "what is refused leaves nothing behind");
}

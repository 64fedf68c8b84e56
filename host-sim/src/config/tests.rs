//! The commented defaults are those in force, hold every key, and say the ranges that are enforced.

use std::collections::BTreeSet;

use super::*;

/// The defaults with everything that has none set as the comments show.
fn full_text() -> String {
    let is_key = |line: &str| {
        let rest = line.strip_prefix('#');
        rest.is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_lowercase() || c == '['))
    };
    DEFAULT
        .lines()
        .map(|line| if is_key(line) { &line[1..] } else { line })
        .map(|line| format!("{line}\n"))
        .collect()
}

fn parse(text: &str) -> Result<Config, String> {
    Config::parse(Path::new("c.toml"), text, None).map_err(|error| error.to_string())
}

#[test]
fn a_profile_fills_what_is_not_said() {
    for profile in [Profile::Ideal, Profile::Budget, Profile::Real] {
        let text = format!("[world]\nprofile = \"{}\"\n", profile.name());
        assert_eq!(parse(&text).expect("sound"), Config::of(profile));
        // The option counts, not the file.
        let asked = Config::parse(Path::new("c.toml"), &text, Some(Profile::Real));
        assert_eq!(asked.expect("sound"), Config::of(Profile::Real));
    }
    // Key by key, and without a profile it is the default one that fills.
    for (said, profile) in [
        ("", Profile::Real),
        ("world.profile = \"real\"\n", Profile::Real),
        ("world.profile = \"budget\"\n", Profile::Budget),
        ("world.profile = \"ideal\"\n", Profile::Ideal),
    ] {
        let text = format!(
            "{said}world.sensors.imu.vibration.rate_dps = [0.3, 0.2, 0.0]\nworld.flight.limits.tilt_deg = 20.0\n"
        );
        let mut expected = Config::of(profile);
        expected.world.sensors.imu.vibration.rate_dps = [0.3, 0.2, 0.0];
        expected.world.flight.limits.tilt_deg = 20.0;
        assert_eq!(parse(&text).expect("sound"), expected);
        assert_eq!(expected.world.propagation.diffraction, profile == Profile::Real);
        // And what a program writes of it, another one reads.
        let text = toml::to_string(&expected).expect("serialisable");
        assert_eq!(parse(&text).expect("own output"), expected);
    }
    let wrong =
        parse("world.profile = \"real\"\n[world.propagation]\nmax_order = 7\n").expect_err("too many");
    assert!(
        wrong.starts_with("c.toml:3: world.propagation.max_order is 7, expected 0 to 6"),
        "{wrong}"
    );
}

/// A key of the full text, and what its comment says.
struct Key<'a> {
    /// From the root, as messages have it.
    path: String,
    /// From 1.
    line: usize,
    name: &'a str,
    value: &'a str,
    unit: &'a str,
    range: &'a str,
}

fn keys(text: &str) -> Vec<Key<'_>> {
    let (mut table, mut keys) = (String::new(), Vec::new());
    for (number, line) in text.lines().enumerate() {
        if let Some(list) = line.strip_prefix("[[") {
            table = format!("{}[0]", list.trim_end_matches(']'));
        } else if let Some(name) = line.strip_prefix('[') {
            table = name.trim_end_matches(']').to_owned();
        } else if !line.is_empty() && !line.starts_with('#') {
            let (name, rest) = line.split_once(" = ").expect("a key");
            let (value, comment) = rest
                .split_once(" # ")
                .unwrap_or_else(|| panic!("{line}: no comment"));
            let (unit, range) = comment
                .split_once("; ")
                .unwrap_or_else(|| panic!("{line}: no range"));
            keys.push(Key {
                path: format!("{table}.{name}"),
                line: number + 1,
                name,
                value: value.trim(),
                unit,
                range,
            });
        }
    }
    keys
}

/// Every key that the types read, of lists of tables with `[0]`: asked of the types themselves, which tell whoever gives a key that
/// they do not know the ones that they do.
fn keys_of_types(header: &str, table: &str, found: &mut BTreeSet<String>) {
    let known = known_keys(header).unwrap_or_else(|| panic!("{header}: no table"));
    for name in known {
        let key = [table, &name].join(if table.is_empty() { "" } else { "." });
        let plain = key.replace("[0]", "");
        // A table first: a list can stand for one too, its first value for the first key.
        if known_keys(&format!("[{plain}]")).is_some() {
            keys_of_types(&format!("[{plain}]"), &key, found);
        } else if known_keys(&format!("[[{plain}]]")).is_some() {
            keys_of_types(&format!("[[{plain}]]"), &format!("{key}[0]"), found);
        } else {
            found.insert(key);
        }
    }
}

/// The keys of the table under a header, `None` when it is none.
fn known_keys(header: &str) -> Option<Vec<String>> {
    let error = toml::from_str::<Config>(&format!("{header}\nno_such_key = 0\n")).expect_err("no such key");
    let (_, known) = error
        .message()
        .split_once("unknown field `no_such_key`, expected ")?;
    Some(known.split('`').skip(1).step_by(2).map(str::to_owned).collect())
}

/// Every key of a value.
fn leaves_of(value: &toml::Value, path: &str, found: &mut BTreeSet<String>) {
    match value {
        toml::Value::Table(table) => {
            for (name, value) in table {
                let key = [path, name].join(if path.is_empty() { "" } else { "." });
                leaves_of(value, &key, found);
            }
        }
        toml::Value::Array(values) if values.iter().any(toml::Value::is_table) => {
            leaves_of(&values[0], &format!("{path}[0]"), found);
        }
        _ => {
            found.insert(path.to_owned());
        }
    }
}

#[test]
fn the_printed_defaults_are_the_defaults() {
    assert_eq!(parse(DEFAULT).expect("sound"), Config::default());
    assert_eq!(parse("").expect("sound"), Config::default());
    // And what a program writes, another one reads.
    let full = parse(&full_text()).expect("sound");
    assert_ne!(full, Config::default());
    for config in [full, Config::default()] {
        let text = toml::to_string(&config).expect("serialisable");
        assert_eq!(parse(&text).expect("own output"), config);
    }
}

#[test]
fn every_key_of_the_types_is_printed() {
    let mut of_types = BTreeSet::new();
    keys_of_types("", "", &mut of_types);
    assert!(of_types.len() > 150, "{}", of_types.len());
    let text = full_text();
    let printed: BTreeSet<String> = keys(&text).into_iter().map(|key| key.path).collect();
    let missing: Vec<_> = of_types.difference(&printed).collect();
    let made_up: Vec<_> = printed.difference(&of_types).collect();
    assert!(
        missing.is_empty() && made_up.is_empty(),
        "missing {missing:?}, made up {made_up:?}"
    );
    // Nothing is read under one name and written under another.
    let written = toml::Value::try_from(parse(&text).expect("sound")).expect("serialisable");
    let mut leaves = BTreeSet::new();
    leaves_of(&written, "", &mut leaves);
    assert_eq!(leaves, printed);
}

/// Values at the ends of a range, and just outside. A range of numbers is `A to B`, `above A to B`, `above A` or `A or more`.
fn ends(range: &str) -> Option<(Vec<f64>, Vec<f64>)> {
    let range = range.split(',').next()?;
    let (open, range) = match range.strip_prefix("above ") {
        Some(range) => (true, range),
        None => (false, range),
    };
    let (low, high) = match (range.split_once(" to "), range.strip_suffix(" or more")) {
        (Some((low, high)), _) => (low, Some(high)),
        (None, Some(low)) => (low, None),
        (None, None) if open => (range, None),
        (None, None) => return None,
    };
    let low: f64 = low.parse().ok()?;
    let high: Option<f64> = high.map(|high| high.parse().expect("a number"));
    let mut inside: Vec<f64> = high.into_iter().collect();
    let mut outside: Vec<f64> = high.map(|high| high + 1.0).into_iter().collect();
    if open {
        outside.push(low);
    } else {
        inside.push(low);
        outside.push(low - 1.0);
    }
    Some((inside, outside))
}

#[test]
fn the_printed_ranges_are_enforced_by_line_and_key() {
    // A filter is at most twice the data rate wide, and the least rate is 1 Hz.
    let text = full_text().replace("filter_hz = 200.0", "filter_hz = 0.0");
    let mut numbers = 0;
    for key in keys(&text) {
        let set = |value: &str| {
            let mut lines: Vec<&str> = text.lines().collect();
            let line = format!("{} = {value}", key.name);
            lines[key.line - 1] = &line;
            parse(&lines.join("\n"))
        };
        let refused = |value: &str| {
            let message = set(value).expect_err(&format!("{} = {value}", key.path));
            let place = format!("c.toml:{}: {}", key.line, key.path);
            assert!(message.starts_with(&place), "{message} instead of {place}");
            assert_eq!(message.lines().count(), 1, "{message}");
            message
        };
        let accepted = |value: &str| {
            if let Err(message) = set(value) {
                panic!("{} = {value} is refused: {message}", key.path);
            }
        };
        assert!(!key.unit.is_empty(), "{}: unit", key.path);
        let range = key.range.strip_prefix("each ").unwrap_or(key.range);
        let is_whole = !key.value.contains(['.', 'e', '"']);
        // A list keeps its length, an empty one gets one value.
        let written = |value: String| match (key.value.starts_with('['), key.value.split_once(',')) {
            (false, _) => value,
            (true, Some((_, rest))) => format!("[{value},{rest}"),
            (true, None) => format!("[{value}]"),
        };
        if let Some((inside, outside)) = ends(range) {
            numbers += 1;
            let number = |value: f64| {
                written(if is_whole {
                    format!("{value}")
                } else {
                    format!("{value:?}")
                })
            };
            inside.into_iter().for_each(|value| accepted(&number(value)));
            for value in outside.into_iter().map(number) {
                refused(&value);
            }
            if !is_whole {
                refused(&written("nan".into()));
                refused(&written("inf".into()));
            }
            refused(&written("\"one\"".into()));
        } else if let Some(choices) = range.strip_prefix("one of ") {
            let choices: BTreeSet<&str> = choices
                .split(", ")
                .map(|choice| choice.trim_matches('"'))
                .collect();
            for choice in &choices {
                accepted(&written(format!("\"{choice}\"")));
            }
            let message = refused(&written("\"none-such\"".into()));
            let (_, expected) = message.split_once("expected ").expect("what is expected");
            let known: BTreeSet<&str> = expected.split('`').skip(1).step_by(2).collect();
            assert_eq!(known, choices, "{}", key.path);
        } else {
            match range {
                "true or false" => drop(refused("1")),
                "a file" => drop(refused("1")),
                "a rotation" => drop(refused(&key.value.replace(|c: char| c.is_ascii_digit(), "0"))),
                "odd, 3 or more" => ["1", "4"].iter().for_each(|value| drop(refused(value))),
                "coprime to the length" => ["0", "818"].iter().for_each(|value| drop(refused(value))),
                "any number" => drop(refused("\"one\"")),
                "any numbers" => drop(refused("[\"one\", 0, 0]")),
                _ => panic!("{}: range \"{range}\"", key.path),
            }
        }
    }
    assert!(numbers > 120, "{numbers}");
}

#[test]
fn what_does_not_belong_is_named_with_its_line() {
    for (text, expected) in [
        (
            "\n[world.flight]\nduration = 3.0\n",
            "c.toml:3: unknown field `duration`, expected one of `duration_s`",
        ),
        (
            "[flight]\n",
            "c.toml:1: unknown field `flight`, expected one of `world`",
        ),
        (
            "world.sensors.imu.rate_hz = 999\n",
            "c.toml:1: world.sensors.imu.rate_hz is 999, expected a rate that divides",
        ),
        (
            "[path_errors]\n\n\naoa_deg = -1\n",
            "c.toml:4: path_errors.aoa_deg is -1, expected",
        ),
        (
            "[[world.sensors.faults.imu]]\nkind = \"stop\"\n",
            "c.toml:1: world.sensors.faults.imu[0]: missing field `start_s`",
        ),
        (
            "[receiver.magnetic_field]\nstrength_ut = 48.0\n",
            "c.toml:1: receiver.magnetic_field: missing field `inclination_deg`",
        ),
        (
            "[board]\nmount = [1, 2, -3]\n",
            "c.toml:2: board.mount: [1, 2, -3] is no rotation",
        ),
        ("[board\n", "c.toml:1: "),
    ] {
        let message = parse(text).expect_err(text);
        assert!(message.starts_with(expected), "{message}");
    }
}

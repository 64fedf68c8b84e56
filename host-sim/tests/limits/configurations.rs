//! Configurations out of range.

use super::*;

#[test]
fn configurations() {
    let fly: &[&str] = &["fly", "--config", "c.toml"];
    let record: &[&str] = &["record", "--config", "c.toml"];
    let synth: &[&str] = &[
        "synth",
        "--paths",
        "none.jsonl",
        "--out",
        "x",
        "--config",
        "c.toml",
    ];
    let check: &[&str] = &["config", "--check", "c.toml"];
    let image: &[&str] = &["key", "image", "uav.key", "x.bin", "--config", "c.toml"];
    all_refused(&[
        (
            "c.toml",
            "[board]\nmount = [1, 2, -3]\n".into(),
            image,
            "c.toml:2: board.mount: [1, 2, -3] is no rotation",
        ),
        (
            "c.toml",
            "[receiver]\n[receiver.filter.gates]\nlost_m = 0\n".into(),
            check,
            "c.toml:3: receiver.filter.gates.lost_m is 0, expected a number above 0",
        ),
        (
            "c.toml",
            "[world.flight]\n\nduration = 3\n".into(),
            fly,
            "c.toml:3: unknown field `duration`",
        ),
        (
            "c.toml",
            "[world.flight]\nduration_s = 1e6\n".into(),
            fly,
            "c.toml:2: world.flight.duration_s is 1000000",
        ),
        // Whichever world it is whose figures are changed.
        (
            "c.toml",
            "[world]\nprofile = \"budget\"\nmaterials = \"drawn\"\n".into(),
            fly,
            "c.toml:3: unknown field `materials`, expected one of `profile`",
        ),
        (
            "c.toml",
            "[world.scene.surfaces]\nrelief = 0.1\n".into(),
            &["fly", "--world", "budget", "--config", "c.toml"],
            "c.toml:2: unknown field `relief`, expected one of `surface_seed`",
        ),
        (
            "c.toml",
            "[world]\nprofile = \"ideal\"\n[world.scene.surfaces]\nground_relief_rms_m = -0.15\n".into(),
            record,
            "c.toml:4: world.scene.surfaces.ground_relief_rms_m is -0.15, expected 0 to 1",
        ),
        (
            "c.toml",
            "[world.scene.placement]\nmoved_m = [0, 1e6, 0]\n".into(),
            fly,
            "c.toml:2: world.scene.placement.moved_m holds 1000000, expected",
        ),
        (
            "c.toml",
            "[world]\nprofile = \"paper\"\n".into(),
            fly,
            "c.toml:2: world.profile: unknown variant `paper`",
        ),
        (
            "c.toml",
            "[path_errors]\naoa_deg = -1\n".into(),
            fly,
            "c.toml:2: path_errors.aoa_deg is -1",
        ),
        (
            "c.toml",
            "[world.sensors.imu]\nrate = 3\n".into(),
            record,
            "c.toml:2: unknown field `rate`",
        ),
        (
            "c.toml",
            "[world.channel.front_end]\nadc_bits = 99\n".into(),
            record,
            "c.toml:2: world.channel.front_end.adc_bits is 99",
        ),
        (
            "c.toml",
            "[world.channel.front_end]\nadc_bit = 12\n".into(),
            synth,
            "c.toml:2: unknown field `adc_bit`",
        ),
        (
            "c.toml",
            "#".repeat(limits::CONFIGURATION.bytes as usize + 1),
            fly,
            "c.toml: has more than 1048576 bytes",
        ),
    ]);
}

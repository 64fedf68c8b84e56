//! Localization on the emulated Cortex-M7 against the host: a recorded minute of flight, every bit of the state after every
//! sweep, and the instructions it took. Run by `cargo verify`, stage `flight`.

mod chip;
mod counts;

use cslam_core::localization::Localizer;
use cslam_firmware::flight_check;
use cslam_host_sim::flight::FlightConfig;
use cslam_host_sim::localization::{RecordedFlight, Scenario};
use cslam_host_sim::scene::Scene;
use cslam_host_sim::sensors::SensorsConfig;

const SEED: u64 = 6;

/// The recorded flight: a minute with a map, outages of the line of sight, and some faults of the inertial sensor and of
/// transport, so that their paths through the code are compared too.
fn recording() -> &'static [u8] {
    static BYTES: std::sync::OnceLock<Vec<u8>> = std::sync::OnceLock::new();
    BYTES.get_or_init(|| {
        let scene = Scene::load("outdoor").expect("built in");
        let flight = FlightConfig {
            duration_s: 60.0,
            ..FlightConfig::default()
        };
        let sensors = SensorsConfig {
            faults: toml::from_str(
                "[[imu]]\nkind = \"spike\"\nstart_s = 20.0\nduration_s = 30.0\nspikes_per_s = 2.0\n\
                 [[imu]]\nkind = \"stop\"\nstart_s = 52.0\nduration_s = 0.3\n\
                 [[transport]]\nevents = [\"imu\"]\nlost = 0.002\ndoubled = 0.002\n",
            )
            .expect("valid"),
            ..SensorsConfig::default()
        };
        let scenario = Scenario {
            map: Some((0.1, 0.2)),
            ..Scenario::default()
        };
        let flown = RecordedFlight::new(&scene, &flight, &sensors, &scenario, SEED).expect("a flight");
        assert_eq!(flown.truth.len(), 120);
        flown.to_bytes()
    })
}

/// What the host makes of it.
fn host<const N: usize>() -> String {
    let mut lines = String::new();
    let mut localizer = Box::new(Localizer::<f32, N>::new(&flight_check::config(), 0));
    flight_check::run(&mut recording(), &mut localizer, &mut (), &mut lines).expect("a sound recording");
    lines
}

/// Lines that differ, told shortly.
fn difference(host: &str, chip: &str) -> Option<String> {
    let (mut ours, mut theirs) = (host.lines(), chip.lines());
    loop {
        match (ours.next(), theirs.next()) {
            (None, None) => return None,
            (a, b) if a == b => {}
            (a, b) => {
                let words = |line: Option<&str>| -> Vec<String> {
                    line.unwrap_or("the end").split(' ').map(str::to_owned).collect()
                };
                let (a, b) = (words(a), words(b));
                let at = a
                    .iter()
                    .zip(&b)
                    .position(|(x, y)| x != y)
                    .unwrap_or(a.len().min(b.len()));
                let word = |w: &[String]| w.get(at).cloned().unwrap_or_else(|| "nothing".into());
                let head = a.iter().take(3).cloned().collect::<Vec<_>>().join(" ");
                return Some(format!(
                    "{head}: word {at} is {} on the host, {} on the chip",
                    word(&a),
                    word(&b)
                ));
            }
        }
    }
}

#[test]
fn the_chip_flies_the_bits_of_the_host() {
    let (host, chip) = (host::<58>(), chip::flown(58));
    // The beacon after the last of 120 sweeps is not heard any more.
    assert_eq!(host.lines().count(), 119);
    assert_eq!(difference(&host, &chip.lines), None, "{}", chip.log);
    // What was compared is worth comparing.
    for verdict in ["Started", "Accepted", "NoSight"] {
        assert!(
            host.contains(verdict),
            "{verdict} never occurs:\n{}",
            host.lines().last().unwrap_or("")
        );
    }
    let last = host.lines().last().expect("lines");
    println!("{}", last.split(" covariance").last().unwrap_or_default());
    let inertial = last.split("ImuCounters").last().unwrap_or_default();
    for counted in ["spikes: ", "missing: ", "repeated: ", "stops: "] {
        let count = inertial
            .split(counted)
            .nth(1)
            .and_then(|rest| rest.split(',').next());
        assert!(
            count.and_then(|c| c.parse::<u32>().ok()).is_some_and(|c| c > 0),
            "{counted}{count:?}"
        );
    }
}

#[test]
fn the_smaller_filter_too() {
    let (host, chip) = (host::<46>(), chip::flown(46));
    assert_eq!(difference(&host, &chip.lines), None, "{}", chip.log);
}

#[test]
fn one_bit_is_a_difference() {
    let host = host::<46>();
    let mut other = host.clone().into_bytes();
    let place = host.find("state ").expect("a state") + 12;
    other[place] ^= 1;
    let found = difference(&host, std::str::from_utf8(&other).expect("ASCII")).expect("they differ");
    assert!(found.starts_with("sweep 0"), "{found}");
    assert!(difference(&host, &host[..host.len() / 2]).is_some());
}

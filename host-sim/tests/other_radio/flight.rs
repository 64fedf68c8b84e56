//! Flights of other radios through scenes, with the figures that `cslam fly` reports, beside the default radio's.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use cslam_core::array::UavLayout;
use cslam_core::estimator::states;
use cslam_core::link_state::models;
use cslam_core::paths::{Estimator, EstimatorConfig};
use cslam_core::profile::{
    planar_8x8_gmt_72 as planar, quad_4x8_gmt_72 as default, quad_4x16_gmt_48 as quad,
};
use cslam_core::radio::RadioConfig;
use cslam_core::receiver::{Config, LinkStates, Localization, Memory, PATHS, Radio, Receiver};
use cslam_core::signal::BeamBlock;
use cslam_firmware::app::{AppConfig, Application, Map, VOXELS};
use cslam_firmware::front_end::{FrontEnd, SoftwareCrc};
use cslam_firmware::sensor_stream::SESSION;
use cslam_host_sim::channel::{self, GmtCounts};
use cslam_host_sim::config::{EarthField, ReceiverConfig};
use cslam_host_sim::evaluation::evaluate;
use cslam_host_sim::flight::{FlightConfig, Heading};
use cslam_host_sim::flight_log::Header;
use cslam_host_sim::raw_flight;
use cslam_host_sim::report::Report;
use cslam_host_sim::world::{Profile, World, WorldConfig};

const SEED: u64 = 3;
const SCENES: [&str; 2] = ["street", "outdoor"];

/// The receiver of a scene and a world as `cslam fly` sets it: it knows the earth's field, the ground's height and where the GMT was set up.
fn receiver_config<const ELEVATIONS: usize, const A: usize, const E: usize, const C: usize>(
    radio: RadioConfig<ELEVATIONS>,
    world: &World<'_, A, E, C>,
) -> Config<'static, RadioConfig<ELEVATIONS>> {
    let trees = models::trees().expect("the program's own");
    let mut config = Config::of(radio, LinkStates::Trees(trees));
    let flight = world.flight();
    let told = ReceiverConfig::default();
    let setup = told
        .gmt_setup
        .or_at(Some(flight.sweep_truth(0).gmt_position_m.into()));
    config.localization = Localization::Filter(told.filter.config(setup));
    config.magnetic_field = Some(EarthField::from(&flight.config().magnetometer).config());
    config.accept.point.ground_z_m = Some(world.ground_z_m() as f32);
    config
}

/// What became of a flight.
struct Flown {
    /// Sweeps with a pose.
    poses: usize,
    /// Sweeps that were to be flown.
    planned: usize,
    /// Beams that were not as strong as announced, or not in the order of their powers.
    contradicted: u32,
    report: Report,
}

/// Flies a radio through a scene: the counts are those of its estimator.
fn fly<
    R,
    const A: usize,
    const E: usize,
    const C: usize,
    const BEAMS: usize,
    const FACES: usize,
    const X: usize,
    const Z: usize,
    const MOST: usize,
    const ELEVATIONS: usize,
>(
    scene: &str,
    (profile, duration_s): (Profile, f64),
    radio: &RadioConfig<ELEVATIONS>,
) -> Flown
where
    R: for<'b> Radio<
            Estimator = Estimator<A, E, C, BEAMS, FACES, X, Z, MOST, PATHS>,
            Block<'b> = BeamBlock<'b, C>,
            Description = RadioConfig<ELEVATIONS>,
        >,
{
    let estimation = EstimatorConfig::of(radio);
    let mut estimator: Box<R::Estimator> = Box::new(Estimator::checked(&estimation).expect("a sound radio"));
    let begun = Instant::now();
    let of_profile = WorldConfig::of(profile);
    let config = WorldConfig {
        flight: FlightConfig {
            duration_s,
            heading: match radio.uav_arrays.layout {
                UavLayout::Around => Heading::Along,
                UavLayout::Planar { .. } => Heading::AtGmt,
            },
            ..of_profile.flight.clone()
        },
        ..of_profile
    };
    let scene = config.scene(scene).expect("built in");
    let scene = scene.at_frequency(radio.waveform.carrier_hz);
    let antennas = channel::Radio::new(radio, GmtCounts::default()).expect("a sound radio");
    let app = AppConfig {
        beams: u16::try_from(antennas.beams()).expect("few beams"),
        ..AppConfig::default()
    };
    let world = World::<A, E, C>::with_radio(&scene, antennas, config, SEED).expect("a flight");
    let config = receiver_config(*radio, &world);
    let mut squint = Box::new(
        config
            .beam_squint::<R>()
            .expect("as many symbols as the type says"),
    );
    let mut map = Box::new(Map::new());
    let memory = Memory {
        estimator: &mut *estimator,
        squint: &mut *squint,
        map: &mut *map,
    };
    let receiver: Receiver<'_, R, VOXELS> = Receiver::new(config, memory);
    let silent = FrontEnd::new(SoftwareCrc, SESSION);
    let mut application =
        Application::<'_, R, VOXELS, { states(2) }>::new(app, silent, raw_flight::ground(), receiver);
    let header = Header {
        mode: "best".into(),
        scene: scene.name().into(),
        world: Some(profile.name().into()),
        seed: SEED,
        planned_sweeps: world.sweeps() as usize,
        sweep_period_s: world.flight().plan().schedule().sweep_period_s,
        delay_cycle_m: Some(radio.waveform.delay_period().length_m()),
    };
    let never = AtomicBool::new(false);
    let (mut log, _) =
        raw_flight::fly(&world, &mut application, header, &never, |_| (), |_, _| ()).expect("it flies");
    let counters = application.counters();
    let evaluation = evaluate(&mut log, Some(&scene));
    Flown {
        poses: log.sweeps.iter().filter(|it| it.estimate.pose.is_some()).count(),
        planned: log.header.planned_sweeps,
        contradicted: counters.powers_contradicted + counters.beams_unordered,
        report: Report::new(&log, &evaluation, begun.elapsed().as_secs_f64()),
    }
}

/// A line of the table in docs/radio.md.
fn row(radio: &str, flown: &Flown) -> String {
    let Report {
        scene,
        world,
        trajectory,
        map,
        ..
    } = &flown.report;
    let number = |value: Option<f64>, scale: f64, places: usize| {
        value.map_or("-".into(), |value| format!("{:.places$}", scale * value))
    };
    [
        format!("`{radio}`"),
        scene.clone(),
        world.clone().unwrap_or_default(),
        format!("{} of {}", flown.poses, flown.planned),
        number(trajectory.position_rmse_m, 1.0, 3),
        number(trajectory.attitude_rmse_deg, 1.0, 3),
        map.accepted.to_string(),
        number(map.precision_by_faces, 100.0, 1),
        number(map.surface_rmse_m, 1.0, 3),
    ]
    .iter()
    .fold("|".into(), |row, cell| format!("{row} {cell} |"))
}

/// Prints what became of a flight, and checks it.
fn check(radio: &str, profile: Profile, flown: &Flown) {
    let Report {
        elapsed_s,
        sweeps,
        trajectory,
        map,
        ..
    } = &flown.report;
    let row = row(radio, flown);
    println!("{row} in {elapsed_s:.1} s");
    assert_eq!(*sweeps, flown.planned, "to the end: {row}");
    assert_eq!(flown.contradicted, 0, "{row}");
    if profile == Profile::Budget {
        assert!(10 * flown.poses > 8 * flown.planned, "{row}");
        assert!(
            trajectory.position_rmse_m.is_some_and(|rms_m| rms_m < 1.0),
            "{row}"
        );
        assert!(map.accepted > 100, "{row}");
        assert!(map.precision_by_faces.is_some_and(|share| share > 0.9), "{row}");
    }
}

/// Flies all radios through all scenes of a world for so long.
fn all(profile: Profile, duration_s: f64) {
    println!(
        "| radio | scene | world | sweeps with a pose | position, rms, m | attitude, rms, degrees | accepted points | on the right surface, % | map to surface, rms, m |"
    );
    for scene in SCENES {
        let world = (profile, duration_s);
        let flown = fly::<default::Radio, _, _, _, _, _, _, _, _, _>(scene, world, &RadioConfig::default());
        check("quad_4x8_gmt_72", profile, &flown);
        let flown = fly::<quad::Radio, _, _, _, _, _, _, _, _, _>(scene, world, &quad::radio());
        check("quad_4x16_gmt_48", profile, &flown);
        let flown = fly::<planar::Radio, _, _, _, _, _, _, _, _, _>(scene, world, &planar::radio());
        check("planar_8x8_gmt_72", profile, &flown);
    }
}

#[test]
fn other_radios_fly_through_scenes_with_the_error_budget() {
    all(Profile::Budget, 60.0);
}

#[test]
fn other_radios_fly_through_scenes_of_the_world_real_to_the_end() {
    all(Profile::Real, 30.0);
}

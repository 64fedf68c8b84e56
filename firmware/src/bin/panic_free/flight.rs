//! The whole application: everything that flies, from the drivers' samples to what the ground hears.

use core::hint::black_box;
use core::mem::MaybeUninit;

use cortex_m::singleton;
use cslam_core::estimator::states;
use cslam_core::link_state::models;
use cslam_core::paths::EstimatorConfig;
use cslam_core::profile::Radio;
use cslam_core::receiver::{Config, LinkStates, Memory, Receiver};
use cslam_core::telemetry::{Decoder, Key};
use cslam_firmware::app::{AppConfig, Application, Best, BoardStatus, Downlink, Ground, Map, VOXELS};
use cslam_firmware::front_end::{Block, FrontEnd, HEADER_LENGTH, SoftwareCrc};
use cslam_firmware::sensor_stream;

/// Flies on inputs of which the compiler knows nothing.
pub(crate) fn fly(block: &mut Block) -> Option<()> {
    let config = black_box(Config::best(LinkStates::Trees(models::trees().ok()?)));
    let place = singleton!(: MaybeUninit<Best> = MaybeUninit::uninit())?;
    let estimator = Best::init(place, &black_box(EstimatorConfig::default()), ());
    let squint = config.beam_squint::<Radio>().ok()?;
    let squint = singleton!(: cslam_core::beam_squint::BeamSquint = squint)?;
    let map = singleton!(: Map = Map::new())?;
    let memory = Memory {
        estimator,
        squint,
        map,
    };
    let cslam: Receiver<'_, Radio<Best>, VOXELS, { states(2) }> = Receiver::new(config, memory);
    let mut app = Application::new(
        black_box(AppConfig::default()),
        FrontEnd::new(SoftwareCrc, black_box(1)),
        Ground {
            downlink: Downlink::new(black_box(1), &black_box(Key::TEST), black_box(0)),
            uplink: Decoder::new(black_box(1), &black_box(Key::TEST)),
        },
        cslam,
    );
    loop {
        let observer = &mut ();
        black_box(
            app.record(&black_box([0; sensor_stream::LENGTH]), observer)
                .is_ok(),
        );
        black_box(app.frame(black_box(&[0; HEADER_LENGTH]), block, observer).is_ok());
        app.end(observer);
        app.set_status(black_box(BoardStatus::default()));
        black_box(app.downlink().take(&mut black_box([0; 64])));
        black_box(app.request());
        app.close();
        black_box((app.counters(), app.cslam().pose()));
    }
}

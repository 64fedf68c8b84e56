//! Links only while no panic can be reached from the flight path.
//!
//! The panic handler calls a function that exists nowhere. The compiler removes the handler when it can show that
//! nothing panics; as long as one bounds check, overflow check or `unwrap` remains, the linker ends with an undefined
//! symbol of that name. The image is for the flight controller's memory map, so a flight path that outgrows the chip
//! does not link either. It is made to be linked, not to be run: inputs are whatever the shared memory holds.
//!
//! A board's own image cannot pass, because its runtime and its log keep panics; what flies is checked here: the application, the
//! ring, packets of every kind, both ways, path
//! estimation from samples to paths in both modes, with its front end, link states from a model file and measured paths to the gate into the map, and the drivers of the library half.
#![no_std]
#![no_main]

#[path = "panic_free/drivers.rs"]
mod drivers;
#[path = "panic_free/flight.rs"]
mod flight;

use core::hint::black_box;
use core::panic::PanicInfo;

use cortex_m_rt::entry;
use cslam_core::geometry::{Body, Direction, GeometryError, Matrix3, Rotation, World};
use cslam_core::link_state::{AcceptGate, Classifier, LinkGeometry, Model, PaperClassifier, Received};
use cslam_core::path::Path;
use cslam_core::paths::{EstimatorConfig, PathEstimator};
use cslam_core::profile::PaperFlightEstimator;
use cslam_core::profile::quad_4x8_gmt_72::{CHANNELS, PATHS};
use cslam_core::reflection::{Ends, Form, solve};
use cslam_core::signal::{BeamBlock, Correlator, Detector, Iq, SAMPLES, Waveform, Workspace};
use cslam_core::telemetry::{Decoder, Key, MAX_FRAME, Opener, Sender, Uplink};
use cslam_firmware::front_end::Block;
use cslam_firmware::ring::{AccessError, Consumer, Producer, SharedMemory};
use cslam_firmware::sensor_stream;

/// Memory of which the compiler knows nothing.
struct Opaque;

impl SharedMemory for Opaque {
    fn size(&self) -> usize {
        black_box(0)
    }

    fn read(&self, offset: usize, bytes: &mut [u8]) -> Result<(), AccessError> {
        black_box((offset, bytes));
        black_box(Ok(()))
    }

    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), AccessError> {
        black_box((offset, bytes));
        black_box(Ok(()))
    }
}

#[entry]
fn main() -> ! {
    // Places of their own, so that the link also shows that they fit.
    let key = Key::new(black_box([0; Key::LENGTH]));
    let decoder = cortex_m::singleton!(: Decoder = Decoder::with(Opener::unsigned(0)));
    if let Some(decoder) = decoder {
        *decoder = Decoder::new(black_box(1), &key);
        exchange(decoder, &key);
    }
    let block = cortex_m::singleton!(: Block = [[Iq::ZERO; SAMPLES]; CHANNELS]);
    let work = cortex_m::singleton!(: Workspace = Workspace::new());
    if let (Some(block), Some(work)) = (block, work) {
        black_box(flight::fly(block).is_some());
        listen(&Correlator::new(&black_box(Waveform::default())), block, work);
        let config = black_box(EstimatorConfig::default());
        // One mode is active at a time; the default has its place in the application.
        if let Some(paper) = black_box(None::<&mut PaperFlightEstimator>) {
            *paper = PaperFlightEstimator::new(&config);
            estimate(paper, block);
        }
    }
    let path = black_box(None::<Received>);
    let ends = black_box(None::<Ends>);
    if let (Some(path), Some(ends)) = (path, ends) {
        black_box(classify(black_box(&[0; 4096]), &ends, &black_box([path; 9])));
    }
    drivers::drive();
    loop {
        cortex_m::asm::nop();
    }
}

/// Everything that passes through a ring, and packets of every kind, both ways.
fn exchange(decoder: &mut Decoder, key: &Key) {
    const SLOT: usize = sensor_stream::LENGTH;
    let mut up = Decoder::<Uplink>::new(black_box(1), key);
    let mut ground = Sender::<Uplink>::new(black_box(1), key, black_box(0));
    let mut record = black_box([0; SLOT]);
    let mut producer = Producer::<_, SLOT>::create(Opaque, black_box(1));
    let mut consumer = Consumer::<_, SLOT>::open(Opaque);
    loop {
        if let Ok(producer) = &mut producer {
            black_box(producer.push(&record).is_ok());
        }
        if let Ok(consumer) = &mut consumer {
            black_box(consumer.pop(&mut record).is_ok());
        }
        black_box(turn().is_ok());
        if let Some(Ok(heard)) = decoder.push(black_box(0)) {
            black_box(
                any_sender(key)
                    .encode(&heard.message, &mut [0; MAX_FRAME])
                    .is_ok(),
            );
        }
        if let Some(Ok(heard)) = up.push(black_box(0)) {
            if let Uplink::Beacon(beacon) = heard.message {
                black_box(beacon.to_beacon());
            }
            black_box(ground.encode(&heard.message, &mut [0; MAX_FRAME]).is_ok());
        }
        if black_box(false) {
            break;
        }
    }
}

/// A sender that takes any message: what a decoder gives goes back through the encoder, so all of both is kept.
fn any_sender(key: &Key) -> Sender {
    Sender::new(black_box(1), key, black_box(0))
}

/// Everything that the front end does with a beam.
fn listen(correlator: &Correlator, samples: &mut Block, work: &mut Workspace) {
    let detector = Detector::new(black_box(32), black_box(1e-2), black_box(30_000));
    black_box(correlator.spectrum(&black_box([Iq::ZERO; SAMPLES]), &mut [Iq::ZERO; SAMPLES], work));
    let beam = correlator.scale(BeamBlock {
        samples,
        beam: black_box(0),
        exponent: black_box(0),
    });
    black_box(beam.mean_power());
    black_box(detector.peak(correlator.detect(&beam, black_box(&[0; 8]), work).profile));
    let taps = correlator.correlate(beam, work);
    black_box(detector.peak(taps.profile()));
    black_box((taps.clips(), taps.exponent()));
    black_box(taps.into_block());
}

/// Everything that path estimation does with a sweep.
fn estimate<E: PathEstimator<CHANNELS, PATHS>>(estimator: &mut E, samples: &mut Block) {
    black_box(estimator.push_beam(BeamBlock {
        samples,
        beam: black_box(0),
        exponent: black_box(0),
    }));
    black_box(estimator.finish());
}

/// Everything from a model file and the paths of a link to what may enter the map. Gives how many paths may.
fn classify(file: &[u8], ends: &Ends, paths: &[Received]) -> Option<usize> {
    let model = Model::parse(file).ok()?;
    black_box(PaperClassifier::new(model).ok()?.link(paths).ok());
    let classifier = Classifier::new(model, Model::parse(file).ok()?).ok()?;
    let link = LinkGeometry::new(ends, paths, &Waveform::default()).ok()?;
    let gate = black_box(AcceptGate::default());
    let accepted = paths.iter().filter(|received| {
        let Ok(probabilities) = classifier.path(&link, received) else {
            return false;
        };
        black_box(probabilities.state());
        let solved = black_box(solve(ends, &received.path, black_box(Form::Vector), &gate.point));
        solved.is_ok() && probabilities.is_first_order(gate.min_probability)
    });
    Some(accepted.count())
}

/// A path of the array, turned from body to world axes.
fn turn() -> Result<Path<World>, GeometryError> {
    let [zenith_rad, azimuth_rad] = black_box([0.0; 2]);
    let attitude = Rotation::<Body, World>::from_quaternion(black_box([0.0; 4]))?;
    let path = Path::<Body> {
        c_tau_m: black_box(0.0),
        aoa: Direction::from_zenith_azimuth(zenith_rad, azimuth_rad)?,
        aod: None,
        covariance: black_box(Matrix3::zeros()),
    };
    Ok(path.to_world(&attitude, &black_box(Matrix3::zeros())))
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        fn a_panic_can_be_reached_from_the_flight_path() -> !;
    }
    // SAFETY: never called: there is no such function, so an image in which this call remains does not exist.
    unsafe { a_panic_can_be_reached_from_the_flight_path() }
}

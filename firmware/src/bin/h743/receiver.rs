//! The application's task: everything that comes in goes to it in order of time, everything it says goes to the radio.

use core::mem::MaybeUninit;
use core::sync::atomic::Ordering;

use cortex_m::peripheral::SCB;
use cslam_core::beam_squint::BeamSquint;
use cslam_core::estimator::states;
use cslam_core::link_state::models;
use cslam_core::paths::EstimatorConfig;
use cslam_core::profile::Radio;
use cslam_core::receiver::{Config, LinkStates, Memory, PATHS, Receiver, SweepReport};
use cslam_core::telemetry::{Decoder, Event, FaultRecord, Key, ResetCause};
use cslam_firmware::app::{
    AppConfig, Application, Best, BoardStatus, Downlink, Ground, Map, NO_REFERENCE, Observer, Request, Stage,
    VOXELS,
};
use cslam_firmware::board::{Baseband, Clock};
use cslam_firmware::front_end::{FrontEnd, Header};
use cslam_firmware::storage::{Ledger, StorageError};
use embassy_stm32::gpio::Output;
use embassy_time::{Duration, Instant, with_timeout};

use crate::baseband::{Link, LinkError};
use crate::checksum::CrcUnit;
use crate::flash::{FlashError, SettingsFlash};
use crate::uav_clock::UavClock;
use crate::{clocks, fault, inertial, magnetic, radio, stack, supervise};

/// The application of this board.
pub(crate) type App = Application<'static, Radio<Best>, VOXELS, { states(2) }, CrcUnit>;

/// Inertial samples wait this long for a sweep that may have begun before them, ns: a frame takes 1.64 ms to come.
const HOLD_NS: u64 = 20_000_000;
/// Longest time without looking at everything.
const ROUND: Duration = Duration::from_millis(2);
/// Between attempts to start the front end.
const RETRY: Duration = Duration::from_millis(500);
/// No frame for this long, and a new session is opened: a front end that has restarted sends none of its own accord.
const SILENCE: Duration = Duration::from_secs(3);
/// Between two looks at how the board is.
const STATUS: Duration = Duration::from_secs(1);

/// The parts of the board that the task has for itself.
pub(crate) struct Board {
    pub(crate) link: Link,
    pub(crate) clock: UavClock,
    /// What the program before this one left behind.
    pub(crate) left_behind: Option<FaultRecord>,
    /// Blinks with every sweep.
    pub(crate) green: Output<'static>,
    /// On while the front end is not there.
    pub(crate) red: Output<'static>,
    /// The settings, and where they are kept.
    pub(crate) ledger: Ledger<SettingsFlash>,
}

/// The application with every part in its place. `None` when the models in flash are damaged.
///
/// Each large part is built by a function of its own, never inlined: what it needs on the stack on the way to its place is given back
/// before the next one is built. In `main`, which never ends, it would stay there for ever.
#[inline(never)]
pub(crate) fn application(
    unit: CrcUnit,
    ledger: &Ledger<SettingsFlash>,
    key: &Key,
    reset: ResetCause,
) -> Option<&'static mut App> {
    let mut config = Config::best(LinkStates::Trees(models::trees().ok()?));
    let settings = ledger.settings();
    settings.configure(&mut config);
    let memory = Memory {
        estimator: estimator(&config)?,
        squint: squint(&config)?,
        map: map()?,
    };
    assembled(unit, ledger, key, reset, (config, memory))
}

/// The application of these parts.
#[inline(never)]
fn assembled(
    unit: CrcUnit,
    ledger: &Ledger<SettingsFlash>,
    key: &Key,
    reset: ResetCause,
    (config, memory): (Config<'static>, Memory<'static, Radio<Best>, VOXELS>),
) -> Option<&'static mut App> {
    let settings = ledger.settings();
    let front_end = FrontEnd::new(unit, settings.session);
    let mut downlink = Downlink::new(settings.uav, key, ledger.first_downlink());
    downlink.sender().allow(settings.downlink_counter);
    let ground = Ground {
        downlink,
        uplink: Decoder::with(ledger.opener(key)),
    };
    let config_of_app = AppConfig {
        reset,
        ..AppConfig::default()
    };
    let place = cortex_m::singleton!(: Option<App> = None)?;
    Some(place.insert(Application::new(
        config_of_app,
        front_end,
        ground,
        Receiver::new(config, memory),
    )))
}

#[inline(never)]
fn estimator(config: &Config<'_>) -> Option<&'static mut Best> {
    let place = cortex_m::singleton!(: MaybeUninit<Best> = MaybeUninit::uninit())?;
    Some(Best::init(place, &EstimatorConfig::of(&config.radio), ()))
}

#[inline(never)]
fn squint(config: &Config<'_>) -> Option<&'static mut BeamSquint> {
    let place = cortex_m::singleton!(: Option<BeamSquint> = None)?;
    Some(place.insert(config.beam_squint::<Radio>().ok()?))
}

#[inline(never)]
fn map() -> Option<&'static mut Map> {
    cortex_m::singleton!(: Map = Map::new())
}

/// Sees the work: where it stands, for a fault record, and every sweep, for a person's eye.
struct Watch {
    green: Output<'static>,
}

impl Observer for Watch {
    fn stage<R>(&mut self, stage: Stage, work: impl FnOnce() -> R) -> R {
        let before = fault::STAGE.swap(stage as u8, Ordering::Relaxed);
        let result = work();
        fault::STAGE.store(before, Ordering::Relaxed);
        // A sweep's end is several stages: each is progress.
        supervise::RECEIVER.mark();
        result
    }

    fn swept(&mut self, report: &SweepReport<PATHS>) {
        self.green.toggle();
        defmt::info!("sweep {=u32}: {=usize} paths", report.sweep, report.paths.len());
    }
}

/// Flies as long as the board runs.
#[embassy_executor::task]
pub(crate) async fn receive(app: &'static mut App, board: Board) -> ! {
    let Board {
        mut link,
        clock,
        left_behind,
        green,
        mut red,
        mut ledger,
    } = board;
    let mut watch = Watch { green };
    let mut front_end_due = Some(Instant::now());
    let mut last_frame = Instant::now();
    let mut status_due = Instant::now();
    let mut reboot = false;
    let mut busy_ns = 0;
    let mut degraded = false;
    if let Some(record) = left_behind {
        app.announce(Event::Reset(record));
    }
    loop {
        supervise::RECEIVER.mark();
        if clocks::are_degraded() {
            // Time is not the front end's any more: what still comes is of a session that has ended, and no new one is opened.
            if !degraded {
                degraded = true;
                app.front_end().reopen(ledger.settings().next_session());
                app.announce(Event::ConfigRefused(NO_REFERENCE));
                defmt::error!("clock: no reference: degraded, without the front end");
                red.set_high();
            }
            front_end_due = None;
            last_frame = Instant::now();
        }
        if let Some(due) = front_end_due
            && Instant::now() >= due
        {
            let session = ledger.settings().session;
            match link.open(session).await {
                Ok(()) => {
                    defmt::info!("front end: session {=u16} is open", session);
                    red.set_low();
                    front_end_due = None;
                    last_frame = Instant::now();
                }
                Err(error) => {
                    defmt::error!("{}", defmt::Display2Format(&error));
                    red.set_high();
                    front_end_due = Some(Instant::now() + RETRY);
                }
            }
        }
        if front_end_due.is_none() && last_frame.elapsed() >= SILENCE {
            match ledger.next_session() {
                Ok(session) => {
                    app.front_end().reopen(session);
                    defmt::warn!(
                        "front end: no frame for 3 s: does it hear the GMT? opening session {=u16}",
                        session
                    );
                    front_end_due = Some(Instant::now());
                }
                Err(error) => {
                    damaged(app, &error);
                    last_frame = Instant::now();
                }
            }
        }
        let frame = with_timeout(ROUND, link.frame()).await;
        let began_ns = clock.now_ns();
        match frame {
            Ok(Ok(filled)) => {
                last_frame = Instant::now();
                // A sweep needs the motion up to its beginning, and no further.
                if let Ok(header) = Header::decode(filled.header) {
                    inertial_samples(app, header.sweep_ns, &mut watch);
                }
                if let Err(error) = app.frame(filled.header, filled.samples, &mut watch) {
                    defmt::warn!("{}", defmt::Display2Format(&error));
                }
                link.release();
            }
            Ok(Err(LinkError::Cut(frames))) => {
                defmt::warn!("{}", LinkError::Cut(frames));
                (0..frames).for_each(|_| app.front_end().cut());
            }
            Ok(Err(error @ LinkError::Control(_))) => defmt::warn!("{}", defmt::Display2Format(&error)),
            Err(_nothing_came) => {}
        }
        let now_ns = clock.now_ns();
        inertial_samples(app, now_ns.saturating_sub(HOLD_NS), &mut watch);
        talk(app, now_ns, &mut ledger, &mut watch);
        if let Err(error) = ledger.tend() {
            damaged(app, &error);
        }
        reboot |= app.request() == Some(Request::Reboot);
        if reboot {
            let next = app.uplink_counter();
            match ledger.close(app.downlink().sender(), next) {
                // An erase ends in seconds.
                Err(StorageError::Busy) => {}
                closed => {
                    if let Err(error) = closed {
                        defmt::error!("{}", defmt::Display2Format(&error));
                    }
                    SCB::sys_reset();
                }
            }
        }
        busy_ns += clock.now_ns().saturating_sub(began_ns);
        if Instant::now() >= status_due {
            status_due = Instant::now() + STATUS;
            if let Err(error) = ledger.renew_downlink(app.downlink().sender()) {
                damaged(app, &error);
            }
            app.set_status(BoardStatus {
                load: busy_ns as f32 / STATUS.as_micros() as f32 * 1e-3,
                free_stack: stack::free(),
                imu_lost: inertial::LOST.load(Ordering::Relaxed),
                imu_damaged: inertial::DAMAGED.load(Ordering::Relaxed),
            });
            busy_ns = 0;
        }
    }
}

/// Samples of the inertial sensor and the magnetometer up to a time.
fn inertial_samples(app: &mut App, until_ns: u64, watch: &mut Watch) {
    while let Ok(sample) = inertial::SAMPLES.try_peek() {
        if sample.time_ns > until_ns {
            return;
        }
        let _the_one_just_seen = inertial::SAMPLES.try_receive();
        while let Ok((time_ns, field_ut)) = magnetic::SAMPLES.try_peek()
            && time_ns <= sample.time_ns
        {
            let _the_one_just_seen = magnetic::SAMPLES.try_receive();
            app.magnetometer(time_ns, &field_ut, watch);
        }
        app.imu(&sample, watch);
    }
}

/// Says that the settings' flash does not take what it is given; that it will do so a little later is nothing to say.
fn damaged(app: &mut App, error: &StorageError<FlashError>) {
    if matches!(error, StorageError::Busy) {
        return;
    }
    defmt::error!("{}", defmt::Display2Format(error));
    app.announce(Event::StorageDamaged(0));
}

/// Both ways of the radio, without waiting. Setting counters of the uplink aside is a write of 128 bytes, less than a millisecond.
fn talk(app: &mut App, now_ns: u64, ledger: &mut Ledger<SettingsFlash>, watch: &mut Watch) {
    let mut bytes = [0; 64];
    while let Ok(length) = radio::UP.try_read(&mut bytes) {
        let bytes = bytes.get(..length).unwrap_or_default();
        app.uplink(now_ns, bytes, |counter| ledger.reserve_uplink(counter), watch);
    }
    app.elapse(now_ns.saturating_sub(HOLD_NS), watch);
    while radio::DOWN.free_capacity() >= bytes.len() {
        let taken = app.downlink().take(&mut bytes);
        if taken == 0 {
            return;
        }
        let _all = radio::DOWN.try_write(bytes.get(..taken).unwrap_or_default());
    }
}

//! Feeds the watchdog while every task goes round, and ends the program when one does not.

use cslam_firmware::board::Clock;
use cslam_firmware::supervisor::{Progress, Supervisor, Watched};
use embassy_stm32::peripherals::IWDG1;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_time::{Duration, Timer};

use crate::uav_clock::UavClock;
use crate::{baseband, fault, inertial, log, radio};

/// The receiver goes round.
pub(crate) static RECEIVER: Progress = Progress::new();

/// The watchdog bites after this, us: a supervisor that does not run any more.
pub(crate) const WATCHDOG_US: u32 = 1_000_000;
const ROUND: Duration = Duration::from_millis(20);
const MS: u64 = 1_000_000;

/// Looks at every task as long as the board runs.
#[embassy_executor::task]
pub(crate) async fn supervise(mut watchdog: IndependentWatchdog<'static, IWDG1>, clock: UavClock) -> ! {
    let watched = |name, progress, ms: u64| Watched {
        name,
        progress,
        deadline_ns: ms * MS,
    };
    let tasks = [
        // Starting the sensor takes 50 ms, and 100 more when it fails.
        watched("inertial", &inertial::ROUND, 400),
        watched("capture", &baseband::CAPTURE, 400),
        watched("downlink", &radio::SENDING, 400),
        watched("uplink", &radio::RECEIVING, 400),
        // The end of a sweep takes up to 0.4 s.
        watched("receiver", &RECEIVER, 2000),
    ];
    let mut supervisor = Supervisor::new(tasks, clock.now_ns());
    watchdog.unleash();
    loop {
        match supervisor.check(clock.now_ns()) {
            Ok(()) => watchdog.pet(),
            Err(hung) => fault::hang(hung),
        }
        log::report_losses();
        Timer::after(ROUND).await;
    }
}

//! The magnetometer's task. A board may have none: it says so, and looks again now and then.

use cslam_firmware::board::Clock;
use cslam_firmware::mmc5983::{MagnetometerError, Mmc5983};
use cslam_firmware::storage::Mount;
use embassy_stm32::i2c::{I2c, Master};
use embassy_stm32::mode::Async;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Delay, Duration, Ticker, Timer};
use nalgebra::Vector3;

use crate::uav_clock::UavClock;

/// The sensor of this board.
pub(crate) type Sensor = Mmc5983<I2c<'static, Async, Master>>;

/// Samples on their way to the receiver, UAV clock (ns) and field in body axes (uT): more than a second of them. The receiver looks every
/// few milliseconds, and wants one a second.
pub(crate) static SAMPLES: Channel<CriticalSectionRawMutex, (u64, Vector3<f32>), 16> = Channel::new();

/// Between two samples.
const INTERVAL: Duration = Duration::from_millis(100);
/// Between two looks for a sensor that is not there.
const PAUSE: Duration = Duration::from_secs(10);
/// Failures in a row after which the sensor is started anew.
const FAILURES_MAX: u8 = 3;

/// Reads the sensor as long as the board runs. It sits like the inertial sensor.
#[embassy_executor::task]
pub(crate) async fn read(sensor: &'static mut Sensor, mount: Mount, clock: UavClock) -> ! {
    loop {
        match sensor.start(&mut Delay).await {
            Ok(()) => {
                defmt::info!("magnetometer: started");
                let error = measure(sensor, mount, clock).await;
                defmt::error!("{}; starting anew", defmt::Display2Format(&error));
            }
            Err(error) => {
                defmt::warn!("{}; flying without", defmt::Display2Format(&error));
                Timer::after(PAUSE).await;
            }
        }
    }
}

/// Measures until that keeps failing.
async fn measure(
    sensor: &mut Sensor,
    mount: Mount,
    clock: UavClock,
) -> MagnetometerError<embassy_stm32::i2c::Error> {
    let mut ticker = Ticker::every(INTERVAL);
    let mut failures = 0;
    loop {
        ticker.next().await;
        let began_ns = clock.now_ns();
        match sensor.measure(&mut Delay).await {
            Ok(sample) => {
                failures = 0;
                let middle_ns = began_ns.midpoint(clock.now_ns());
                let field_ut = mount.vector_to_body(&sample.field_ut);
                if SAMPLES.try_send((middle_ns, field_ut)).is_err() {
                    defmt::warn!("magnetometer: a sample found its queue full");
                }
            }
            Err(error) => {
                failures += 1;
                if failures >= FAILURES_MAX {
                    return error;
                }
                defmt::warn!("{}", defmt::Display2Format(&error));
            }
        }
    }
}

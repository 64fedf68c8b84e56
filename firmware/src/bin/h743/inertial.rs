//! The inertial sensor's task, above everything else but the clock.

use core::sync::atomic::{AtomicU32, Ordering};

use cslam_core::inertial::ImuSample;
use cslam_firmware::board::{Imu, Inertial};
use cslam_firmware::icm42688::{ImuCounters, Samples};
use cslam_firmware::storage::Mount;
use cslam_firmware::supervisor::Progress;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Delay, Duration, Timer, with_timeout};

use crate::bus::OnlyDevice;
use crate::uav_clock::ImuEdge;

/// The sensor of this board.
pub(crate) type Sensor = Inertial<OnlyDevice, ImuEdge, Delay>;

/// Samples on their way to the receiver: a quarter of a second of them.
pub(crate) static SAMPLES: Channel<CriticalSectionRawMutex, ImuSample, 256> = Channel::new();
/// The task goes round.
pub(crate) static ROUND: Progress = Progress::new();
/// Samples that the driver knows were lost, and that found the channel full.
pub(crate) static LOST: AtomicU32 = AtomicU32::new(0);
/// Damaged packets.
pub(crate) static DAMAGED: AtomicU32 = AtomicU32::new(0);

/// No edge for this long, and the sensor is started anew.
const SILENCE: Duration = Duration::from_millis(50);
/// Between attempts to start a sensor.
const PAUSE: Duration = Duration::from_millis(100);

/// Reads the sensor as long as the board runs.
#[embassy_executor::task]
pub(crate) async fn read(sensor: &'static mut Sensor, mount: Mount) -> ! {
    let mut samples = Samples::new();
    let mut overflowed = 0;
    let mut running = false;
    loop {
        ROUND.mark();
        if !running {
            match sensor.start().await {
                Ok(()) => {
                    defmt::info!("IMU: started");
                    running = true;
                }
                Err(error) => {
                    defmt::error!("{}", defmt::Display2Format(&error));
                    Timer::after(PAUSE).await;
                    continue;
                }
            }
        }
        match with_timeout(SILENCE, sensor.samples(&mut samples)).await {
            Ok(Ok(())) => {}
            Ok(Err(error)) => defmt::warn!("{}", defmt::Display2Format(&error)),
            Err(_) => {
                defmt::error!("IMU: no edge on INT1 for 50 ms: check its line; starting anew");
                running = false;
            }
        }
        for sample in &samples {
            let room = SAMPLES.try_send(mount.to_body(sample));
            overflowed += u32::from(room.is_err());
        }
        samples.clear();
        let ImuCounters { lost, damaged, .. } = sensor.counters();
        LOST.store(lost.saturating_add(overflowed), Ordering::Relaxed);
        DAMAGED.store(damaged, Ordering::Relaxed);
    }
}

//! The inertial sensor with its edge.

use core::fmt;

use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::digital::Wait;
use embedded_hal_async::spi::SpiDevice;

use super::Clock;
use crate::icm42688::{Icm42688, ImuCounters, ImuError, Samples};

/// Reads in a row that may fail before the sensor is started anew.
const FAILURES_MAX: u8 = 3;

/// The data-ready line of a sensor.
pub trait DataReady {
    /// Waits for the next edge, or gives one that has come since the last call; of several the newest. Its time by the UAV
    /// clock, ns.
    async fn edge(&mut self) -> u64;
}

/// A pin whose edges are stamped when the program gets to see them. The sensor's line through the edges takes out the jitter, but
/// not the mean, of that delay.
#[derive(Debug)]
pub struct EdgeOf<P, C> {
    /// The pin.
    pub pin: P,
    /// The UAV clock.
    pub clock: C,
}

impl<P: Wait, C: Clock> DataReady for EdgeOf<P, C> {
    async fn edge(&mut self) -> u64 {
        // A pin that cannot be waited for would make this a busy loop; the time-out of whoever calls ends it.
        if self.pin.wait_for_rising_edge().await.is_err() {
            core::future::pending::<()>().await;
        }
        self.clock.now_ns()
    }
}

/// An inertial sensor at 1 kHz.
pub trait Imu {
    /// What can fail; says what to do.
    type Error: fmt::Debug + fmt::Display;

    /// Starts the sensor, or starts it anew.
    ///
    /// # Errors
    /// When it does not answer as it should.
    async fn start(&mut self) -> Result<(), Self::Error>;

    /// Waits for samples, oldest first, in sensor axes.
    ///
    /// # Errors
    /// When they could not be read. Just call it again; when that keeps failing the sensor is started anew inside.
    async fn samples(&mut self, samples: &mut Samples) -> Result<(), Self::Error>;

    /// What became of the packets.
    fn counters(&self) -> ImuCounters;
}

/// An ICM-42688-P, its data-ready line, and what it takes to start it.
#[derive(Debug)]
pub struct Inertial<SPI, R, D> {
    sensor: Icm42688<SPI>,
    ready: R,
    delay: D,
    edge_ns: u64,
    more: bool,
    failures: u8,
    lost: bool,
}

impl<SPI: SpiDevice, R: DataReady, D: DelayNs> Inertial<SPI, R, D> {
    /// Puts them together.
    pub const fn new(sensor: Icm42688<SPI>, ready: R, delay: D) -> Self {
        Self {
            sensor,
            ready,
            delay,
            edge_ns: 0,
            more: false,
            failures: 0,
            lost: false,
        }
    }
}

impl<SPI: SpiDevice, R: DataReady, D: DelayNs> Imu for Inertial<SPI, R, D> {
    type Error = ImuError<SPI::Error>;

    async fn start(&mut self) -> Result<(), Self::Error> {
        self.more = false;
        self.failures = 0;
        self.lost = true;
        self.sensor.start(&mut self.delay).await?;
        self.lost = false;
        Ok(())
    }

    async fn samples(&mut self, samples: &mut Samples) -> Result<(), Self::Error> {
        samples.clear();
        if self.lost {
            return self.start().await;
        }
        if !self.more {
            self.edge_ns = self.ready.edge().await;
        }
        match self.sensor.read(self.edge_ns, samples).await {
            Ok(more) => {
                self.more = more;
                self.failures = 0;
                Ok(())
            }
            Err(error) => {
                self.more = false;
                self.failures = self.failures.saturating_add(1);
                self.lost = matches!(error, ImuError::Restarted) || self.failures >= FAILURES_MAX;
                Err(error)
            }
        }
    }

    fn counters(&self) -> ImuCounters {
        self.sensor.counters()
    }
}

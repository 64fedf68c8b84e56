//! The telemetry radio: USART2 at 57 600 baud, both ways by DMA.

use cslam_firmware::board::Downlink;
use cslam_firmware::supervisor::Progress;
use embassy_stm32::mode::Async;
use embassy_stm32::usart::{Config, RingBufferedUartRx, UartTx};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embassy_time::{Duration, Timer, with_timeout};
use embedded_io_async::{ErrorType, Write};

/// Bytes for the radio.
pub(crate) static DOWN: Pipe<CriticalSectionRawMutex, 1024> = Pipe::new();
/// Bytes from the radio.
pub(crate) static UP: Pipe<CriticalSectionRawMutex, 1024> = Pipe::new();
/// The tasks go round.
pub(crate) static SENDING: Progress = Progress::new();
/// See [`SENDING`].
pub(crate) static RECEIVING: Progress = Progress::new();

/// Longest time without a mark.
const ROUND: Duration = Duration::from_millis(100);
/// Bytes of a DMA: 22 ms of the line.
pub(crate) const CHUNK: usize = 128;
/// Bytes of the receiving ring: 178 ms of the line.
pub(crate) const RING: usize = 1024;

pub(crate) fn config() -> Config {
    let mut config = Config::default();
    config.baudrate = 57_600;
    config
}

/// The transmitter, with the buffer that its DMA reads.
pub(crate) struct Transmitter {
    pub(crate) uart: UartTx<'static, Async>,
    pub(crate) buffer: &'static mut [u8; CHUNK],
}

impl ErrorType for Transmitter {
    type Error = embassy_stm32::usart::Error;
}

impl Write for Transmitter {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> {
        let taken = bytes.len().min(CHUNK);
        if let (Some(place), Some(bytes)) = (self.buffer.get_mut(..taken), bytes.get(..taken)) {
            place.copy_from_slice(bytes);
            self.uart.write(place).await?;
        }
        Ok(taken)
    }

    async fn flush(&mut self) -> Result<(), Self::Error> {
        self.uart.flush().await
    }
}

/// Sends what is in the pipe as long as the board runs.
#[embassy_executor::task]
pub(crate) async fn send(mut radio: Transmitter) -> ! {
    let mut bytes = [0; CHUNK];
    loop {
        SENDING.mark();
        let Ok(length) = with_timeout(ROUND, DOWN.read(&mut bytes)).await else {
            continue;
        };
        let Some(bytes) = bytes.get(..length) else {
            continue;
        };
        if let Err(error) = radio.send(bytes).await {
            defmt::warn!("{}", defmt::Display2Format(&error));
        }
    }
}

/// Fills the pipe as long as the board runs. What the receiver does not take in time is lost, and the link's checksums tell.
#[embassy_executor::task]
pub(crate) async fn receive(mut radio: RingBufferedUartRx<'static>) -> ! {
    let mut bytes = [0; 64];
    loop {
        RECEIVING.mark();
        match with_timeout(ROUND, radio.read(&mut bytes)).await {
            Ok(Ok(length)) => {
                let mut rest = bytes.get(..length).unwrap_or_default();
                while let Ok(taken) = UP.try_write(rest) {
                    rest = rest.get(taken..).unwrap_or_default();
                    if rest.is_empty() {
                        break;
                    }
                }
            }
            Ok(Err(error)) => {
                defmt::warn!("uplink: {}: check the radio's baud rate", error);
                Timer::after(Duration::from_millis(1)).await;
            }
            Err(_) => {}
        }
    }
}

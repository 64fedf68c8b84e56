//! The SPI buses of this board, each with one device.

use embassy_stm32::gpio::Output;
use embassy_stm32::mode::Async;
use embassy_stm32::spi::Spi;
use embassy_stm32::spi::mode::Master;
use embassy_time::Delay;

/// A bus by DMA and the device's select line.
pub(crate) type OnlyDevice =
    cslam_firmware::board::OnlyDevice<Spi<'static, Async, Master>, Output<'static>, Delay>;

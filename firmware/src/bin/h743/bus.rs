//! An SPI bus with one device on it.

use embassy_stm32::gpio::Output;
use embassy_stm32::mode::Async;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{Error, Spi};
use embedded_hal_async::spi::{ErrorType, Operation, SpiDevice};

/// The bus and the device's select line.
pub(crate) struct OnlyDevice {
    pub(crate) bus: Spi<'static, Async, Master>,
    pub(crate) select: Output<'static>,
}

impl ErrorType for OnlyDevice {
    type Error = Error;
}

impl SpiDevice for OnlyDevice {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Error> {
        self.select.set_low();
        let result = self.run(operations).await;
        self.select.set_high();
        result
    }
}

impl OnlyDevice {
    async fn run(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Error> {
        for operation in operations {
            match operation {
                Operation::Read(bytes) => self.bus.read(bytes).await?,
                Operation::Write(bytes) => self.bus.write(bytes).await?,
                Operation::Transfer(read, write) => self.bus.transfer(read, write).await?,
                Operation::TransferInPlace(bytes) => self.bus.transfer_in_place(bytes).await?,
                Operation::DelayNs(ns) => embassy_time::Timer::after_nanos(u64::from(*ns)).await,
            }
        }
        Ok(())
    }
}

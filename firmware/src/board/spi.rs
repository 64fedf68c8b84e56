//! A device that has its SPI bus for itself.

use core::convert::Infallible;

use embedded_hal::digital::OutputPin;
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::spi::{ErrorType, Operation, SpiBus, SpiDevice};

/// A bus and the select line of the one device on it. The line is released whenever a transaction ends, also when its future is dropped
/// half-way, as a timeout does: a device that stayed selected would take the next transfer for the rest of this one.
#[derive(Debug)]
pub struct OnlyDevice<B, S, D> {
    bus: B,
    select: S,
    delay: D,
}

impl<B, S: OutputPin<Error = Infallible>, D> OnlyDevice<B, S, D> {
    /// Puts them together and deselects the device.
    pub fn new(bus: B, mut select: S, delay: D) -> Self {
        let Ok(()) = select.set_high();
        Self { bus, select, delay }
    }
}

/// Selected for as long as this lives.
struct Selected<'a, S: OutputPin<Error = Infallible>>(&'a mut S);

impl<'a, S: OutputPin<Error = Infallible>> Selected<'a, S> {
    fn new(select: &'a mut S) -> Self {
        let Ok(()) = select.set_low();
        Self(select)
    }
}

impl<S: OutputPin<Error = Infallible>> Drop for Selected<'_, S> {
    fn drop(&mut self) {
        let Ok(()) = self.0.set_high();
    }
}

impl<B: ErrorType, S, D> ErrorType for OnlyDevice<B, S, D> {
    type Error = B::Error;
}

impl<B: SpiBus, S: OutputPin<Error = Infallible>, D: DelayNs> SpiDevice for OnlyDevice<B, S, D> {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), B::Error> {
        let _selected = Selected::new(&mut self.select);
        for operation in operations {
            match operation {
                Operation::Read(bytes) => self.bus.read(bytes).await?,
                Operation::Write(bytes) => self.bus.write(bytes).await?,
                Operation::Transfer(read, write) => self.bus.transfer(read, write).await?,
                Operation::TransferInPlace(bytes) => self.bus.transfer_in_place(bytes).await?,
                Operation::DelayNs(ns) => {
                    self.bus.flush().await?;
                    self.delay.delay_ns(*ns).await;
                }
            }
        }
        self.bus.flush().await
    }
}

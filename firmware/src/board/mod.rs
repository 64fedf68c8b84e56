//! What a board gives the receiver: the seam between the library half and a chip.
//!
//! Five traits, none of which knows a chip. Each is there already for what the traits of the embedded ecosystem bring:
//!
//! | trait | for |
//! |---|---|
//! | [`Clock`] | the board's own timer |
//! | [`DataReady`] | [`EdgeOf`]: any pin of [`embedded_hal_async::digital::Wait`], stamped by software; a board with a timer that captures edges does better |
//! | [`Imu`] | [`Inertial`]: [`Icm42688`](crate::icm42688::Icm42688) over any [`embedded_hal_async::spi::SpiDevice`] |
//! | [`Baseband`] | the board's DMA, with [`Control`](crate::front_end::Control) over any SPI device for the registers |
//! | [`Downlink`] | anything that is [`embedded_io_async::Write`] |
//!
//! Settings and counters need none: [`Ledger`](crate::storage::Ledger) works over any [`embedded_storage::nor_flash::NorFlash`].

// Futures of a board run on its one executor and need not be `Send`.
#![allow(async_fn_in_trait)]

mod downlink;
mod inertial;
mod spi;

pub use downlink::{Downlink, DownlinkError};
pub use inertial::{DataReady, EdgeOf, Imu, Inertial};
pub use spi::OnlyDevice;

use core::fmt;

use crate::front_end::{Block, HEADER_LENGTH};

/// The UAV clock.
pub trait Clock {
    /// Time since some moment before the start, ns; never goes back.
    fn now_ns(&self) -> u64;
}

impl<C: Clock> Clock for &C {
    fn now_ns(&self) -> u64 {
        (**self).now_ns()
    }
}

/// A buffer with a frame, as the DMA left it. For [`FrontEnd::receive`](crate::front_end::FrontEnd::receive).
#[derive(Debug)]
pub struct Filled<'a> {
    /// The header's bytes.
    pub header: &'a [u8; HEADER_LENGTH],
    /// The samples.
    pub samples: &'a mut Block,
}

/// The capture front end, as far as a board sees it.
pub trait Baseband {
    /// What can fail; says what to do.
    type Error: fmt::Debug + fmt::Display;

    /// Starts the front end in a new session (never 0): frames that are under way belong to the one before.
    ///
    /// # Errors
    /// When the front end does not answer as the contract says.
    async fn open(&mut self, session: u16) -> Result<(), Self::Error>;

    /// Waits for the next frame. The buffer of the frame before goes back to the DMA.
    ///
    /// # Errors
    /// When a frame was cut: count it with [`FrontEnd::cut`](crate::front_end::FrontEnd::cut) and go on.
    async fn frame(&mut self) -> Result<Filled<'_>, Self::Error>;
}

//! Start and measurement, over an asynchronous I2C bus.
//!
//! Every transfer goes through the driver's own buffers: where the driver lies decides what the DMA must reach.

use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::i2c::I2c;
use nalgebra::Vector3;

use super::IDENTITY;
use super::error::MagnetometerError;
use super::{CODE_MAX, FIELD_PER_CODE_UT, ZERO_CODE};

/// Address on the bus.
const ADDRESS: u8 = 0x30;

/// Then the others: x, y, z, two bytes each with bits 17 to 2, and a byte with bits 1 and 0 of all three.
const OUTPUT: u8 = 0x00;
const STATUS: u8 = 0x08;
const CONTROL_0: u8 = 0x09;
const CONTROL_1: u8 = 0x0a;
const PRODUCT_ID: u8 = 0x2f;

/// STATUS: a measurement has ended; written, the bit is cleared.
const MEASURED: u8 = 1;
/// STATUS: the factory's trim has been read after a reset.
const TRIMMED: u8 = 1 << 4;
/// CONTROL_0: measure the field once.
const MEASURE: u8 = 1;
/// CONTROL_0: a pulse one way, and the other.
const SET: u8 = 1 << 3;
const RESET: u8 = 1 << 4;
/// CONTROL_1: start anew.
const START_ANEW: u8 = 1 << 7;
/// CONTROL_1: measure for 4 ms (200 Hz).
const BANDWIDTH: u8 = 1;

/// From the start anew until it answers, ms; the data sheet says 10.
const START_MS: u32 = 15;
/// A pulse lasts 500 ns; its capacitor is full again after 1 ms.
const PULSE_MS: u32 = 1;
/// A measurement takes this long, ms, and may be looked for this often in all, a millisecond apart.
const MEASURING_MS: u32 = 4;
const LOOKS: u32 = 5;

/// A sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// Field in sensor axes, uT, without the bridges' offset.
    pub field_ut: Vector3<f32>,
    /// The offset, uT: how the sensor is.
    pub offset_ut: Vector3<f32>,
}

/// The sensor.
#[derive(Debug)]
pub struct Mmc5983<I2C> {
    bus: I2C,
    sent: [u8; 2],
    received: [u8; 7],
}

impl<I2C: I2c> Mmc5983<I2C> {
    /// A sensor that has not been started. At most 400 kHz.
    pub const fn new(bus: I2C) -> Self {
        Self {
            bus,
            sent: [0; 2],
            received: [0; 7],
        }
    }

    /// Starts the sensor, or starts it anew, and sees that it is one. Takes 15 ms.
    ///
    /// # Errors
    /// [`MagnetometerError::Bus`] when nobody answers, [`MagnetometerError::Identity`], [`MagnetometerError::NoTrim`].
    pub async fn start(&mut self, delay: &mut impl DelayNs) -> Result<(), MagnetometerError<I2C::Error>> {
        self.write(CONTROL_1, START_ANEW).await?;
        delay.delay_ms(START_MS).await;
        let [found, ..] = self.read(PRODUCT_ID, 1).await?;
        if found != IDENTITY {
            return Err(MagnetometerError::Identity { found });
        }
        let [status, ..] = self.read(STATUS, 1).await?;
        if status & TRIMMED == 0 {
            return Err(MagnetometerError::NoTrim);
        }
        self.write(CONTROL_1, BANDWIDTH).await
    }

    /// Measures the field after either pulse. Takes 10 ms; the sample is of their middle.
    ///
    /// # Errors
    /// [`MagnetometerError::Bus`], [`MagnetometerError::NotMeasured`], [`MagnetometerError::Saturated`]. Just call it again; start
    /// the sensor anew when that keeps failing.
    pub async fn measure(
        &mut self,
        delay: &mut impl DelayNs,
    ) -> Result<Field, MagnetometerError<I2C::Error>> {
        let set = self.after(SET, delay).await?;
        let reset = self.after(RESET, delay).await?;
        // Exact: differences and sums of 18 bits.
        let half = |code: i32| code as f32 * (0.5 * FIELD_PER_CODE_UT);
        Ok(Field {
            field_ut: (set - reset).map(half),
            offset_ut: (set + reset).map(half),
        })
    }

    /// Codes after a pulse, from that of no field.
    async fn after(
        &mut self,
        pulse: u8,
        delay: &mut impl DelayNs,
    ) -> Result<Vector3<i32>, MagnetometerError<I2C::Error>> {
        self.write(CONTROL_0, pulse).await?;
        delay.delay_ms(PULSE_MS).await;
        // What the measurement before has left behind is not taken for this one's.
        self.write(STATUS, MEASURED).await?;
        self.write(CONTROL_0, MEASURE).await?;
        delay.delay_ms(MEASURING_MS).await;
        for _ in 0..LOOKS {
            let [status, ..] = self.read(STATUS, 1).await?;
            if status & MEASURED != 0 {
                return codes(self.read(OUTPUT, 7).await?);
            }
            delay.delay_ms(1).await;
        }
        Err(MagnetometerError::NotMeasured)
    }

    async fn write(&mut self, register: u8, value: u8) -> Result<(), MagnetometerError<I2C::Error>> {
        self.sent = [register, value];
        let sent = self.bus.write(ADDRESS, &self.sent).await;
        sent.map_err(MagnetometerError::Bus)
    }

    /// Reads `length` bytes, at most 7, from a register on.
    async fn read(&mut self, register: u8, length: usize) -> Result<[u8; 7], MagnetometerError<I2C::Error>> {
        let [place, ..] = &mut self.sent;
        *place = register;
        let sent = self.sent.get(..1).unwrap_or_default();
        let bytes = self.received.get_mut(..length).unwrap_or_default();
        let read = self.bus.write_read(ADDRESS, sent, bytes).await;
        read.map_err(MagnetometerError::Bus)?;
        Ok(self.received)
    }
}

/// The three codes of an output, from that of no field.
fn codes<E>([x1, x0, y1, y0, z1, z0, low]: [u8; 7]) -> Result<Vector3<i32>, MagnetometerError<E>> {
    let code = |high, middle, shift: u32| {
        u32::from(u16::from_be_bytes([high, middle])) << 2 | u32::from(low) >> shift & 3
    };
    let codes = [code(x1, x0, 6), code(y1, y0, 4), code(z1, z0, 2)];
    if codes.iter().any(|code| matches!(*code, 0 | CODE_MAX)) {
        return Err(MagnetometerError::Saturated { codes });
    }
    Ok(Vector3::from(codes).map(|code| code.cast_signed() - ZERO_CODE.cast_signed()))
}

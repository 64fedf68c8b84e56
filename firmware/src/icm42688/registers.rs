//! Registers and what is written to them (DS-000347, sections 13 to 17).

/// Read bit of the first byte of a transfer.
pub(super) const READ: u8 = 0x80;
/// Chooses the bank; the same place in every bank.
pub(super) const REG_BANK_SEL: u8 = 0x76;

// Bank 0.
pub(super) const DEVICE_CONFIG: u8 = 0x11;
pub(super) const INT_CONFIG: u8 = 0x14;
pub(super) const FIFO_CONFIG: u8 = 0x16;
/// Then the FIFO's count, two bytes, and its data: one transfer reads them all.
pub(super) const INT_STATUS: u8 = 0x2d;
pub(super) const SIGNAL_PATH_RESET: u8 = 0x4b;
pub(super) const INTF_CONFIG0: u8 = 0x4c;
pub(super) const INTF_CONFIG1: u8 = 0x4d;
pub(super) const PWR_MGMT0: u8 = 0x4e;
pub(super) const GYRO_CONFIG0: u8 = 0x4f;
pub(super) const ACCEL_CONFIG0: u8 = 0x50;
pub(super) const GYRO_CONFIG1: u8 = 0x51;
pub(super) const GYRO_ACCEL_CONFIG0: u8 = 0x52;
pub(super) const ACCEL_CONFIG1: u8 = 0x53;
pub(super) const TMST_CONFIG: u8 = 0x54;
pub(super) const FIFO_CONFIG1: u8 = 0x5f;
pub(super) const FIFO_CONFIG2: u8 = 0x60;
pub(super) const FIFO_CONFIG3: u8 = 0x61;
pub(super) const INT_CONFIG0: u8 = 0x63;
pub(super) const INT_CONFIG1: u8 = 0x64;
pub(super) const INT_SOURCE0: u8 = 0x65;
pub(super) const WHO_AM_I: u8 = 0x75;
// Bank 1.
pub(super) const GYRO_CONFIG_STATIC3: u8 = 0x0c;
pub(super) const GYRO_CONFIG_STATIC4: u8 = 0x0d;
pub(super) const GYRO_CONFIG_STATIC5: u8 = 0x0e;
// Bank 2.
pub(super) const ACCEL_CONFIG_STATIC2: u8 = 0x03;
pub(super) const ACCEL_CONFIG_STATIC3: u8 = 0x04;
pub(super) const ACCEL_CONFIG_STATIC4: u8 = 0x05;

/// Answer of an ICM-42688-P to WHO_AM_I.
pub(super) const IDENTITY: u8 = 0x47;
/// DEVICE_CONFIG: soft reset, SPI mode 0 and 3.
pub(super) const SOFT_RESET: u8 = 0x01;
/// INT_STATUS: the FIFO has overflowed.
pub(super) const STATUS_FIFO_FULL: u8 = 0x02;
/// INT_STATUS: a reset has ended since the last look.
pub(super) const STATUS_RESET_DONE: u8 = 0x10;
/// SIGNAL_PATH_RESET: empty the FIFO.
pub(super) const FIFO_FLUSH: u8 = 0x02;
/// FIFO_CONFIG: stream; the oldest packet makes room for the newest.
pub(super) const FIFO_STREAM: u8 = 0x40;
/// PWR_MGMT0: both sensors in low-noise mode, thermometer on.
pub(super) const LOW_NOISE: u8 = 0x0f;

/// A register's bank, place and value.
pub(super) type Setting = (u8, u8, u8);

/// What is written after a reset, while both sensors are off, in this order. Bank 0 last, so that it stays chosen.
pub(super) const SETTINGS: [Setting; 22] = [
    // Anti-alias filters at 258 Hz (table of section 5.2: 6, 36, 10), below half the data rate.
    (1, GYRO_CONFIG_STATIC3, 6),
    (1, GYRO_CONFIG_STATIC4, 36),
    (1, GYRO_CONFIG_STATIC5, 10 << 4),
    (2, ACCEL_CONFIG_STATIC2, 6 << 1),
    (2, ACCEL_CONFIG_STATIC3, 36),
    (2, ACCEL_CONFIG_STATIC4, 10 << 4),
    // INT1: pulses, push-pull, active high.
    (0, INT_CONFIG, 0x03),
    // The FIFO counts packets, big-endian; invalid samples are marked; no I2C.
    (0, INTF_CONFIG0, 0x73),
    // Clock from the PLL when there is one; the full scale is not changed behind our back.
    (0, INTF_CONFIG1, 0x51),
    // 2000 deg/s and 16 g, 1 kHz.
    (0, GYRO_CONFIG0, 0x06),
    (0, ACCEL_CONFIG0, 0x06),
    // Filters behind the anti-alias filter: of second order (as after a reset), at half the data rate: least delay. `timebase` takes out
    // the delay of both.
    (0, GYRO_CONFIG1, 0x16),
    (0, GYRO_ACCEL_CONFIG0, 0x00),
    (0, ACCEL_CONFIG1, 0x0d),
    // Absolute time stamps in the finer of the two resolutions (TMST_RES = 0): "1 us", which without CLKIN is 32/30 us.
    (0, TMST_CONFIG, 0x21),
    // 20-bit packets of both sensors and temperature; the watermark interrupts with every sample beyond it.
    (0, FIFO_CONFIG1, 0x37),
    // Watermark: one packet. So the edge says when the newest sample was ready.
    (0, FIFO_CONFIG2, 1),
    (0, FIFO_CONFIG3, 0),
    // Interrupts are cleared by reading INT_STATUS.
    (0, INT_CONFIG0, 0x00),
    // Pulses of 100 us; "asynchronous reset" off, as the data sheet asks.
    (0, INT_CONFIG1, 0x00),
    // INT1: watermark.
    (0, INT_SOURCE0, 0x04),
    (0, FIFO_CONFIG, 0x00),
];

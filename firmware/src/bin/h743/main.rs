//! The receiver on an STM32H743 (NUCLEO-H743ZI2, or a board wired like it: docs/board.md).
//!
//! Three levels, each of which interrupts the one below:
//!
//! | level | tasks |
//! |---|---|
//! | interrupt executor on UART8, priority 4 | [`inertial::read`]: FIFO of the sensor at each edge, 1 kHz |
//! | interrupt executor on UART7, priority 8 | [`baseband::capture`], [`radio::send`], [`radio::receive`], [`magnetic::read`], [`supervise::supervise`]: each some microseconds |
//! | thread | [`receiver::receive`]: the application, milliseconds at a time |
//!
//! Above them the clock (TIM2, priority 1) and what the drivers do in their own interrupts. Nothing waits for the level
//! below: samples go through a bounded channel whose drops are counted, frames through three buffers that go round, bytes
//! through pipes.
#![no_std]
#![no_main]

mod baseband;
mod bus;
mod checksum;
mod clocks;
mod fault;
mod flash;
#[path = "../armv7m/hard_fault.rs"]
mod hard_fault;
mod inertial;
mod magnetic;
mod memory;
#[path = "../armv7m/protect.rs"]
mod protect;
mod radio;
mod receiver;
mod stack;
mod supervise;
mod uav_clock;

use cortex_m_rt::entry;
use cslam_core::telemetry::Key;
use cslam_firmware::board::{Inertial, Storage};
use cslam_firmware::clock::Plan;
use cslam_firmware::fault::FaultRecord;
use cslam_firmware::front_end::Control;
use cslam_firmware::icm42688::Icm42688;
use cslam_firmware::mmc5983::Mmc5983;
use cslam_firmware::storage::{Settings, Store};
use defmt_rtt as _;
use embassy_executor::{Executor, InterruptExecutor};
use embassy_stm32::dcmi::{self, Dcmi};
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::i2c::{self, I2c};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{self, Uart};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{bind_interrupts, dma, peripherals};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::zerocopy_channel::Channel;
use embassy_time::Delay;

use baseband::Link;
use bus::OnlyDevice;
use checksum::CrcUnit;
use fault::faulted;
use flash::SettingsFlash;
use memory::{FrameBuffer, in_sram3};
use receiver::Board;

bind_interrupts!(struct Irqs {
    DMA1_STREAM0 => dma::InterruptHandler<peripherals::DMA1_CH0>;
    DMA1_STREAM1 => dma::InterruptHandler<peripherals::DMA1_CH1>;
    DMA1_STREAM2 => dma::InterruptHandler<peripherals::DMA1_CH2>;
    DMA1_STREAM3 => dma::InterruptHandler<peripherals::DMA1_CH3>;
    DMA1_STREAM4 => dma::InterruptHandler<peripherals::DMA1_CH4>;
    DMA1_STREAM5 => dma::InterruptHandler<peripherals::DMA1_CH5>;
    DMA2_STREAM0 => dma::InterruptHandler<peripherals::DMA2_CH0>;
    DCMI => dcmi::InterruptHandler<peripherals::DCMI>;
    DMA2_STREAM6 => dma::InterruptHandler<peripherals::DMA2_CH6>;
    DMA2_STREAM7 => dma::InterruptHandler<peripherals::DMA2_CH7>;
    I2C1_EV => i2c::EventInterruptHandler<peripherals::I2C1>;
    I2C1_ER => i2c::ErrorInterruptHandler<peripherals::I2C1>;
    USART2 => usart::InterruptHandler<peripherals::USART2>;
});

static ABOVE: InterruptExecutor = InterruptExecutor::new();
static BETWEEN: InterruptExecutor = InterruptExecutor::new();

/// Runs the executor of the inertial sensor.
#[embassy_stm32::interrupt]
unsafe fn UART8() {
    // SAFETY: the interrupt that `ABOVE` was started on.
    unsafe { ABOVE.on_interrupt() }
}

/// Runs the executor of everything that is short.
#[embassy_stm32::interrupt]
unsafe fn UART7() {
    // SAFETY: the interrupt that `BETWEEN` was started on.
    unsafe { BETWEEN.on_interrupt() }
}

/// Records that must fit before an erase, so that none comes in flight.
const ROOM: u32 = 64;

#[entry]
fn main() -> ! {
    clocks::start_watchdog();
    let left_behind = fault::take();
    let Some(mut core) = cortex_m::Peripherals::take() else {
        panic!("`main` runs once")
    };
    memory::set_up(&mut core.MPU, &mut core.SCB, &mut core.CPUID);
    let plan = clocks::plan();
    let chip = embassy_stm32::init(clocks::config(plan));
    clocks::watch_reference(plan);
    let cause = fault::reset_cause(left_behind.as_ref());
    greet(left_behind.as_ref(), plan);

    let mut red = Output::new(chip.PB14, Level::Low, Speed::Low);
    let mut store = match Store::open(SettingsFlash::new(chip.FLASH)) {
        Ok(store) => store,
        Err(error) => refuse(&mut red, defmt::Display2Format(&error)),
    };
    let (settings, key) = match prepare(&mut store) {
        Ok(prepared) => prepared,
        Err(Unfit::Storage(error)) => refuse(&mut red, defmt::Display2Format(&error)),
        Err(Unfit::NoKey) => refuse(
            &mut red,
            "there is no key: write the settings (docs/board.md section 4)",
        ),
    };

    let (clock, edge, sync) = uav_clock::start(plan.timer_hz(), chip.TIM2, chip.PA0, chip.PB10);
    let mut speed = spi::Config::default();
    speed.frequency = Hertz(15_000_000);
    speed.gpio_speed = Speed::High;
    let imu_bus = OnlyDevice {
        bus: Spi::new(
            chip.SPI4,
            chip.PE12,
            chip.PE14,
            chip.PE13,
            chip.DMA1_CH0,
            chip.DMA1_CH1,
            Irqs,
            speed,
        ),
        select: Output::new(chip.PE11, Level::High, Speed::High),
    };
    let control_bus = OnlyDevice {
        bus: Spi::new(
            chip.SPI5,
            chip.PF7,
            chip.PF9,
            chip.PF8,
            chip.DMA1_CH2,
            chip.DMA1_CH3,
            Irqs,
            speed,
        ),
        select: Output::new(chip.PF6, Level::High, Speed::High),
    };
    let sensor = in_sram3!(inertial::Sensor = Inertial::new(Icm42688::new(imu_bus), edge, Delay));
    let control = in_sram3!(Control<OnlyDevice> = Control::new(control_bus));

    let mut bus = i2c::Config::default();
    bus.frequency = Hertz(400_000);
    let bus = I2c::new(
        chip.I2C1,
        chip.PB8,
        chip.PB9,
        chip.DMA2_CH6,
        chip.DMA2_CH7,
        Irqs,
        bus,
    );
    let magnetometer = in_sram3!(magnetic::Sensor = Mmc5983::new(bus));

    let mut camera = dcmi::Config::default();
    camera.vsync_level = dcmi::VSyncDataInvalidLevel::Low;
    camera.hsync_level = dcmi::HSyncDataInvalidLevel::Low;
    camera.pixclk_polarity = dcmi::PixelClockPolarity::RisingEdge;
    let camera = Dcmi::new_8bit(
        chip.DCMI,
        chip.DMA2_CH0,
        Irqs,
        chip.PC6,
        chip.PC7,
        chip.PC8,
        chip.PC9,
        chip.PE4,
        chip.PD3,
        chip.PE5,
        chip.PE6,
        chip.PG9,
        chip.PA4,
        chip.PA6,
        camera,
    );
    let ready = Output::new(chip.PG12, Level::Low, Speed::High);

    let Ok(uart) = Uart::new(
        chip.USART2,
        chip.PD6,
        chip.PD5,
        chip.DMA1_CH4,
        chip.DMA1_CH5,
        Irqs,
        radio::config(),
    ) else {
        panic!("57 600 baud cannot be made of the clock")
    };
    let (transmitter, receiver) = uart.split();
    let transmitter = radio::Transmitter {
        uart: transmitter,
        buffer: in_sram3!([u8; radio::CHUNK] = [0; radio::CHUNK]),
    };
    let receiver = receiver.into_ring_buffered(in_sram3!([u8; radio::RING] = [0; radio::RING]));

    // SAFETY: `main` runs once.
    let buffers = unsafe { memory::frames() };
    let unit = match buffers.first_mut() {
        Some(buffer) => CrcUnit::new(chip.CRC, &mut buffer.samples),
        None => panic!("there are three buffers"),
    };
    let frames =
        once(cortex_m::singleton!(: Option<Channel<'static, CriticalSectionRawMutex, FrameBuffer>> = None));
    let (filling, filled) = frames.insert(Channel::new(buffers)).split();
    let link = Link::new(control, sync, clock, filled);
    let board = Board {
        link,
        clock,
        left_behind: left_behind.map(|record| record.report()),
        green: Output::new(chip.PB0, Level::Low, Speed::Low),
        red,
        store,
        settings,
    };
    let application = match receiver::application(unit, &board.settings, &key, cause) {
        Some(application) => application,
        None => panic!("the models in flash are damaged"),
    };
    let mount = board.settings.mount;
    let watchdog = IndependentWatchdog::new(chip.IWDG1, supervise::WATCHDOG_US);

    interrupt::UART8.set_priority(Priority::P4);
    let above = ABOVE.start(interrupt::UART8);
    interrupt::UART7.set_priority(Priority::P8);
    let between = BETWEEN.start(interrupt::UART7);
    above.spawn(inertial::read(sensor, mount).unwrap());
    between.spawn(baseband::capture(camera, ready, filling, core.SCB).unwrap());
    between.spawn(magnetic::read(magnetometer, mount, clock).unwrap());
    between.spawn(radio::send(transmitter).unwrap());
    between.spawn(radio::receive(receiver).unwrap());
    between.spawn(supervise::supervise(watchdog, clock).unwrap());
    let executor = once(cortex_m::singleton!(: Executor = Executor::new()));
    executor.run(|spawner| spawner.spawn(receiver::receive(application, board).unwrap()))
}

/// Says what this is, what it runs by, and what the program before it left behind.
fn greet(left_behind: Option<&FaultRecord>, plan: Plan) {
    let [major, minor, patch] = cslam_firmware::app::FIRMWARE;
    defmt::info!(
        "cslam {=u8}.{=u8}.{=u8} on STM32H743 revision {}, {=u32} MHz",
        major,
        minor,
        patch,
        defmt::Display2Format(&plan.revision),
        plan.core_hz() / 1_000_000
    );
    if plan.is_degraded() {
        defmt::error!(
            "clock: no reference at OSC_IN for 3 s: check REF; running degraded by HSI, without the front end"
        );
    }
    if let Some(record) = left_behind {
        defmt::error!("the program before ended: {}", defmt::Display2Format(record));
    }
}

/// Why a board does not fly.
enum Unfit {
    Storage(<Store<SettingsFlash> as Storage>::Error),
    NoKey,
}

/// The settings of this start and the link's key: the session is a new one, and counters of the downlink are set aside beyond all that
/// was sent before.
fn prepare(store: &mut Store<SettingsFlash>) -> Result<(Settings, Key), Unfit> {
    let mut settings = store.load().map_err(Unfit::Storage)?;
    if store.refused() > 0 {
        defmt::warn!(
            "storage: {=u32} damaged records were passed over",
            store.refused()
        );
    }
    let bytes = settings.key.ok_or(Unfit::NoKey)?;
    store.make_room(ROOM).map_err(Unfit::Storage)?;
    let first = settings.downlink_counter;
    settings.session = settings.next_session();
    settings.downlink_counter = first.saturating_add(receiver::RESERVE);
    store.save(&settings).map_err(Unfit::Storage)?;
    let key = Key::new(bytes);
    if key.is_test() {
        defmt::warn!("the key is the published one: anybody can forge what it signs");
    }
    Ok((settings, key))
}

/// Blinks red and says why, for ever: a board that cannot fly must not look as if it did.
fn refuse(red: &mut Output<'static>, why: impl defmt::Format) -> ! {
    loop {
        clocks::feed_watchdog();
        defmt::error!("{}", why);
        red.toggle();
        embassy_time::block_for(embassy_time::Duration::from_millis(500));
    }
}

/// What a singleton gives the first time; it is asked for once.
fn once<T>(place: Option<&'static mut T>) -> &'static mut T {
    match place {
        Some(place) => place,
        None => panic!("a singleton was taken twice"),
    }
}

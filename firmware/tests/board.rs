//! The seams of a board, over mocks of what the ecosystem's traits bring.

#[path = "common/block_on.rs"]
mod block_on;

use std::cell::{Cell, RefCell};
use std::convert::Infallible;
use std::future::{Future, pending};
use std::pin::pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

use block_on::block_on;
use cslam_firmware::board::{Clock, DataReady, Downlink, DownlinkError, EdgeOf, Imu, Inertial, OnlyDevice};
use cslam_firmware::front_end::{Control, ControlError, Status};
use cslam_firmware::icm42688::{Icm42688, ImuError, RawSample, Samples};
use embedded_hal::digital::{self, OutputPin};
use embedded_hal_async::spi::{self, SpiBus, SpiDevice};
use embedded_hal_mock::eh1::delay::NoopDelay;
use embedded_hal_mock::eh1::digital::{Edge, Mock as Pin, Transaction as PinEvent};
use embedded_hal_mock::eh1::spi::{Mock as Spi, Transaction};
use embedded_io_async::{ErrorKind, ErrorType, Write};

fn transfer(sent: &[u8], received: &[u8]) -> [Transaction<u8>; 3] {
    [
        Transaction::transaction_start(),
        Transaction::transfer_in_place(sent.to_vec(), received.to_vec()),
        Transaction::transaction_end(),
    ]
}

fn read(register: u8, value: u32) -> [Transaction<u8>; 3] {
    let mut received = vec![0xaa, 0xaa];
    received.extend(value.to_le_bytes());
    transfer(&[register | 0x80, 0, 0, 0, 0, 0], &received)
}

fn set(register: u8, value: u32, holds: u32) -> Vec<Transaction<u8>> {
    let mut sent = vec![register, 0];
    sent.extend(value.to_le_bytes());
    [transfer(&sent, &[0; 6]), read(register, holds)].concat()
}

const ID: u32 = 0x4546_5343;

fn prepare() -> Vec<Transaction<u8>> {
    [
        read(0, ID).to_vec(),
        read(1, 2).to_vec(),
        set(2, 0, 0),
        set(3, 9, 9),
        set(4, 72 | 33 << 16, 72 | 33 << 16),
        set(0x0c, 12, 12),
        set(7, 400_000, 400_000),
        set(5, 0x89ab_cdef, 0x89ab_cdef),
        set(6, 0x0123_4567, 0x0123_4567),
    ]
    .concat()
}

#[test]
fn the_front_end_is_started_register_by_register() {
    let expected = [prepare(), read(9, 1).to_vec(), set(2, 1, 1), read(8, 6).to_vec()].concat();
    let mut bus = Spi::new(&expected);
    let mut control = Control::new(bus.clone());
    assert_eq!(
        block_on(control.prepare(9, 0x0123_4567_89ab_cdef, 400_000)),
        Ok(())
    );
    assert_eq!(block_on(control.run()), Ok(()));
    assert_eq!(
        block_on(control.status()),
        Ok(Status(Status::UNLOCKED | Status::UNTIMED))
    );
    bus.done();
}

#[test]
fn a_front_end_that_does_not_keep_to_the_contract_is_not_run() {
    let set_up = prepare();
    // What comes before the register of the pilots is set, three transactions a transfer.
    let before_pilots = set_up[..3 * 8].to_vec();
    let cases: [(Vec<Transaction<u8>>, ControlError<_>, &str); 7] = [
        (
            read(0, 0).to_vec(),
            ControlError::Identity { found: 0 },
            "nobody answers",
        ),
        (
            read(0, u32::MAX).to_vec(),
            ControlError::Identity { found: u32::MAX },
            "nobody answers",
        ),
        (
            read(0, ID ^ 1).to_vec(),
            ControlError::Identity { found: ID ^ 1 },
            "another bitstream",
        ),
        (
            // It knows no pilots.
            [read(0, ID), read(1, 1)].concat(),
            ControlError::Format { found: 1 },
            "another release",
        ),
        (
            [read(0, ID), read(1, 3)].concat(),
            ControlError::Format { found: 3 },
            "another release",
        ),
        (
            // It claims a version that has the register, and has none.
            [before_pilots, set(0x0c, 12, 0)].concat(),
            ControlError::Register {
                register: 0x0c,
                written: 12,
                found: 0,
            },
            "0x0c holds 0x00000000, written was 0x0000000c",
        ),
        (
            [read(0, ID).to_vec(), read(1, 2).to_vec(), set(2, 0, 1)].concat(),
            ControlError::Register {
                register: 2,
                written: 0,
                found: 1,
            },
            "lower the SPI clock",
        ),
    ];
    for (expected, error, says) in cases {
        let mut bus = Spi::new(&expected);
        let found = block_on(Control::new(bus.clone()).prepare(9, 0, 0)).expect_err("not ours");
        assert_eq!(found, error);
        assert!(found.to_string().contains(says), "{found}");
        bus.done();
    }
    let mut bus = Spi::new(&read(9, 0));
    assert_eq!(
        block_on(Control::new(bus.clone()).run()),
        Err(ControlError::NoSync)
    );
    bus.done();
}

struct Ticks(Cell<u64>);

impl Clock for Ticks {
    fn now_ns(&self) -> u64 {
        self.0.set(self.0.get() + 1_000_000);
        self.0.get()
    }
}

fn fifo(status: u8, packet: Option<u32>) -> [Transaction<u8>; 3] {
    let mut sent = [0; 24];
    sent[0] = 0xad;
    let mut received = vec![0, status, 0, u8::from(packet.is_some())];
    if let Some(number) = packet {
        let sample = RawSample {
            acceleration: [0, 0, 8192],
            rate: [0; 3],
            temperature: 0,
            time_ticks: (1875 * number / 2) as u16,
        };
        received.extend(sample.to_packet());
    }
    received.resize(24, 0xff);
    transfer(&sent, &received)
}

#[test]
fn the_inertial_sensor_is_read_at_its_edges_and_started_anew_when_it_has_restarted() {
    let expected = [
        fifo(0x04, Some(1)).to_vec(),
        fifo(0x14, None).to_vec(),
        // It is started anew, and answers wrongly: next time again.
        transfer(&[0x76, 0], &[0, 0]).to_vec(),
        transfer(&[0x11, 1], &[0, 0]).to_vec(),
        transfer(&[0xf5, 0], &[0, 0]).to_vec(),
        transfer(&[0x76, 0], &[0, 0]).to_vec(),
        transfer(&[0x11, 1], &[0, 0]).to_vec(),
        transfer(&[0xf5, 0], &[0, 0x46]).to_vec(),
    ]
    .concat();
    let mut bus = Spi::new(&expected);
    let edges = [
        PinEvent::wait_for_edge(Edge::Rising),
        PinEvent::wait_for_edge(Edge::Rising),
    ];
    let mut pin = Pin::new(&edges);
    let clock = Ticks(Cell::new(5_000_000));
    let ready = EdgeOf {
        pin: pin.clone(),
        clock: &clock,
    };
    let mut imu = Inertial::new(Icm42688::new(bus.clone()), ready, NoopDelay::new());
    let mut samples = Samples::new();
    assert_eq!(block_on(imu.samples(&mut samples)), Ok(()));
    // What the edge at 6 ms announces is the mean of the millisecond that ended 1.072 ms before.
    assert_eq!(samples[0].time_ns, 4_928_000);
    assert_eq!(samples[0].specific_force_m_per_s2.z, 9.80665);
    assert_eq!(block_on(imu.samples(&mut samples)), Err(ImuError::Restarted));
    assert!(samples.is_empty());
    for found in [0, 0x46] {
        assert_eq!(
            block_on(imu.samples(&mut samples)),
            Err(ImuError::WhoAmI { found })
        );
    }
    assert_eq!(imu.counters().samples, 1);
    bus.done();
    pin.done();
}

#[test]
fn a_sensor_whose_reads_keep_failing_is_started_anew_after_three() {
    let bad = transfer(&[&[0xad][..], &[0; 23]].concat(), &[0xff; 24]);
    let expected = [bad.clone(), bad.clone(), bad, transfer(&[0x76, 0], &[0, 0])].concat();
    let mut expected = expected;
    expected.extend(transfer(&[0x11, 1], &[0, 0]));
    expected.extend(transfer(&[0xf5, 0], &[0, 0xff]));
    let mut bus = Spi::new(&expected);
    let edges = vec![PinEvent::wait_for_edge(Edge::Rising); 3];
    let mut pin = Pin::new(&edges);
    let clock = Ticks(Cell::new(0));
    let ready = EdgeOf {
        pin: pin.clone(),
        clock: &clock,
    };
    let mut imu = Inertial::new(Icm42688::new(bus.clone()), ready, NoopDelay::new());
    let mut samples = Samples::new();
    for _ in 0..3 {
        assert_eq!(
            block_on(imu.samples(&mut samples)),
            Err(ImuError::Count { found: 0xffff })
        );
    }
    assert_eq!(
        block_on(imu.samples(&mut samples)),
        Err(ImuError::WhoAmI { found: 0xff })
    );
    bus.done();
    pin.done();
}

#[test]
fn an_edge_is_stamped_by_the_clock() {
    let mut pin = Pin::new(&[PinEvent::wait_for_edge(Edge::Rising)]);
    let clock = Ticks(Cell::new(41_000_000));
    let mut ready = EdgeOf {
        pin: pin.clone(),
        clock: &clock,
    };
    assert_eq!(block_on(ready.edge()), 42_000_000);
    pin.done();
}

/// Takes at most so many bytes a time.
struct Radio {
    takes: usize,
    sent: Vec<u8>,
    fails: bool,
}

impl ErrorType for Radio {
    type Error = ErrorKind;
}

impl Write for Radio {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        if self.fails {
            return Err(ErrorKind::BrokenPipe);
        }
        let taken = self.takes.min(bytes.len());
        self.sent.extend(&bytes[..taken]);
        Ok(taken)
    }

    async fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

#[test]
fn a_frame_leaves_whole_or_with_an_error() {
    let radio = |takes, fails| Radio {
        takes,
        sent: Vec::new(),
        fails,
    };
    for takes in [1, 7, 100] {
        let mut radio = radio(takes, false);
        let frame: Vec<u8> = (0..50).collect();
        assert_eq!(block_on(radio.send(&frame)), Ok(()));
        assert_eq!(radio.sent, frame);
        assert_eq!(block_on(radio.send(&[])), Ok(()));
    }
    assert_eq!(block_on(radio(0, false).send(&[1])), Err(DownlinkError::Stuck));
    assert_eq!(
        block_on(radio(1, true).send(&[1])),
        Err(DownlinkError::Write(ErrorKind::BrokenPipe))
    );
}

/// What a bus and a select line were told, in order.
type Log = Rc<RefCell<Vec<&'static str>>>;

/// A bus on which a transfer of more than a byte does not end.
struct SlowBus(Log);

impl spi::ErrorType for SlowBus {
    type Error = Infallible;
}

impl SpiBus for SlowBus {
    async fn read(&mut self, _bytes: &mut [u8]) -> Result<(), Infallible> {
        unreachable!("nothing is only read")
    }

    async fn write(&mut self, _bytes: &[u8]) -> Result<(), Infallible> {
        unreachable!("nothing is only written")
    }

    async fn transfer(&mut self, _read: &mut [u8], _write: &[u8]) -> Result<(), Infallible> {
        unreachable!("transfers are in place")
    }

    async fn transfer_in_place(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        self.0.borrow_mut().push("transfer");
        if bytes.len() > 1 {
            pending::<()>().await;
        }
        Ok(())
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().push("flush");
        Ok(())
    }
}

struct Select(Log);

impl digital::ErrorType for Select {
    type Error = Infallible;
}

impl OutputPin for Select {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().push("select");
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().push("release");
        Ok(())
    }
}

#[test]
fn a_transfer_that_is_given_up_half_way_releases_the_device() {
    let log = Log::default();
    let mut device = OnlyDevice::new(SlowBus(log.clone()), Select(log.clone()), NoopDelay::new());
    {
        let mut bytes = [0; 24];
        let mut transfer = pin!(device.transfer_in_place(&mut bytes));
        let polled = transfer.as_mut().poll(&mut Context::from_waker(Waker::noop()));
        assert_eq!(polled, Poll::Pending);
        assert_eq!(*log.borrow(), ["release", "select", "transfer"]);
        // As when a timeout ends first: the future goes, and nobody polls it again.
    }
    assert_eq!(*log.borrow(), ["release", "select", "transfer", "release"]);
    log.borrow_mut().clear();
    assert_eq!(block_on(device.transfer_in_place(&mut [0])), Ok(()));
    assert_eq!(*log.borrow(), ["select", "transfer", "flush", "release"]);
}

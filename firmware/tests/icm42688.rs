//! The inertial sensor's driver against a mocked bus: every byte that goes over it is stated here.

#[path = "common/block_on.rs"]
mod block_on;

use block_on::block_on;
use cslam_firmware::icm42688::{BURST, Icm42688, ImuCounters, ImuError, PACKET_LEN, RawSample, Samples};
use embedded_hal_mock::eh1::delay::{CheckedDelay, NoopDelay, Transaction as Wait};
use embedded_hal_mock::eh1::spi::{Mock, Transaction};

/// A transfer of a device: selected, sent, received, released.
fn transfer(sent: &[u8], received: &[u8]) -> [Transaction<u8>; 3] {
    [
        Transaction::transaction_start(),
        Transaction::transfer_in_place(sent.to_vec(), received.to_vec()),
        Transaction::transaction_end(),
    ]
}

fn write(register: u8, value: u8) -> [Transaction<u8>; 3] {
    transfer(&[register, value], &[0, 0])
}

fn read(register: u8, value: u8) -> [Transaction<u8>; 3] {
    transfer(&[register | 0x80, 0], &[0, value])
}

/// Written and read back.
fn set(register: u8, value: u8) -> Vec<Transaction<u8>> {
    [write(register, value), read(register, value)].concat()
}

/// Registers of the data sheet in the order in which they are set, after identity and reset have been found in order.
fn settings() -> Vec<Transaction<u8>> {
    let bank = |number| write(0x76, number).to_vec();
    [
        bank(1),
        set(0x0c, 6),
        set(0x0d, 36),
        set(0x0e, 0xa0),
        bank(2),
        set(0x03, 12),
        set(0x04, 36),
        set(0x05, 0xa0),
        bank(0),
        set(0x14, 0x03),
        set(0x4c, 0x73),
        set(0x4d, 0x51),
        set(0x4f, 0x06),
        set(0x50, 0x06),
        set(0x51, 0x16),
        set(0x52, 0x00),
        set(0x53, 0x0d),
        set(0x54, 0x21),
        set(0x5f, 0x37),
        set(0x60, 1),
        set(0x61, 0),
        set(0x63, 0),
        set(0x64, 0),
        set(0x65, 0x04),
        set(0x16, 0x00),
        set(0x4e, 0x0f),
        write(0x4b, 0x02).to_vec(),
        set(0x16, 0x40),
    ]
    .concat()
}

fn start() -> Vec<Transaction<u8>> {
    let mut all = [write(0x76, 0), write(0x11, 1), read(0x75, 0x47), read(0x2d, 0x10)].concat();
    all.extend(settings());
    all
}

fn packet(number: u32) -> [u8; PACKET_LEN] {
    RawSample {
        acceleration: [8192, number as i32, -5],
        rate: [131_072, 0, -(number as i32)],
        temperature: 0,
        time_ticks: (1875 * number / 2) as u16,
    }
    .to_packet()
}

/// A read of the FIFO that asks for `asked` packets.
fn fifo(status: u8, count: u16, asked: usize, packets: &[[u8; PACKET_LEN]]) -> [Transaction<u8>; 3] {
    let mut sent = vec![0; 4 + asked * PACKET_LEN];
    sent[0] = 0x2d | 0x80;
    let [high, low] = count.to_be_bytes();
    let mut received = vec![0, status, high, low];
    received.extend(packets.as_flattened());
    received.resize(sent.len(), 0xff);
    transfer(&sent, &received)
}

/// A sensor whose bus expects this.
fn sensor(expected: &[Transaction<u8>]) -> (Icm42688<Mock<u8>>, Mock<u8>) {
    let bus = Mock::new(expected);
    (Icm42688::new(bus.clone()), bus)
}

/// UAV clock at the edge of sample `number`, ns.
fn edge_ns(number: u32) -> u64 {
    7_000_000_000 + 1_000_000 * u64::from(number)
}

/// Filters hold a sample up by 872 and 700 us, and it is the mean of the millisecond that ends with its stamp.
const DELAY_NS: u64 = 1_072_000;

/// What a sample is stamped with whose edge was this one's, ns.
fn end_ns(number: u32) -> u64 {
    edge_ns(number) - DELAY_NS
}

#[test]
fn the_start_is_that_of_the_data_sheet() {
    let (mut imu, mut bus) = sensor(&start());
    let mut delay = CheckedDelay::new(&[Wait::async_delay_ms(2), Wait::async_delay_ms(45)]);
    assert_eq!(block_on(imu.start(&mut delay)), Ok(()));
    delay.done();
    bus.done();
}

#[test]
fn another_chip_and_no_chip_are_told_apart() {
    for (found, says) in [(0x47 ^ 1, "another chip"), (0x00, "nobody"), (0xff, "nobody")] {
        let expected = [write(0x76, 0), write(0x11, 1), read(0x75, found)].concat();
        let (mut imu, mut bus) = sensor(&expected);
        let error = block_on(imu.start(&mut NoopDelay::new())).expect_err("not ours");
        assert_eq!(error, ImuError::WhoAmI { found });
        assert!(error.to_string().contains(says), "{error}");
        bus.done();
    }
}

#[test]
fn a_reset_that_does_not_end_is_an_error() {
    let expected = [write(0x76, 0), write(0x11, 1), read(0x75, 0x47), read(0x2d, 0x00)].concat();
    let (mut imu, mut bus) = sensor(&expected);
    assert_eq!(block_on(imu.start(&mut NoopDelay::new())), Err(ImuError::NoReset));
    bus.done();
}

#[test]
fn a_register_that_does_not_hold_is_named() {
    let mut expected = start();
    // The read-back of ACCEL_CONFIG0.
    let written = write(0x50, 0x06);
    let at = expected
        .windows(3)
        .position(|part| part == written)
        .expect("is set");
    expected.truncate(at + 3);
    expected.extend(read(0x50, 0x46));
    let (mut imu, mut bus) = sensor(&expected);
    let error = ImuError::Register {
        bank: 0,
        register: 0x50,
        written: 0x06,
        found: 0x46,
    };
    assert_eq!(block_on(imu.start(&mut NoopDelay::new())), Err(error));
    bus.done();
}

/// A bus that fails at one transfer.
struct Failing {
    bus: Mock<u8>,
    left: usize,
}

impl embedded_hal_async::spi::ErrorType for Failing {
    type Error = embedded_hal_async::spi::ErrorKind;
}

impl embedded_hal_async::spi::SpiDevice for Failing {
    async fn transaction(
        &mut self,
        operations: &mut [embedded_hal_async::spi::Operation<'_, u8>],
    ) -> Result<(), Self::Error> {
        if self.left == 0 {
            return Err(embedded_hal_async::spi::ErrorKind::ModeFault);
        }
        self.left -= 1;
        embedded_hal_async::spi::SpiDevice::transaction(&mut self.bus, operations).await
    }
}

#[test]
fn a_bus_error_at_any_transfer_of_the_start_comes_out() {
    let all = start();
    for left in 0..all.len() / 3 {
        let mut bus = Mock::new(&all[..3 * left]);
        let mut imu = Icm42688::new(Failing {
            bus: bus.clone(),
            left,
        });
        assert_eq!(
            block_on(imu.start(&mut NoopDelay::new())),
            Err(ImuError::Bus(embedded_hal_async::spi::ErrorKind::ModeFault)),
            "transfer {left}"
        );
        bus.done();
    }
}

#[test]
fn a_bus_error_in_flight_gives_no_sample_and_costs_none_that_can_be_read_again() {
    let mut bus = Mock::new(&fifo(0x04, 1, 1, &[packet(1)]));
    let mut imu = Icm42688::new(Failing {
        bus: bus.clone(),
        left: 1,
    });
    let mut samples = Samples::new();
    assert_eq!(block_on(imu.read(edge_ns(1), &mut samples)), Ok(false));
    assert_eq!(samples.len(), 1);
    let error = block_on(imu.read(edge_ns(2), &mut samples));
    assert!(matches!(error, Err(ImuError::Bus(_))));
    assert!(samples.is_empty());
    assert_eq!(imu.counters().samples, 1);
    bus.done();
}

#[test]
fn samples_come_in_units_and_by_the_uav_clock() {
    let mut expected = Vec::new();
    // 100 ms: the stamp wraps after 69.9.
    for number in 1..=100 {
        expected.extend(fifo(0x04, 1, 1, &[packet(number)]));
    }
    let (mut imu, mut bus) = sensor(&expected);
    let mut samples = Samples::new();
    for number in 1..=100u32 {
        assert_eq!(block_on(imu.read(edge_ns(number), &mut samples)), Ok(false));
        let [sample] = samples.as_slice() else {
            panic!("one sample an edge")
        };
        assert_eq!(sample.time_ns, end_ns(number));
        assert_eq!(sample.specific_force_m_per_s2.x, 9.80665);
        assert_eq!(sample.rate_rad_per_s.x, 1000.0f32.to_radians());
    }
    let expected = ImuCounters {
        samples: 100,
        ..ImuCounters::default()
    };
    assert_eq!(imu.counters(), expected);
    bus.done();
}

#[test]
fn what_has_piled_up_is_read_in_bursts_with_the_times_of_the_samples() {
    let packets: Vec<_> = (0..21).map(packet).collect();
    let mut expected = Vec::new();
    // The first read asks for one packet and learns of 18 more; by the third edge two have come.
    expected.extend(fifo(0x04, 1, 1, &packets[0..1]));
    expected.extend(fifo(0x04, 19, 1, &packets[1..2]));
    expected.extend(fifo(0x04, 18, BURST, &packets[2..10]));
    expected.extend(fifo(0x04, 10, BURST, &packets[10..18]));
    expected.extend(fifo(0x04, 3, 3, &packets[18..21]));
    let (mut imu, mut bus) = sensor(&expected);
    let mut samples = Samples::new();
    let mut times = Vec::new();
    for (edge, more) in [(0, false), (19, true), (19, true), (19, true), (20, false)] {
        assert_eq!(block_on(imu.read(edge_ns(edge), &mut samples)), Ok(more));
        times.extend(samples.iter().map(|sample| sample.time_ns));
    }
    assert_eq!(times, (0..21).map(end_ns).collect::<Vec<_>>());
    assert_eq!(imu.counters().lost, 0);
    bus.done();
}

#[test]
fn an_overflow_is_counted_and_so_is_every_sample_that_it_cost() {
    let mut expected = Vec::new();
    expected.extend(fifo(0x04, 1, 1, &[packet(1)]));
    // The oldest 50 of 151 made room for the others.
    expected.extend(fifo(0x06, 102, 1, &[packet(52)]));
    let (mut imu, mut bus) = sensor(&expected);
    let mut samples = Samples::new();
    assert_eq!(block_on(imu.read(edge_ns(1), &mut samples)), Ok(false));
    assert_eq!(block_on(imu.read(edge_ns(153), &mut samples)), Ok(true));
    assert_eq!(samples[0].time_ns, end_ns(52));
    let expected = ImuCounters {
        samples: 2,
        lost: 50,
        overflows: 1,
        ..ImuCounters::default()
    };
    assert_eq!(imu.counters(), expected);
    bus.done();
}

#[test]
fn lost_and_repeated_packets_are_counted_to_the_sample() {
    let mut expected = Vec::new();
    for number in [1, 2, 2, 5, 305] {
        expected.extend(fifo(0x04, 1, 1, &[packet(number)]));
    }
    let (mut imu, mut bus) = sensor(&expected);
    let mut samples = Samples::new();
    let mut given = Vec::new();
    for edge in [1, 2, 3, 5, 305] {
        assert_eq!(block_on(imu.read(edge_ns(edge), &mut samples)), Ok(false));
        given.extend(samples.iter().map(|sample| sample.time_ns));
    }
    assert_eq!(given, [1, 2, 5, 305].map(end_ns));
    let expected = ImuCounters {
        samples: 4,
        lost: 2 + 299,
        repeated: 1,
        ..ImuCounters::default()
    };
    assert_eq!(imu.counters(), expected);
    bus.done();
}

#[test]
fn a_fifo_out_of_step_is_emptied_and_the_loss_counted() {
    let mut shifted = packet(2);
    shifted.rotate_left(3);
    let mut expected = Vec::new();
    expected.extend(fifo(0x04, 1, 1, &[packet(1)]));
    expected.extend(fifo(0x04, 1, 1, &[shifted]));
    expected.extend(write(0x4b, 0x02));
    expected.extend(fifo(0x04, 1, 1, &[packet(3)]));
    let (mut imu, mut bus) = sensor(&expected);
    let mut samples = Samples::new();
    assert_eq!(block_on(imu.read(edge_ns(1), &mut samples)), Ok(false));
    assert_eq!(block_on(imu.read(edge_ns(2), &mut samples)), Ok(false));
    assert!(samples.is_empty());
    assert_eq!(block_on(imu.read(edge_ns(3), &mut samples)), Ok(false));
    assert_eq!(samples[0].time_ns, end_ns(3));
    let expected = ImuCounters {
        samples: 2,
        lost: 1,
        damaged: 1,
        flushes: 1,
        ..ImuCounters::default()
    };
    assert_eq!(imu.counters(), expected);
    bus.done();
}

#[test]
fn a_sensor_that_restarted_or_went_away_is_noticed_in_flight() {
    let mut expected = fifo(0x14, 0, 1, &[]).to_vec();
    expected.extend(fifo(0xff, 0xffff, 1, &[]));
    let (mut imu, mut bus) = sensor(&expected);
    let mut samples = Samples::new();
    assert_eq!(
        block_on(imu.read(edge_ns(1), &mut samples)),
        Err(ImuError::Restarted)
    );
    assert_eq!(
        block_on(imu.read(edge_ns(2), &mut samples)),
        Err(ImuError::Count { found: 0xffff })
    );
    bus.done();
}

#[test]
fn samples_of_a_sensor_that_is_still_starting_are_not_given_on() {
    let mut not_ready = packet(1);
    not_ready[1..3].copy_from_slice(&[0x80, 0]);
    not_ready[17] &= 0x0f;
    let mut expected = fifo(0x04, 1, 1, &[not_ready]).to_vec();
    // An edge without a packet: the interrupt was late and its packet has been read.
    expected.extend(fifo(0x00, 0, 1, &[]));
    let (mut imu, mut bus) = sensor(&expected);
    let mut samples = Samples::new();
    for edge in 1..=2 {
        assert_eq!(block_on(imu.read(edge_ns(edge), &mut samples)), Ok(false));
        assert!(samples.is_empty());
    }
    let expected = ImuCounters {
        not_ready: 1,
        ..ImuCounters::default()
    };
    assert_eq!(imu.counters(), expected);
    bus.done();
}

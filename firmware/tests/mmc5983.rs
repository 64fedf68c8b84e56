//! The magnetometer's driver against a mocked bus: every byte that goes over it is stated here.

#[path = "common/block_on.rs"]
mod block_on;

use block_on::block_on;
use cslam_firmware::mmc5983::{CODE_MAX, Field, MagnetometerError, Mmc5983, ZERO_CODE};
use embedded_hal_mock::eh1::delay::{CheckedDelay, NoopDelay, Transaction as Wait};
use embedded_hal_mock::eh1::i2c::{Mock, Transaction};

const ADDRESS: u8 = 0x30;

fn write(register: u8, value: u8) -> Transaction {
    Transaction::write(ADDRESS, vec![register, value])
}

fn read(register: u8, bytes: &[u8]) -> Transaction {
    Transaction::write_read(ADDRESS, vec![register], bytes.to_vec())
}

fn start() -> Vec<Transaction> {
    vec![
        write(0x0a, 0x80),
        read(0x2f, &[0x30]),
        read(0x08, &[0x10]),
        write(0x0a, 0x01),
    ]
}

/// The output registers of three codes.
fn output([x, y, z]: [u32; 3]) -> [u8; 7] {
    let [x1, x0, y1, y0, z1, z0] = [x, y, z]
        .map(|code| ((code >> 2) as u16).to_be_bytes())
        .concat()
        .try_into()
        .expect("six bytes");
    let low = (x & 3) << 6 | (y & 3) << 4 | (z & 3) << 2;
    [x1, x0, y1, y0, z1, z0, low as u8]
}

/// A measurement after a pulse, that has ended at look `looks`.
fn measurement(pulse: u8, looks: usize, codes: [u32; 3]) -> Vec<Transaction> {
    let mut all = vec![write(0x09, pulse), write(0x08, 0x01), write(0x09, 0x01)];
    all.extend((1..looks).map(|_| read(0x08, &[0x10])));
    all.extend([read(0x08, &[0x11]), read(0x00, &output(codes))]);
    all
}

fn sensor(expected: &[Transaction]) -> (Mmc5983<Mock>, Mock) {
    let bus = Mock::new(expected);
    (Mmc5983::new(bus.clone()), bus)
}

#[test]
fn the_start_sees_that_it_is_the_sensor() {
    let (mut sensor, mut bus) = sensor(&start());
    let mut delay = CheckedDelay::new(&[Wait::async_delay_ms(15)]);
    assert_eq!(block_on(sensor.start(&mut delay)), Ok(()));
    delay.done();
    bus.done();
}

#[test]
fn another_chip_no_trim_and_no_chip_are_told_apart() {
    let nobody = embedded_hal_async::i2c::ErrorKind::NoAcknowledge(
        embedded_hal_async::i2c::NoAcknowledgeSource::Address,
    );
    let cases = [
        (
            vec![write(0x0a, 0x80), read(0x2f, &[0x0c])],
            MagnetometerError::Identity { found: 0x0c },
            "another chip",
        ),
        (
            vec![write(0x0a, 0x80), read(0x2f, &[0x30]), read(0x08, &[0x00])],
            MagnetometerError::NoTrim,
            "trim",
        ),
        (
            vec![write(0x0a, 0x80).with_error(nobody)],
            MagnetometerError::Bus(nobody),
            "nobody answers",
        ),
    ];
    for (expected, error, says) in cases {
        let (mut sensor, mut bus) = sensor(&expected);
        let found = block_on(sensor.start(&mut NoopDelay::new())).expect_err("not ours");
        assert_eq!(found, error);
        assert!(found.to_string().contains(says), "{found}");
        bus.done();
    }
}

#[test]
fn the_field_comes_in_units_and_without_the_bridges_offset() {
    // 20, -40.5 and 0.75 uT turn their sign with the pulse; offsets of 30, -12 and 3 uT do not. 163.84 codes a uT.
    let code = |ut: f64| (f64::from(ZERO_CODE) + (ut * 163.84).round()) as u32;
    let mut expected = measurement(0x08, 1, [code(30.0 + 20.0), code(-12.0 - 40.5), code(3.0 + 0.75)]);
    expected.extend(measurement(
        0x10,
        3,
        [code(30.0 - 20.0), code(-12.0 + 40.5), code(3.0 - 0.75)],
    ));
    let (mut sensor, mut bus) = sensor(&expected);
    let mut delay = CheckedDelay::new(&[1, 4, 1, 4, 1, 1].map(Wait::async_delay_ms));
    let Field { field_ut, offset_ut } = block_on(sensor.measure(&mut delay)).expect("a sample");
    for (found, ut) in [(field_ut, [20.0, -40.5, 0.75]), (offset_ut, [30.0, -12.0, 3.0])] {
        for (found, ut) in found.iter().zip(ut) {
            // Half a code of either measurement.
            assert!((f64::from(*found) - ut).abs() < 0.0062, "{found}, expected {ut}");
        }
    }
    delay.done();
    bus.done();
}

#[test]
fn every_bit_of_a_code_counts() {
    for bit in 0..18 {
        let codes = [1 << bit, 1 << ((bit + 5) % 18), 1 << ((bit + 11) % 18)];
        let mut expected = measurement(0x08, 1, codes);
        expected.extend(measurement(0x10, 1, [ZERO_CODE; 3]));
        let (mut sensor, mut bus) = sensor(&expected);
        let Field { field_ut, .. } = block_on(sensor.measure(&mut NoopDelay::new())).expect("a sample");
        let found = field_ut.map(|ut| f64::from(ut) * 163.84 * 2.0 + f64::from(ZERO_CODE));
        for (found, code) in found.iter().zip(codes) {
            assert!((found - f64::from(code)).abs() < 0.01, "{found}, expected {code}");
        }
        bus.done();
    }
}

#[test]
fn an_axis_at_the_end_of_its_range_is_no_measurement_after_either_pulse() {
    for end in [0, CODE_MAX] {
        for axis in 0..3 {
            let mut codes = [ZERO_CODE; 3];
            codes[axis] = end;
            let sound = measurement(0x08, 1, [ZERO_CODE; 3]);
            for expected in [
                measurement(0x08, 1, codes),
                [sound, measurement(0x10, 1, codes)].concat(),
            ] {
                let (mut sensor, mut bus) = sensor(&expected);
                let error = block_on(sensor.measure(&mut NoopDelay::new())).expect_err("saturated");
                assert_eq!(error, MagnetometerError::Saturated { codes });
                bus.done();
            }
        }
    }
}

#[test]
fn a_measurement_that_does_not_end_is_given_up() {
    let mut expected = vec![write(0x09, 0x08), write(0x08, 0x01), write(0x09, 0x01)];
    expected.extend((0..5).map(|_| read(0x08, &[0x10])));
    let (mut sensor, mut bus) = sensor(&expected);
    let error = block_on(sensor.measure(&mut NoopDelay::new()));
    assert_eq!(error, Err(MagnetometerError::NotMeasured));
    bus.done();
}

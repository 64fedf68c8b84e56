//! A two-way exchange that the front end has measured comes with its frame and reaches the clock, once.

use cslam_core::signal::Iq;
use cslam_firmware::front_end::{Exchange, Header, Kind, Status};
use cslam_firmware::sensor_stream::SESSION;
use cslam_host_sim::raw_flight::with_board_receiver;

/// The begin of a sweep, half a second after the one before.
fn begin(sweep: u32) -> Header {
    Header {
        kind: Kind::Begin,
        session: SESSION,
        sequence: sweep,
        sweep,
        index: 129,
        exponent: 0,
        sweep_ns: 1_000_000_000 + 500_000_000 * u64::from(sweep),
        offset_ns: 0,
        powers: false,
        payload_checksum: 0,
        dropped: 0,
        status: Status(0),
    }
}

#[test]
fn an_exchange_is_used_once_and_a_begin_without_one_is_none() {
    let mut samples = Box::new([[Iq::ZERO; 512]; 32]);
    let used = with_board_receiver(|receiver| {
        // None; a first one, which is repeated; a new one; and one whose header was damaged on the way.
        let mut used = Vec::new();
        for (sweep, number, is_damaged) in [
            (0, None, false),
            (1, Some(5), false),
            (2, Some(5), false),
            (3, Some(6), false),
            (4, Some(7), true),
        ] {
            let mut bytes = begin(sweep).encode();
            if let Some(number) = number {
                let exchange = Exchange {
                    number,
                    samples: 307,
                    phase: 13_107,
                };
                exchange.put(&mut bytes);
            }
            if is_damaged {
                bytes[52] ^= 1;
            }
            let taken = receiver.frame(&bytes, &mut samples, &mut ());
            assert_eq!(taken.is_err(), is_damaged, "sweep {sweep}: {taken:?}");
            used.push(receiver.counters().timing);
        }
        Ok(used)
    })
    .expect("a receiver");
    assert_eq!(used, [0, 1, 1, 2, 2]);
}

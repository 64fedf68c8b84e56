//! The golden run: the firmware's library half on the host.

use cslam_core::reflection::Form;
use cslam_core::telemetry::{HealthCounters, Key, Sender};
use cslam_firmware::measurement::LENGTH;
use cslam_firmware::receiver::{BoardMap, Receiver, Step, board_gates};

/// Number of the board's UAV.
pub(crate) const UAV: u8 = 1;

/// What a receiver sends for a stream.
pub(crate) struct Golden {
    /// Every packet.
    pub(crate) bytes: Vec<u8>,
    /// What became of the measurements.
    pub(crate) outcomes: HealthCounters,
}

/// Takes the stream through a receiver like the board's.
pub(crate) fn run(records: &[[u8; LENGTH]]) -> Golden {
    let mut map = Box::new(BoardMap::new());
    let mut receiver = Receiver::new(
        &mut map,
        Form::Vector,
        board_gates(),
        Sender::new(UAV, &Key::TEST, 0),
    );
    let mut bytes = Vec::new();
    let mut step = Step::Idle;
    for record in records {
        step = receiver
            .receive(record, &mut bytes)
            .expect("a vector takes everything");
    }
    assert_eq!(step, Step::Ended, "the stream has an end");
    Golden {
        bytes,
        outcomes: receiver.health().counters,
    }
}

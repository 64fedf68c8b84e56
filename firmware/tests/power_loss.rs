//! The link through loss of power at every write of the flash: nothing that was taken is taken again, nothing that was sent is sent
//! again, no setting is lost.

mod flash;

use std::collections::BTreeSet;

use cslam_core::telemetry::{Command, Decoder, Key, MAX_FRAME, Sender, TelemetryError, Uplink};
use cslam_firmware::storage::{DOWNLINK_RESERVE, Ledger, Mount, Settings, Store, UPLINK_RESERVE};

use flash::Flash;

const UAV: u8 = 3;

fn settings() -> Settings {
    Settings {
        uav: UAV,
        mount: Mount::new([-2, 1, 3]).expect("a quarter turn"),
        key: Some([7; 32]),
        ..Settings::default()
    }
}

fn key() -> Key {
    Key::new([7; 32])
}

/// A flash that has been given its settings.
fn settled() -> Flash<2> {
    let mut flash = Flash::new();
    let mut store = Store::open(&mut flash).expect("two halves");
    store.store(&settings()).expect("power is on");
    flash
}

/// The ground, which never loses its power, and everything that was ever seen on the air.
struct World {
    ground: Sender<Uplink>,
    /// Frames that a receiver took.
    taken: Vec<Vec<u8>>,
    /// Counters that the UAV has sent.
    sent: BTreeSet<u32>,
    /// Sessions that were opened with the front end.
    sessions: BTreeSet<u16>,
    replays: u32,
}

impl World {
    fn new() -> Self {
        Self {
            ground: Sender::new(UAV, &key(), 0),
            taken: Vec::new(),
            sent: BTreeSet::new(),
            sessions: BTreeSet::new(),
            replays: 0,
        }
    }

    /// The UAV from power on to loss of power, or for so many packets. Gives how many new packets it refused before the first that it took.
    fn live(&mut self, flash: &mut Flash<2>, packets: u32) -> Option<u32> {
        let store = Store::open(flash).expect("two halves");
        let found = store.settings().expect("never lost").clone();
        assert_eq!(
            (found.uav, found.mount, found.key),
            (UAV, settings().mount, settings().key)
        );
        let mut ledger = Ledger::begin(store).ok()?;
        self.open(ledger.settings().session);
        let mut down = Sender::new(UAV, &key(), ledger.first_downlink());
        down.allow(ledger.settings().downlink_counter);
        let mut up = Decoder::with(ledger.opener(&key()));
        for frame in &self.taken {
            self.replays += u32::from(judge(&mut up, &mut ledger, frame).is_ok());
        }
        let (mut refused, mut took) = (0, false);
        for number in 0..packets {
            let mut buffer = [0; MAX_FRAME];
            let command = Uplink::Command(Command::SendConfig);
            let frame = self
                .ground
                .encode(&command, &mut buffer)
                .expect("counters are left");
            match judge(&mut up, &mut ledger, frame) {
                Ok(()) => {
                    took = true;
                    self.taken.push(frame.to_vec());
                }
                Err(TelemetryError::Unreserved) => return None,
                Err(error) => {
                    assert!(!took, "{error}");
                    refused += 1;
                }
            }
            // A replay at any time of a packet from any time.
            let replay = &self.taken.get(number as usize * 7919 % self.taken.len().max(1));
            if let Some(frame) = replay {
                self.replays += u32::from(judge(&mut up, &mut ledger, frame).is_ok());
            }
            // A day of packets goes down between two that come up now and then, so that those are set aside anew as well.
            self.send(&mut down);
            ledger.tend().ok()?;
            if number % 50 == 49 {
                down = Sender::new(UAV, &key(), down.counter() + DOWNLINK_RESERVE / 3);
                down.allow(ledger.settings().downlink_counter);
                ledger.renew_downlink(&mut down).ok()?;
            }
            if number % 70 == 69 {
                let session = ledger.next_session().ok()?;
                self.open(session);
            }
        }
        Some(refused)
    }

    fn open(&mut self, session: u16) {
        assert!(self.sessions.insert(session), "session {session} is opened twice");
    }

    fn send(&mut self, down: &mut Sender) {
        let counter = down.counter();
        let mut buffer = [0; MAX_FRAME];
        let message = cslam_core::telemetry::Message::Health(Default::default());
        if down.encode(&message, &mut buffer).is_ok() {
            assert!(self.sent.insert(counter), "counter {counter} is sent twice");
        }
    }
}

fn judge(
    up: &mut Decoder<Uplink>,
    ledger: &mut Ledger<&mut Flash<2>>,
    frame: &[u8],
) -> Result<(), TelemetryError> {
    let heard = frame
        .iter()
        .find_map(|byte| up.push_reserving(*byte, |counter| ledger.reserve_uplink(counter)));
    heard.expect("a frame").map(|_| ())
}

/// Packets that come up in a life: the counter is set aside five times.
const PACKETS: u32 = 300;

#[test]
fn power_that_fails_at_any_byte_of_any_write_lets_nothing_in_twice() {
    for torn_words_fail in [true, false] {
        let mut whole = settled();
        whole.torn_words_fail = torn_words_fail;
        let used = {
            let mut flash = whole.clone();
            flash.power = 1 << 20;
            assert_eq!(World::new().live(&mut flash, PACKETS), Some(0));
            (1 << 20) - flash.power
        };
        assert!(used >= 1000, "{used} cuts are too few");
        let mut replays = 0;
        for cut in 0..used {
            let (mut flash, mut world) = (whole.clone(), World::new());
            flash.power = cut;
            assert_eq!(world.live(&mut flash, PACKETS), None, "the power fails");
            flash.power = usize::MAX;
            let refused = world.live(&mut flash, 2 * UPLINK_RESERVE).expect("power is on");
            assert!(refused <= UPLINK_RESERVE, "{refused} refused after cut {cut}");
            replays += world.replays;
        }
        println!("{used} cuts, {replays} replays taken");
        assert_eq!(replays, 0);
    }
}

#[test]
fn a_thousand_losses_of_power_in_one_life_let_nothing_in_twice() {
    let (mut flash, mut world) = (settled(), World::new());
    let mut word = 12_345u32;
    let (mut cuts, mut packets) = (0, 0);
    while cuts < 1000 {
        word = word.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        flash.power = (word >> 16) as usize % 3000;
        cuts += u32::from(world.live(&mut flash, PACKETS).is_none());
        packets = world.taken.len();
        // Not every old frame again in every life: those of the last few, and some.
        let keep = packets.saturating_sub(500);
        world.taken.drain(..keep);
    }
    println!(
        "{cuts} cuts, {packets} packets at hand, {} replays taken",
        world.replays
    );
    assert_eq!(world.replays, 0);
}

#[test]
fn a_reset_that_is_meant_refuses_nothing_and_a_sender_that_leaps_is_taken_at_once() {
    let mut flash = settled();
    let mut ground = Sender::<Uplink>::new(UAV, &key(), 0);
    let mut buffer = [0; MAX_FRAME];
    let command = Uplink::Command(Command::SendConfig);
    for life in 0..3 {
        let mut ledger = Ledger::begin(Store::open(&mut flash).expect("two halves")).expect("power is on");
        let mut up = Decoder::with(ledger.opener(&key()));
        if life == 2 {
            // The life before ended without warning: what it had set aside is gone.
            let frame = ground.encode(&command, &mut buffer).expect("counters are left");
            let refused = judge(&mut up, &mut ledger, frame);
            assert!(
                matches!(refused, Err(TelemetryError::Stale | TelemetryError::Replayed)),
                "{refused:?}"
            );
            ground = Sender::new(UAV, &key(), ground.counter() + UPLINK_RESERVE);
        }
        for _ in 0..10 {
            let frame = ground.encode(&command, &mut buffer).expect("counters are left");
            assert_eq!(judge(&mut up, &mut ledger, frame), Ok(()), "life {life}");
        }
        if life == 0 {
            let mut down = Sender::new(UAV, &key(), ledger.first_downlink());
            ledger.close(&mut down, up.opener().next()).expect("power is on");
            assert_eq!((down.left(), ledger.settings().downlink_counter), (0, 0));
        }
    }
}

#[test]
fn what_cannot_be_stored_is_not_taken() {
    let mut flash = settled();
    flash.worn[8..].fill(true);
    let mut ledger = Ledger::begin(Store::open(&mut flash).expect("two halves"));
    assert!(ledger.is_err(), "there is no room for a start");
    let mut flash = settled();
    flash.power = 512 + 3 * 128;
    ledger = Ledger::begin(Store::open(&mut flash).expect("two halves"));
    let mut ledger = ledger.expect("room for a start");
    let mut up = Decoder::with(ledger.opener(&key()));
    let mut ground = Sender::<Uplink>::new(UAV, &key(), 0);
    let mut judged = Vec::new();
    for _ in 0..2 * UPLINK_RESERVE {
        let mut buffer = [0; MAX_FRAME];
        let frame = ground
            .encode(&Uplink::Command(Command::Reboot), &mut buffer)
            .expect("left");
        judged.push(judge(&mut up, &mut ledger, frame));
    }
    let (first, later) = judged.split_at(UPLINK_RESERVE as usize);
    assert!(first.iter().all(|judged| judged.is_ok()));
    assert!(
        later
            .iter()
            .all(|judged| *judged == Err(TelemetryError::Unreserved))
    );
    // Neither is a limit that does not reach beyond the packet.
    let frame = {
        let mut buffer = [0; MAX_FRAME];
        ground
            .encode(&Uplink::Command(Command::Reboot), &mut buffer)
            .expect("left")
            .to_vec()
    };
    let heard = frame.iter().find_map(|byte| up.push_reserving(*byte, Some));
    assert_eq!(
        heard.expect("a frame").map(|_| ()),
        Err(TelemetryError::Unreserved)
    );
}

//! The link's protocol against a model of the front end, the camera port and its DMA that is exact to the clock: the machine that flies
//! ([`cslam_firmware::front_end::Capture`]), frames that come late, short, long, twice or not at all, and a processor that is busy.

#[path = "../flash/mod.rs"]
mod flash;
mod lines;
mod port;
mod processor;
#[path = "../common/random.rs"]
mod random;
mod source;

use std::cell::Cell;
use std::collections::BTreeSet;
use std::sync::OnceLock;

use cslam_core::signal::Iq;
use cslam_firmware::front_end::{
    BEAMS, Block, Checksum, Counters, Cut, FRAME_LENGTH, FRAME_WORDS, FRAMES_PER_SWEEP, Header, Kind,
    PILOTS_OF_A_BEAM, Port, SQUINT_SYMBOLS, SoftwareCrc, Status,
};
use cslam_firmware::storage::{Settings, Store};

use flash::Flash;
use flash::slow::{ERASE_MS, Slow};
use lines::{CLOCKS_PER_US, Driver, Run, Transfer};
use port::World;
use processor::{Known, Processor, SESSION};
use random::Random;
use source::{FAULTS, Fault, Source, data, pause, work};

const LENGTH: u64 = FRAME_LENGTH as u64;
const SECOND: u64 = 1_000_000 * CLOCKS_PER_US;
/// Two sweeps per second.
const PERIOD: u64 = SECOND / 2;
/// docs/front-end.md, PATIENCE.
const PATIENCE: u64 = 450_000 * CLOCKS_PER_US;

/// Four payloads, which frames have in turn, with their checksums.
fn known() -> &'static Known {
    static KNOWN: OnceLock<Known> = OnceLock::new();
    KNOWN.get_or_init(|| {
        let mut random = Random::new(1);
        let mut payload = || {
            let mut block: Box<Block> = vec![[Iq::ZERO; 512]; 32].try_into().expect("32 channels");
            block
                .as_flattened_mut()
                .fill_with(|| Iq::from_word(random.below(1 << 32) as u32));
            (block.as_flattened().to_vec(), SoftwareCrc.samples(&block))
        };
        Known((0..4).map(|_| payload()).collect())
    })
}

fn world() -> World {
    let payloads = known().0.iter().map(|(payload, _)| payload.clone()).collect();
    World::new(Driver::new(payloads))
}

/// Flies so many sweeps.
fn fly(sweeps: u32, source: &mut Source, processor: &mut Processor) {
    processor.work = work;
    for sweep in 0..sweeps {
        source.sweep(sweep, &mut processor.world.driver);
        processor.run(u64::from(sweep + 1) * PERIOD);
    }
    processor.run(u64::from(sweeps + 1) * PERIOD);
    assert!(processor.world.driver.queue.is_empty(), "frames are left");
}

#[test]
fn ten_minutes_of_sweeps_with_late_short_doubled_and_missing_frames_lose_no_good_one() {
    const SWEEPS: u32 = 1200;
    let mut source = Source::new(3, 40);
    let mut processor = Processor::new(world(), known().clone(), 4);
    fly(SWEEPS, &mut source, &mut processor);

    let received: BTreeSet<u32> = processor.received.iter().copied().collect();
    let lost: Vec<u32> = source.good.difference(&received).copied().collect();
    println!(
        "{SWEEPS} sweeps, {} frames, {} of them good: {} good frames lost; {:?}",
        source.sequence,
        source.good.len(),
        lost.len(),
        processor.front_end.counters(),
    );
    for fault in FAULTS {
        println!("{fault:?}: {}", source.count(fault));
        assert!(source.count(fault) > 100, "{fault:?} is hardly tried");
    }
    assert!(lost.is_empty(), "{} lost: {lost:?}", lost.len());
    assert_eq!(
        received.len(),
        processor.received.len(),
        "a frame was given on twice"
    );
    assert_eq!(received, source.good, "a frame that was not whole was given on");
    let cut = [Fault::Short, Fault::Long, Fault::Merged, Fault::Stalled].map(|fault| source.count(fault));
    let expected = Counters {
        ok: source.good.len() as u32 - source.late,
        late: source.late,
        lost: source.sequence - source.good.len() as u32,
        repeated: source.count(Fault::Doubled),
        cut: cut.iter().sum(),
        ..Counters::default()
    };
    assert_eq!(processor.front_end.counters(), expected);
    assert_eq!(processor.world.driver.dropped, 0);
}

/// Sweeps without a fault: all of them come through.
fn all_come(source: &Source, processor: &Processor) {
    let expected = Counters {
        ok: source.sequence,
        ..Counters::default()
    };
    assert_eq!(processor.front_end.counters(), expected);
    assert_eq!(
        (&processor.cuts[..], processor.world.driver.dropped),
        (&[][..], 0)
    );
}

#[test]
fn the_protocol_does_not_ask_what_the_manual_leaves_open() {
    // A word that the end of a frame has left unfilled is dropped, or filled up and handed on; words that wait for the DMA.
    for (fills_up, fifo_words) in [(false, 8), (true, 4), (true, 8)] {
        // With more faults stalls take so much of the link that the front end drops what has waited for too long.
        let (mut source, mut processor) = (Source::new(5, 30), Processor::new(world(), known().clone(), 6));
        (processor.world.fills_up, processor.world.fifo_words) = (fills_up, fifo_words);
        fly(40, &mut source, &mut processor);
        let received: BTreeSet<u32> = processor.received.iter().copied().collect();
        assert!(
            received == source.good,
            "a good frame was lost, or another given on"
        );
        assert_eq!(processor.world.driver.dropped, 0);
        let cut = [Fault::Short, Fault::Long, Fault::Merged, Fault::Stalled];
        let cut: u32 = cut.iter().map(|fault| source.count(*fault)).sum();
        assert!(cut > 50, "only {cut} frames were cut");
        let counters = processor.front_end.counters();
        assert_eq!(counters.cut + counters.damaged_payload, cut);
        assert_eq!(counters.damaged_payload > 0, fills_up);
    }
}

#[test]
fn a_bus_that_is_taken_costs_the_frames_that_overran_and_no_other() {
    let (mut source, mut processor) = (
        Source::new(7, u64::MAX),
        Processor::new(world(), known().clone(), 8),
    );
    // Up to what the port's FIFO bridges, and beyond.
    processor.bus_taken = |random| Some((random.below(400_000), random.below(60)));
    fly(60, &mut source, &mut processor);
    let overran = processor.world.lost_to_the_bus.clone();
    println!("{} frames, {} overran", source.sequence, overran.len());
    assert!(overran.len() > 50);
    assert_eq!(processor.cuts, vec![Cut::Overrun; overran.len()]);
    let expected: Vec<u32> = (0..source.sequence)
        .filter(|number| !overran.contains(number))
        .collect();
    assert_eq!(processor.received, expected);
}

#[test]
fn the_last_words_of_a_frame_may_be_in_memory_after_its_end() {
    for clocks in [10, 50, 70] {
        let (mut source, mut processor) = (
            Source::new(17, u64::MAX),
            Processor::new(world(), known().clone(), 18),
        );
        processor.world.bus_taken_at_end = clocks;
        fly(4, &mut source, &mut processor);
        all_come(&source, &processor);
    }
}

#[test]
fn a_front_end_that_has_forgotten_its_credit_gets_another() {
    let (mut source, mut processor) = (
        Source::new(9, u64::MAX),
        Processor::new(world(), known().clone(), 10),
    );
    for sweep in 0..20 {
        // Between two sweeps a buffer is on offer, and the front end restarts.
        processor.world.driver.forget_credit();
        source.sweep(sweep, &mut processor.world.driver);
        processor.run(u64::from(sweep + 1) * PERIOD);
    }
    all_come(&source, &processor);
}

#[test]
fn lines_that_hang_cost_what_hangs_on_them() {
    let (mut source, mut processor) = (
        Source::new(11, u64::MAX),
        Processor::new(world(), known().clone(), 12),
    );
    source.sweep(0, &mut processor.world.driver);
    // A frame without an end, once with and once without data, and one that is not even begun by READY; then life goes on.
    let hangs = [vec![pause(4 * SECOND)], vec![data(1000), pause(4 * SECOND)]];
    for (runs, unbidden) in hangs
        .into_iter()
        .flat_map(|runs| [(runs.clone(), false), (runs, true)])
    {
        let last = processor.world.driver.queue.back().expect("a sweep").clone();
        processor.world.driver.queue.push_back(Transfer {
            until: u64::MAX,
            runs,
            unbidden,
            ..last
        });
    }
    processor.run(18 * SECOND);
    // The first had no word and ended. The second began by itself right behind it, when no buffer was on offer. The third stalled, and so did
    // the fourth, which found the buffer that was offered behind the third.
    let nothing = Cut::Short { missing: FRAME_WORDS };
    assert_eq!(processor.cuts, [nothing, Cut::Stalled, Cut::Stalled]);
    source.sweep(36, &mut processor.world.driver);
    processor.run(19 * SECOND);
    let expected = Counters {
        ok: source.sequence,
        cut: 3,
        ..Counters::default()
    };
    assert_eq!(processor.front_end.counters(), expected);
}

#[test]
fn an_erase_of_the_settings_costs_no_frame() {
    let (mut source, mut processor) = (
        Source::new(15, u64::MAX),
        Processor::new(world(), known().clone(), 16),
    );
    // The test's own time goes on when the receiver waits for the flash.
    let now_ms: &'static Cell<u64> = Box::leak(Box::new(Cell::new(0)));
    let erasing: &'static Cell<_> = Box::leak(Box::new(Cell::new(None)));
    let mut store = Store::open(Slow {
        flash: Box::leak(Box::new(Flash::<4>::new())),
        now_ms,
        erasing,
        fails: false,
    })
    .expect("two halves");
    store.store(&Settings::default()).expect("the first record");
    let counts: &'static Cell<(u32, u32)> = Box::leak(Box::new(Cell::new((0, 0))));
    let (mut due_ms, mut erased) = (0, false);
    processor.chores = Box::new(move |now| {
        let began_ms = now / (1000 * CLOCKS_PER_US);
        now_ms.set(began_ms);
        store.tend(3).expect("the flash is sound");
        let (mut stored, mut erases) = counts.get();
        erases += u32::from(erasing.get().is_some() && !erased);
        erased = erasing.get().is_some();
        if began_ms >= due_ms && store.append(&Settings::default()).is_ok() {
            due_ms = began_ms + 1500;
            stored += 1;
        }
        counts.set((stored, erases));
        (now_ms.get() - began_ms) * 1000 * CLOCKS_PER_US
    });
    fly(120, &mut source, &mut processor);
    let (stored, erases) = counts.get();
    println!(
        "stored {stored} times, {erases} erases of {ERASE_MS} ms a sector; {:?}, {} dropped",
        processor.front_end.counters(),
        processor.world.driver.dropped
    );
    assert!(stored > 20 && erases >= 3);
    all_come(&source, &processor);
}

/// Clock by clock or as far as nothing happens: the model is the same.
#[test]
fn one_clock_at_a_time_or_many_at_once() {
    let mut random = Random::new(13);
    for round in 0..300 {
        let mut source = Source::new(round, 1);
        source.sound = 100;
        let mut driver = world().driver;
        source.sweep(0, &mut driver);
        let transfer = driver.queue.pop_front().expect("a frame");
        // A frame of which most has been taken, so that its end comes soon.
        let mut runs = Vec::new();
        for _ in 0..1 + random.below(6) {
            runs.push(data(1 + random.below(400)));
            runs.push(pause(1 + random.below(20)));
        }
        let make = || {
            let mut world = world();
            world.fills_up = round.is_multiple_of(2);
            world.driver.queue.push_back(Transfer {
                from: 0,
                until: u64::MAX,
                runs: runs.clone(),
                ..transfer.clone()
            });
            world.arm();
            world.ready(true);
            world
        };
        let (mut fast, mut slow) = (make(), make());
        let (at, taken) = (random.below(1000), random.below(60));
        while fast.now < 4000 {
            let end = fast.now + 1 + random.below(300);
            while slow.now < end {
                slow.advance(slow.now + 1);
            }
            fast.advance(end);
            if (at..at + 300).contains(&fast.now) {
                fast.bus_taken_until = fast.now + taken;
                slow.bus_taken_until = fast.now + taken;
            }
            assert_eq!(fast.seen(), slow.seen(), "round {round}, clock {end}");
            assert_eq!(fast.buffer.header, slow.buffer.header);
            assert_eq!(fast.buffer.samples, slow.buffer.samples);
            assert_eq!(fast.interrupt, slow.interrupt);
        }
        assert!(fast.seen().ended || fast.seen().overrun, "round {round}");
    }
}

//! Settings through power that fails at every byte.

mod flash;

use std::cell::Cell;

use cslam_firmware::storage::{
    EarthField, GmtPlace, Mount, RadioSettings, SLOT, Settings, StorageError, Store,
};

use flash::slow::{ERASE_MS, Slow};
use flash::{Flash, SECTOR};

fn settings(number: u32) -> Settings {
    Settings {
        uav: 3,
        mount: Mount::new([-2, 1, 3]).expect("a quarter turn"),
        key: (number & 2 == 0).then_some([number as u8; 32]),
        downlink_counter: 1024 * number,
        uplink_counter: number,
        session: number as u16,
        gmt_place: GmtPlace::new([number as i32, -7, 1500], 1000).filter(|_| number & 1 == 0),
        magnetic_field: EarthField::new(48_000, 65_000, -(number as i32)).filter(|_| number & 4 == 0),
        radio: (number & 6 == 2).then_some(RadioSettings {
            carrier_khz: 28_000_000 + number,
            sequence: [409, 136],
            radius_tenth_mm: 2_000,
            tilt_udeg: -35_264_390,
            spacing: [50_000, 45_000],
            sector_cdeg: 6_000,
            elevations_udeg: [0, 12_000_000, 25_000_000],
        }),
    }
}

#[test]
fn what_was_stored_last_is_found() {
    let mut flash = Flash::<2>::new();
    // Four records a half: over both halves several times.
    for number in 0..30 {
        let mut store = Store::open(&mut flash).expect("two halves");
        match number {
            0 => assert_eq!(store.settings(), Err(StorageError::Empty)),
            _ => assert_eq!(store.settings(), Ok(&settings(number - 1))),
        }
        store.store(&settings(number)).expect("power is on");
        assert_eq!(store.settings(), Ok(&settings(number)));
    }
    // An erase for every four records but the first four.
    assert_eq!(flash.erases, 7);
}

#[test]
fn power_that_fails_at_any_byte_leaves_the_old_or_the_new_record() {
    for torn_words_fail in [true, false] {
        // Records before the cut, so that it falls on the first record, within a half, and on a change of halves.
        for before in 0..10 {
            let mut whole = Flash::<2>::new();
            whole.torn_words_fail = torn_words_fail;
            let mut store = Store::open(&mut whole).expect("two halves");
            for number in 0..before {
                store.store(&settings(number)).expect("power is on");
            }
            let (mut old, mut new) = (0, 0);
            for cut in 0..=SECTOR + SLOT {
                let mut flash = whole.clone();
                flash.power = cut;
                let stored = Store::open(&mut flash)
                    .expect("two halves")
                    .store(&settings(before));
                flash.power = usize::MAX;
                let mut store = Store::open(&mut flash).expect("two halves");
                let found = store.settings().cloned();
                if found == Ok(settings(before)) {
                    new += 1;
                } else {
                    assert!(stored.is_err(), "cut {cut}: a record that was stored is gone");
                    old += 1;
                    match before {
                        0 => assert!(found.is_err()),
                        _ => assert_eq!(found, Ok(settings(before - 1)), "cut {cut}"),
                    }
                }
                // Life goes on: through both halves again.
                for number in 100..110 {
                    store.store(&settings(number)).expect("power is on");
                }
                let store = Store::open(&mut flash).expect("two halves");
                assert_eq!(store.settings(), Ok(&settings(109)));
            }
            // The last byte of a record is that of its checksum.
            let changes_halves = before > 0 && before % 4 == 0;
            let needed = if changes_halves { SECTOR + SLOT } else { SLOT };
            assert_eq!((old, new), (needed, SECTOR + SLOT + 1 - needed));
        }
    }
}

#[test]
fn power_that_fails_again_and_again_never_loses_what_was_stored() {
    let mut flash = Flash::<2>::new();
    let mut word = 12_345u32;
    let mut last = None;
    for number in 0..3000 {
        word = word.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        flash.power = (word >> 16) as usize % (SECTOR + 2 * SLOT);
        let stored = Store::open(&mut flash)
            .expect("two halves")
            .store(&settings(number));
        flash.power = usize::MAX;
        let store = Store::open(&mut flash).expect("two halves");
        match store.settings() {
            Ok(found) if *found == settings(number) => last = Some(number),
            found => {
                assert!(stored.is_err());
                assert_eq!(found.ok().cloned(), last.map(settings));
            }
        }
    }
    assert!(last.is_some());
}

#[test]
fn room_is_made_before_it_is_needed() {
    let mut flash = Flash::<2>::new();
    let mut store = Store::open(&mut flash).expect("two halves");
    assert_eq!(store.make_room(4), Ok(()), "four are left");
    assert_eq!(store.make_room(5), Err(StorageError::Empty));
    store.store(&settings(0)).expect("power is on");
    for (slots, left) in [(3, 3), (4, 3), (3, 3), (4, 3)] {
        store.make_room(slots).expect("power is on");
        assert_eq!(store.left(), left);
        assert_eq!(store.settings(), Ok(&settings(0)));
    }
    for number in 1..=3 {
        store.store(&settings(number)).expect("power is on");
    }
    assert_eq!(store.left(), 0);
    let store = Store::open(&mut flash).expect("two halves");
    assert_eq!((store.settings(), store.left()), (Ok(&settings(3)), 0));
    assert_eq!(
        flash.erases, 2,
        "once for each time that there was too little room"
    );
}

#[test]
fn worn_words_are_passed_over_and_a_worn_flash_keeps_what_it_has() {
    let mut flash = Flash::<2>::new();
    flash.worn[5] = true;
    let mut store = Store::open(&mut flash).expect("two halves");
    store.store(&settings(0)).expect("the first slot is good");
    store.store(&settings(1)).expect("the third slot is good");
    assert_eq!(Store::open(&mut flash).expect("two halves").refused(), 1);
    flash.worn[8..].fill(true);
    flash.worn[12..16].fill(true);
    let mut store = Store::open(&mut flash).expect("two halves");
    for _ in 0..50 {
        assert_eq!(store.store(&settings(2)), Err(StorageError::Worn));
        assert_eq!(store.settings(), Ok(&settings(1)));
    }
    let store = Store::open(&mut flash).expect("two halves");
    assert_eq!(store.settings(), Ok(&settings(1)));
}

#[test]
fn a_memory_that_cannot_be_halved_is_refused() {
    let mut flash = Flash::<3>::new();
    assert_eq!(
        Store::open(&mut flash).err(),
        Some(StorageError::Geometry {
            capacity: 3 * SECTOR,
            sector: SECTOR
        })
    );
    let mut flash = Flash::<0>::new();
    assert!(Store::open(&mut flash).is_err());
}

#[test]
fn records_of_another_version_are_named() {
    let mut flash = Flash::<2>::new();
    let mut store = Store::open(&mut flash).expect("two halves");
    store.store(&settings(0)).expect("power is on");
    flash.bytes[4] = 9;
    let error = Store::open(&mut flash)
        .expect("two halves")
        .settings()
        .cloned()
        .expect_err("damaged");
    assert!(error.to_string().contains("checksum"), "{error}");
}

#[test]
fn the_key_is_never_printed() {
    let shown = format!("{:?}", settings(0));
    assert!(
        shown.contains("has_key: true") && !shown.contains("0, 0, 0"),
        "{shown}"
    );
}

/// Rounds of a receiver, one a millisecond: it looks after its flash and stores when `due`. Gives the longest round, ms, and how many times
/// something was stored.
fn rounds(
    store: &mut Store<Slow<'_>>,
    now_ms: &Cell<u64>,
    number: u32,
    due: impl Fn(u64) -> bool,
) -> (u64, u32) {
    let (mut longest, mut stored, mut waits) = (0, 0, false);
    for _ in 0..60_000 {
        let began = now_ms.get();
        now_ms.set(began + 1);
        store.tend(3).expect("power is on");
        waits |= due(began);
        if waits {
            match store.append(&settings(number + stored)) {
                Ok(()) => {
                    assert_eq!(store.settings(), Ok(&settings(number + stored)));
                    (stored, waits) = (stored + 1, false);
                }
                Err(error) => assert_eq!(error, StorageError::Busy),
            }
        }
        longest = longest.max(now_ms.get() - began);
    }
    (longest, stored)
}

#[test]
fn an_erase_in_flight_holds_nothing_up() {
    let (now_ms, erasing) = (Cell::new(0), Cell::new(None));
    let mut flash = Flash::<4>::new();
    let slow = Slow {
        flash: &mut flash,
        now_ms: &now_ms,
        erasing: &erasing,
        fails: false,
    };
    let mut store = Store::open(slow).expect("two halves of two sectors");
    store.store(&settings(0)).expect("power is on");
    // Every other second: through both halves, of eight records each, several times.
    let (longest_ms, stored) = rounds(&mut store, &now_ms, 1, |ms| ms.is_multiple_of(2000));
    println!("longest round {longest_ms} ms, stored {stored} times");
    assert_eq!(
        longest_ms, 1,
        "an erase takes {ERASE_MS} ms for each of two sectors"
    );
    assert!(stored > 20, "stored only {stored} times");
    let store = Store::open(&mut flash).expect("two halves");
    assert_eq!(store.settings(), Ok(&settings(stored)));
    assert!(flash.erases >= 4, "{} erases", flash.erases);
}

#[test]
fn power_that_fails_in_an_erase_in_flight_leaves_the_newest_record() {
    let mut cuts = 0;
    for cut_ms in (0..60_000).step_by(1000) {
        let (now_ms, erasing) = (Cell::new(0), Cell::new(None));
        let mut flash = Flash::<4>::new();
        let slow = Slow {
            flash: &mut flash,
            now_ms: &now_ms,
            erasing: &erasing,
            fails: false,
        };
        let mut store = Store::open(slow).expect("two halves");
        store.store(&settings(0)).expect("power is on");
        let mut newest = 0;
        for number in 1.. {
            if now_ms.get() >= cut_ms {
                break;
            }
            for _ in 0..1000 {
                now_ms.set(now_ms.get() + 1);
                store.tend(3).expect("power is on");
            }
            if store.append(&settings(number)).is_ok() {
                newest = number;
            }
        }
        if let Some((sector, _)) = erasing.get() {
            cuts += 1;
            // Half of it is erased by now, say.
            let middle = sector as usize + SECTOR / 2;
            flash.bytes[sector as usize..middle].fill(0xff);
            flash.tear(middle..middle + SECTOR / 2);
        }
        let mut store = Store::open(&mut flash).expect("two halves");
        assert_eq!(store.settings(), Ok(&settings(newest)), "cut at {cut_ms} ms");
        for number in 100..120 {
            store.store(&settings(number)).expect("power is on");
        }
    }
    assert!(cuts > 20, "only {cuts} cuts fell into an erase");
}

#[test]
fn a_half_that_cannot_be_erased_is_said_once_and_this_one_is_used_to_its_end() {
    let (now_ms, erasing) = (Cell::new(0), Cell::new(None));
    let mut flash = Flash::<4>::new();
    let slow = Slow {
        flash: &mut flash,
        now_ms: &now_ms,
        erasing: &erasing,
        fails: true,
    };
    let mut store = Store::open(slow).expect("two halves");
    for number in 0..6 {
        store.append(&settings(number)).expect("there is room");
    }
    let mut errors = 0;
    for _ in 0..10_000 {
        now_ms.set(now_ms.get() + 1);
        errors += u32::from(store.tend(3).is_err());
    }
    assert_eq!(errors, 1);
    for number in 6..8 {
        store.append(&settings(number)).expect("there is room");
    }
    assert_eq!(store.append(&settings(8)), Err(StorageError::Worn));
    assert_eq!(store.settings(), Ok(&settings(7)));
}

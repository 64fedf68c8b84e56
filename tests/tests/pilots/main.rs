//! A front end that hands over no pilots, some of them, or others than it says: the receiver estimates the same paths, to the bit, makes up
//! no range rate, and counts what it refuses.
//!
//! Long: every fault of a pilot, of one flight.

mod flight;

use std::collections::BTreeSet;

use cslam_core::receiver::Pilots;
use cslam_core::signal::Iq;
use cslam_firmware::front_end::{
    BEAMS, FRAMES_PER_SWEEP, FrameError, HEADER_LENGTH, Header, Kind, read_samples,
};
use cslam_host_sim::random::Stream;
use cslam_host_sim::raw_flight::{FrameBytes, FrontEndLink, Recorder, board_config, with_board_receiver};
use cslam_host_sim::scene::Scene;
use cslam_host_sim::sensors::Event;

use flight::{
    Estimated, Log, PER_SWEEP, change_header, fill, header, heard, heard_by, heard_with, is_pilot, is_second,
    sound, sweeps, world,
};

#[test]
fn a_sound_front_end_tells_how_fast_paths_grow() {
    for frames in sweeps() {
        let kinds: Vec<Kind> = frames.iter().map(|frame| header(frame).kind).collect();
        assert_eq!(kinds.len(), usize::from(FRAMES_PER_SWEEP));
        assert!(kinds[1..73].iter().all(|kind| *kind == Kind::Beam));
        assert!(kinds[73..73 + PER_SWEEP].iter().all(|kind| *kind == Kind::Pilot));
        let numbers: Vec<u16> = frames[73..73 + PER_SWEEP]
            .iter()
            .map(|frame| header(frame).index)
            .collect();
        // Of the strongest beams, of each the first one and then the second.
        for (pair, beam) in numbers.as_chunks::<2>().0.iter().zip(&frames[1..]) {
            let beam = header(beam).index;
            assert_eq!(*pair, [beam, BEAMS + beam]);
        }
    }
    let sound = sound();
    sound.is_sound_but_for(0, 0, "sound");
    let paths: usize = sound.sweeps.iter().map(|sweep| sweep.paths.len()).sum();
    println!(
        "{} rates of {paths} paths in {} sweeps",
        sound.rates(),
        sound.sweeps.len()
    );
    assert!(sound.rates() * 10 > paths * 7, "{} of {paths}", sound.rates());
    for rate in sound.sweeps.iter().flat_map(|sweep| &sweep.rates).flatten() {
        assert!(rate.m_per_s.abs() <= 0.5 * rate.period_m_per_s, "{rate:?}");
        // A third of a radian at most, of a whole turn.
        assert!(rate.sigma_m_per_s < 0.06 * rate.period_m_per_s, "{rate:?}");
    }
}

#[test]
fn pilots_are_read_from_the_first_pose_on() {
    let config = board_config().expect("the board's");
    assert_eq!(config.pilots, Pilots::WithPose);
    // Before there is a pose nobody asks how fast paths grow.
    let lost = heard_by(config, |_| {});
    lost.is_sound_but_for(0, 0, "by default");
    assert_eq!(lost.rates(), 0);
    let scene = Scene::load("outdoor").expect("built in");
    // Long enough for walls to hide the GMT while there is a pose.
    let world = world(&scene, 40.0);
    let (mut log, mut recorder, mut link) = (Log::default(), Recorder::default(), FrontEndLink::default());
    with_board_receiver(|receiver| {
        let mut samples = Box::new([[Iq::ZERO; 512]; 32]);
        for stamped in world.flight().events() {
            if let Some(record) = recorder.record(&stamped) {
                receiver.record(&record.encode(), &mut log)?;
            }
            if let Event::Sweep { sweep } = stamped.event {
                link.sweep(&mut world.sweep(sweep)?, stamped.uav_time_ns, |frame| {
                    let (header, payload) = frame.split_at(HEADER_LENGTH);
                    read_samples(payload.try_into()?, &mut samples);
                    receiver.frame(header.try_into()?, &mut samples, &mut log)?;
                    Ok(())
                })?;
            }
        }
        receiver.end(&mut log);
        Ok(())
    })
    .expect("a receiver");
    let first = log.sweeps.iter().position(|sweep| sweep.placed);
    let (before, after) = log.sweeps.split_at(first.expect("a pose") + 1);
    let rates = |sweep: &Estimated| sweep.rates.iter().flatten().count();
    assert_eq!(before.iter().map(rates).sum::<usize>(), 0);
    // Whatever walls hide: of one path alone, a rate tells nothing.
    for is_sighted in [true, false] {
        let of: Vec<_> = after
            .iter()
            .filter(|sweep| sweep.sighted.is_some() == is_sighted && sweep.paths.len() > 1)
            .collect();
        let told = of.iter().filter(|sweep| rates(sweep) > 1).count();
        println!(
            "line of sight: {is_sighted}; {told} of {} sweeps with rates",
            of.len()
        );
        assert!(of.len() > 2 && 2 * told > of.len());
    }
}

#[test]
fn without_pilots_or_with_half_of_them_there_is_no_rate() {
    type Keeps = fn(&FrameBytes) -> bool;
    let kinds: [(&str, Keeps); 3] = [
        ("none", |frame| !is_pilot(frame)),
        ("first ones", |frame| !is_pilot(frame) || !is_second(frame)),
        ("second ones", |frame| !is_pilot(frame) || is_second(frame)),
    ];
    for (name, keeps) in kinds {
        let heard = heard(|flight| {
            flight
                .iter_mut()
                .for_each(|frames| frames.retain(|frame| keeps(frame)))
        });
        heard.is_sound_but_for(0, 0, name);
        assert_eq!(heard.rates(), 0, "{name}");
    }
}

#[test]
fn first_pilots_of_one_sweep_do_not_go_with_second_ones_of_the_next() {
    let heard = heard(|flight| {
        for (number, frames) in flight.iter_mut().enumerate() {
            frames.retain(|frame| !is_pilot(frame) || is_second(frame) == (number % 2 == 1));
        }
    });
    heard.is_sound_but_for(0, 0, "half a pair");
    assert_eq!(heard.rates(), 0);
}

#[test]
fn a_second_pilot_before_the_first_gives_no_rate() {
    let swapped = heard(|flight| {
        for frames in flight {
            for pair in frames[73..73 + PER_SWEEP].as_chunks_mut::<2>().0 {
                pair.reverse();
            }
        }
    });
    swapped.is_sound_but_for(0, 0, "swapped");
    assert_eq!(swapped.rates(), 0);
    // Beams in any order, and behind the squint symbols: nothing changes.
    let elsewhere = heard(|flight| {
        for frames in flight {
            frames[73..73 + PER_SWEEP].sort_by_key(|frame| header(frame).index);
            frames[73..].rotate_left(PER_SWEEP);
        }
    });
    elsewhere.is_sound_but_for(0, 0, "elsewhere");
    assert_eq!(elsewhere.sweeps, sound().sweeps);
}

#[test]
fn pilots_of_beams_without_a_path_are_not_used() {
    let mut sweeps = sound().sweeps.iter();
    let heard = heard(|flight| {
        for frames in flight {
            let found = sweeps.next().expect("as many");
            let used: BTreeSet<u16> = found.paths.iter().map(|path| path.beam).collect();
            let empty: Vec<u16> = (0..BEAMS).filter(|beam| !used.contains(beam)).collect();
            for (place, frame) in frames[73..73 + PER_SWEEP].iter_mut().enumerate() {
                let index = empty[place / 2] + place as u16 % 2 * BEAMS;
                change_header(frame, |header| Header { index, ..header });
            }
        }
    });
    heard.is_sound_but_for(0, 0, "empty beams");
    assert_eq!(heard.rates(), 0);
}

#[test]
fn pilots_that_come_in_the_next_sweep_are_late() {
    let mut late = 0;
    let heard = heard(|flight| {
        let mut held = Vec::new();
        for frames in flight {
            let pilots = frames.drain(73..73 + PER_SWEEP).collect();
            late += held.len();
            // Behind its begin, its beams and one of its symbols.
            frames.splice(80..80, std::mem::replace(&mut held, pilots));
        }
    });
    assert!(late >= 10 * PER_SWEEP);
    heard.is_sound_but_for(late, 0, "late");
    assert_eq!(heard.rates(), 0);
}

#[test]
fn a_beam_behind_a_pilot_is_counted() {
    const AHEAD: usize = 40;
    let heard = heard(|flight| {
        for frames in flight {
            frames[AHEAD + 1..74].rotate_right(1);
        }
    });
    let stray = (usize::from(BEAMS) - AHEAD) * heard.sweeps.len();
    assert_eq!(heard.stray_blocks as usize, stray);
}

#[test]
fn pilots_of_zeros_give_no_rate() {
    type Hits = fn(&FrameBytes) -> bool;
    let kinds: [(&str, Hits); 3] = [
        ("both", |_| true),
        ("first", |frame| !is_second(frame)),
        ("second", is_second),
    ];
    for (name, hits) in kinds {
        let heard = heard_with(|frame| {
            if hits(frame) {
                fill(frame, || Iq::ZERO);
            }
        });
        heard.is_sound_but_for(0, 0, name);
        assert_eq!(heard.rates(), 0, "{name}");
    }
}

#[test]
fn pilots_of_noise_give_no_rate() {
    for (amplitude, exponent) in [
        (30.0, None),
        (8_000.0, None),
        (8_000.0, Some(-128)),
        (8_000.0, Some(128)),
    ] {
        for (name, hits) in [
            ("both", [true, true]),
            ("first", [true, false]),
            ("second", [false, true]),
        ] {
            let mut noise = Stream::new(5, 1);
            let heard = heard_with(|frame| {
                if !hits[usize::from(is_second(frame))] {
                    return;
                }
                let mut part = || (amplitude * noise.normal()) as i16;
                fill(frame, || Iq::new(part(), part()));
                if let Some(exponent) = exponent {
                    change_header(frame, |header| Header { exponent, ..header });
                }
            });
            let name = format!("{name}, amplitude {amplitude}, exponent {exponent:?}");
            heard.is_sound_but_for(0, 0, &name);
            let told: Vec<_> = heard
                .sweeps
                .iter()
                .flat_map(|sweep| &sweep.rates)
                .flatten()
                .collect();
            assert!(told.is_empty(), "{name}: {told:?}");
        }
    }
}

#[test]
fn a_pilot_of_no_beam_is_refused_and_counted() {
    for first in [144, u16::MAX - 143] {
        let heard = heard_with(|frame| {
            let index = first + header(frame).index;
            frame[16..18].copy_from_slice(&index.to_le_bytes());
        });
        heard.is_sound_but_for(0, PER_SWEEP * heard.sweeps.len(), "out of range");
        assert_eq!(heard.rates(), 0);
        let is_named = |error: &FrameError| matches!(error, FrameError::Index { kind: Kind::Pilot, found, limit: 144 } if *found >= first);
        assert!(heard.refused.iter().all(is_named), "{:?}", heard.refused.first());
    }
}

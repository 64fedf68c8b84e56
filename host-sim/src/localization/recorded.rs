//! A flight as the receiver's localization is given it: every sample and measurement, one after the other, in the form
//! that the firmware's check reads. The same flight and the same faults whenever the same figures are given.

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_firmware::flight_check::{self, PATHS};
use nalgebra::Vector3;

use super::fly::{PROCESSING_NS, Receiver, transmitter};
use super::{Prepared, Scenario, TruePath, TrueSweep, planes_of};
use crate::flight::FlightConfig;
use crate::input::InputError;
use crate::scene::Scene;
use crate::sensors::{Beacon, Event, SensorsConfig};

/// A flight as events, and the truth that goes with it.
#[derive(Debug)]
pub struct RecordedFlight {
    /// What the receiver gets, in the order in which it gets it: first the planes of the map.
    pub events: Vec<flight_check::Event>,
    /// Truth at every sweep.
    pub truth: Vec<TrueSweep>,
}

impl RecordedFlight {
    /// Plans, traces, senses and measures the flight of `seed`. Faults are those of `sensors`.
    ///
    /// # Errors
    /// [`InputError`] when a figure is out of range or the scene has no room.
    pub fn new(
        scene: &Scene,
        flight: &FlightConfig,
        sensors: &SensorsConfig,
        scenario: &Scenario,
        seed: u64,
    ) -> Result<Self, InputError> {
        let prepared = Prepared::new(scene, flight, sensors, seed)?;
        let mut receiver = Receiver::new(&prepared, &planes_of(scene), scenario);
        let map = receiver.map.iter().copied().take(flight_check::MAP_PLANES);
        let mut events: Vec<_> = map.map(flight_check::Event::Plane).collect();
        let (mut begun, mut waiting) = (None, None);
        for stamped in prepared.sensed.events() {
            let time_ns = stamped.uav_time_ns;
            // A sweep's paths are there when its processing has ended.
            if let Some((start_ns, beacon)) =
                waiting.take_if(|(start_ns, _)| time_ns >= *start_ns + PROCESSING_NS)
            {
                events.push(measured(&prepared, &mut receiver, start_ns, &beacon));
            }
            match stamped.event {
                Event::Imu(sample) => events.push(flight_check::Event::Imu(sample.at(time_ns))),
                Event::Magnetometer(sample) => events.push(flight_check::Event::Magnetic {
                    time_ns,
                    field_ut: narrow(&sample.field_ut()),
                }),
                Event::Timing(sample) => {
                    if !receiver.timing_lost(time_ns) {
                        let offset_m = sample.clock_offset_s * SPEED_OF_LIGHT_M_PER_S;
                        events.push(flight_check::Event::TwoWay { time_ns, offset_m });
                    }
                }
                Event::Barometer(_) => {}
                Event::Sweep { sweep } => {
                    events.push(flight_check::Event::Begin { time_ns });
                    begun = Some((sweep, time_ns));
                }
                // A sweep is of use when the beacon after it has said where the GMT was.
                Event::Beacon(beacon) => {
                    if let Some((_, start_ns)) = begun.take().filter(|(sweep, _)| *sweep == beacon.sweep) {
                        waiting = Some((start_ns, beacon));
                    }
                }
            }
        }
        Ok(Self {
            events,
            truth: prepared.sweeps,
        })
    }

    /// The events as bytes.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for event in &self.events {
            event.encode(&mut |part| bytes.extend_from_slice(part));
        }
        bytes
    }
}

/// What a receiver makes of the sweep that a beacon tells of.
fn measured(
    prepared: &Prepared,
    receiver: &mut Receiver<'_>,
    time_ns: u64,
    beacon: &Beacon,
) -> flight_check::Event {
    let truth = &prepared.sweeps[beacon.sweep as usize];
    let shift_m = prepared.sensed.wrong_fix_m(beacon.sweep);
    let seen = receiver.sweep(beacon.sweep, &displaced(truth, &shift_m));
    let room = PATHS - usize::from(seen.sight.is_some());
    let reflections = seen.reflections.into_iter().take(room);
    flight_check::Event::Sweep(flight_check::Sweep {
        time_ns,
        stop: beacon.sweep / beacon.sweeps_per_stop.max(1),
        gmt: transmitter(beacon),
        mast_rad: beacon.heading_pitch_roll_rad,
        line_of_sight: seen.sight,
        reflections: reflections
            .map(|reflected| flight_check::Reflected {
                path: reflected.path,
                planes: reflected.planes.iter().map(|plane| plane.id).collect(),
            })
            .collect(),
    })
}

fn narrow(v: &Vector3<f64>) -> Vector3<f32> {
    v.map(|c| c as f32)
}

/// A sweep whose line of sight is that of another place.
fn displaced(truth: &TrueSweep, shift_m: &Vector3<f64>) -> TrueSweep {
    let mut seen = truth.clone();
    if *shift_m != Vector3::zeros() {
        let way = truth.gmt_m - truth.motion.position_m - shift_m;
        let direction = way.normalize();
        seen.paths.retain(|path| path.order != 0);
        seen.paths.insert(
            0,
            TruePath {
                order: 0,
                length_m: way.norm(),
                arrival: direction,
                departure: -direction,
                planes: [None; 2],
            },
        );
    }
    seen
}

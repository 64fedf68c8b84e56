//! Events of a flight as bytes, little-endian: a head of 16 bytes (kind, number of paths, flags, a zero, a 32-bit number, the time
//! stamp in ns), then a body whose length the head tells.
//!
//! | kind | number | body |
//! |---|---|---|
//! | 1 inertial sample | | rate x y z (rad/s), specific force x y z (m/s^2): f32 |
//! | 2 two-way timing | | clock offset, m: f64 |
//! | 3 magnetometer | | field x y z, uT: f32 |
//! | 4 plane of the map | its id | normal x y z, centre x y z (m), covariance by columns: f32 |
//! | 5 sweep | the GMT's stop | GMT x y z and sigma (m), heading, pitch, roll (rad), then every path: f64 |
//! | 6 beginning of a sweep | | |
//!
//! A path is c tau and its sigma (m), AoA x y z (body axes) and its sigma (rad), face of departure (-1 for none), its two
//! cosines and their sigmas, the planes that reflected it from the GMT on (-1 for none): f64. Flag 1: the first path is the line of sight.

use cslam_core::geometry::{Direction, Matrix3, Plane, Position, Rotation, Vector3};
use cslam_core::localization::ImuSample;
use cslam_core::localization::filter::{
    Bounces, FaceDirection, MappedPlane, PathMeasurement, ReflectedPath, Transmitter,
};
use embedded_io::{Read, ReadExactError};

use super::FlightCheckError;

/// Most paths of a sweep: line of sight and eight reflections.
pub const PATHS: usize = 9;
/// Length of the head, bytes.
const HEAD: usize = 16;
/// Numbers of a sweep's body before its paths, and of a path.
const SWEEP_NUMBERS: usize = 7;
const PATH_NUMBERS: usize = 14;
/// Longest event, bytes.
pub const MAX_EVENT: usize = HEAD + 8 * (SWEEP_NUMBERS + PATHS * PATH_NUMBERS);

/// A sweep as the path estimation left it.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    /// UAV clock at its start, ns.
    pub time_ns: u64,
    /// Number of the GMT's stop.
    pub stop: u32,
    /// The GMT by its beacon.
    pub gmt: Transmitter,
    /// Attitude of its mast as the beacon tells it: heading, pitch, roll, rad.
    pub mast_rad: [f64; 3],
    /// The line of sight.
    pub line_of_sight: Option<PathMeasurement>,
    /// Reflected paths.
    pub reflections: heapless::Vec<Reflected, PATHS>,
}

/// A path with the planes of the map that reflected it.
#[derive(Clone, Debug, PartialEq)]
pub struct Reflected {
    /// The path.
    pub path: PathMeasurement,
    /// Their numbers, from the GMT on.
    pub planes: heapless::Vec<u32, 2>,
}

impl Sweep {
    /// Its reflected paths with the planes as they are known; those of an unknown plane are left out.
    pub fn reflected(&self, planes: &[MappedPlane]) -> heapless::Vec<ReflectedPath, PATHS> {
        let mut reflected = heapless::Vec::new();
        for path in &self.reflections {
            let mut met = Bounces::new();
            for id in &path.planes {
                if let Some(plane) = planes.iter().find(|plane| plane.id == *id) {
                    let _fits = met.push(*plane);
                }
            }
            if !met.is_empty() && met.len() == path.planes.len() {
                let _fits = reflected.push(ReflectedPath {
                    path: path.path,
                    planes: met,
                });
            }
        }
        reflected
    }
}

/// What happens in a flight.
#[derive(Clone, Debug, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "a value lives for one round of a loop; there is no heap to box it in"
)]
pub enum Event {
    /// A sample of the inertial sensor.
    Imu(ImuSample),
    /// A two-way timing exchange.
    TwoWay {
        /// UAV clock, ns.
        time_ns: u64,
        /// Clock offset as a length, m.
        offset_m: f64,
    },
    /// A sample of the magnetometer.
    Magnetic {
        /// UAV clock, ns.
        time_ns: u64,
        /// Field in body axes, uT.
        field_ut: Vector3<f32>,
    },
    /// A plane of the map.
    Plane(MappedPlane),
    /// A sweep begins; its paths come later.
    Begin {
        /// UAV clock, ns.
        time_ns: u64,
    },
    /// A sweep.
    Sweep(Sweep),
}

/// Reads the next event; `None` at the end of the stream.
pub(super) fn read<R: Read>(recording: &mut R) -> Result<Option<Event>, FlightCheckError<R::Error>> {
    let mut bytes = [0; MAX_EVENT];
    let (head, body) = bytes.split_at_mut(HEAD);
    // A stream may end between events, nowhere else.
    let first = recording.read(head).map_err(ReadExactError::Other)?;
    let Some(rest) = head.get_mut(first..).filter(|_| first > 0) else {
        return Ok(None);
    };
    recording.read_exact(rest)?;
    let length = body_length(head).ok_or(FlightCheckError::Event)?;
    let body = body.get_mut(..length).ok_or(FlightCheckError::Event)?;
    recording.read_exact(body)?;
    decode(head, body).map(Some).ok_or(FlightCheckError::Event)
}

fn body_length(head: &[u8]) -> Option<usize> {
    match (*head.first()?, usize::from(*head.get(1)?)) {
        (1, 0) => Some(24),
        (2, 0) => Some(8),
        (3, 0) => Some(12),
        (4, 0) => Some(60),
        (6, 0) => Some(0),
        (5, paths) if paths <= PATHS => Some(8 * (SWEEP_NUMBERS + paths * PATH_NUMBERS)),
        _ => None,
    }
}

/// An event from its head and its body; `None` when it is not one.
fn decode(head: &[u8], body: &[u8]) -> Option<Event> {
    let [kind, _, flags, _, n0, n1, n2, n3, time @ ..] = *head.first_chunk::<HEAD>()?;
    let (number, time_ns) = (u32::from_le_bytes([n0, n1, n2, n3]), u64::from_le_bytes(time));
    let mut narrow = body.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b));
    let mut wide = body.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b));
    Some(match kind {
        1 => Event::Imu(ImuSample {
            time_ns,
            rate_rad_per_s: vector(&mut narrow)?,
            specific_force_m_per_s2: vector(&mut narrow)?,
        }),
        2 => Event::TwoWay {
            time_ns,
            offset_m: wide.next()?,
        },
        3 => Event::Magnetic {
            time_ns,
            field_ut: vector(&mut narrow)?,
        },
        4 => Event::Plane(MappedPlane {
            id: number,
            plane: Plane {
                normal: Direction::from_vector(vector(&mut narrow)?).ok()?,
                centre: Position::from_vector(vector(&mut narrow)?).ok()?,
                covariance: Matrix3::from_columns(&[
                    vector(&mut narrow)?,
                    vector(&mut narrow)?,
                    vector(&mut narrow)?,
                ]),
            },
        }),
        5 => {
            let position_m = vector(&mut wide)?;
            let sigma_m = wide.next()?;
            let mast_rad: [f64; 3] = vector(&mut wide)?.into();
            let [yaw, pitch, roll] = mast_rad;
            let mut paths = heapless::Vec::<Reflected, PATHS>::new();
            for numbers in body.get(8 * SWEEP_NUMBERS..)?.chunks_exact(8 * PATH_NUMBERS) {
                paths.push(path(numbers)?).ok()?;
            }
            let line_of_sight = (flags & 1 != 0 && !paths.is_empty()).then(|| paths.remove(0).path);
            Event::Sweep(Sweep {
                time_ns,
                stop: number,
                gmt: Transmitter {
                    position_m,
                    sigma_m,
                    attitude: Rotation::from_yaw_pitch_roll(yaw, pitch, roll).ok()?,
                },
                mast_rad,
                line_of_sight,
                reflections: paths,
            })
        }
        6 => Event::Begin { time_ns },
        _ => return None,
    })
}

fn vector<T: Copy + PartialEq + core::fmt::Debug + 'static>(
    numbers: &mut impl Iterator<Item = T>,
) -> Option<Vector3<T>> {
    Some(Vector3::from([numbers.next()?, numbers.next()?, numbers.next()?]))
}

fn path(bytes: &[u8]) -> Option<Reflected> {
    let mut numbers = bytes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b));
    let (c_tau_m, c_tau_sigma_m) = (numbers.next()?, numbers.next()?);
    let aoa = Direction::from_vector(vector(&mut numbers)?).ok()?;
    let (aoa_sigma_rad, aoa_rise_sigma_rad) = (numbers.next()?, numbers.next()?);
    let face = numbers.next()?;
    let cosines = [numbers.next()?, numbers.next()?];
    let sigma = [numbers.next()?, numbers.next()?];
    let departure = [0.0, 1.0, 2.0]
        .iter()
        .position(|&number| number == face)
        .map(|face| FaceDirection { face, cosines, sigma });
    let mut planes = heapless::Vec::new();
    for id in [numbers.next()?, numbers.next()?] {
        if id >= 0.0 {
            planes.push(id as u32).ok()?;
        }
    }
    Some(Reflected {
        path: PathMeasurement {
            c_tau_m,
            c_tau_sigma_m,
            aoa,
            aoa_sigma_rad,
            aoa_rise_sigma_rad,
            departure,
        },
        planes,
    })
}

impl Event {
    /// The event as bytes, handed to `put` piece by piece.
    pub fn encode(&self, put: &mut dyn FnMut(&[u8])) {
        let head = |kind: u8, paths: usize, flags: [u8; 2], number: u32, time_ns: u64| {
            let mut bytes = [0; HEAD];
            bytes[0] = kind;
            bytes[1] = paths as u8;
            bytes[2..4].copy_from_slice(&flags);
            bytes[4..8].copy_from_slice(&number.to_le_bytes());
            bytes[8..].copy_from_slice(&time_ns.to_le_bytes());
            bytes
        };
        let narrow = |put: &mut dyn FnMut(&[u8]), v: &[f32]| v.iter().for_each(|x| put(&x.to_le_bytes()));
        let wide = |put: &mut dyn FnMut(&[u8]), v: &[f64]| v.iter().for_each(|x| put(&x.to_le_bytes()));
        match self {
            Self::Imu(sample) => {
                put(&head(1, 0, [0; 2], 0, sample.time_ns));
                narrow(put, sample.rate_rad_per_s.as_slice());
                narrow(put, sample.specific_force_m_per_s2.as_slice());
            }
            Self::TwoWay { time_ns, offset_m } => {
                put(&head(2, 0, [0; 2], 0, *time_ns));
                wide(put, &[*offset_m]);
            }
            Self::Magnetic { time_ns, field_ut } => {
                put(&head(3, 0, [0; 2], 0, *time_ns));
                narrow(put, field_ut.as_slice());
            }
            Self::Plane(MappedPlane { id, plane }) => {
                put(&head(4, 0, [0; 2], *id, 0));
                narrow(put, plane.normal.vector().as_slice());
                narrow(put, plane.centre.vector().as_slice());
                narrow(put, plane.covariance.as_slice());
            }
            Self::Begin { time_ns } => put(&head(6, 0, [0; 2], 0, *time_ns)),
            Self::Sweep(sweep) => {
                let paths = sweep.reflections.len() + usize::from(sweep.line_of_sight.is_some());
                let flags = [u8::from(sweep.line_of_sight.is_some()), 0];
                put(&head(5, paths, flags, sweep.stop, sweep.time_ns));
                wide(put, sweep.gmt.position_m.as_slice());
                wide(put, &[sweep.gmt.sigma_m]);
                wide(put, &sweep.mast_rad);
                let sight = sweep.line_of_sight.iter().map(|path| (path, None));
                let reflected = sweep.reflections.iter();
                let reflected = reflected.map(|reflected| (&reflected.path, Some(&reflected.planes)));
                for (path, planes) in sight.chain(reflected) {
                    wide(put, &[path.c_tau_m, path.c_tau_sigma_m]);
                    wide(put, path.aoa.vector().as_slice());
                    wide(put, &[path.aoa_sigma_rad, path.aoa_rise_sigma_rad]);
                    match &path.departure {
                        Some(d) => wide(
                            put,
                            &[d.face as f64, d.cosines[0], d.cosines[1], d.sigma[0], d.sigma[1]],
                        ),
                        None => wide(put, &[-1.0, 0.0, 0.0, 0.0, 0.0]),
                    }
                    let plane = |place: usize| {
                        planes
                            .and_then(|planes| planes.get(place))
                            .map_or(-1.0, |id| f64::from(*id))
                    };
                    wide(put, &[plane(0), plane(1)]);
                }
            }
        }
    }
}

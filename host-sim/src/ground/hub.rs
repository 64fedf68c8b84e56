//! What inputs, outputs and pages share: the state, the time, and the wish to end.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use super::station::Station;

/// Shared by every thread of a station.
#[derive(Debug)]
pub struct Hub {
    station: Mutex<Station>,
    start: Instant,
    start_unix_ns: u64,
    outputs: Vec<String>,
    scene: Option<String>,
    stop: AtomicBool,
}

impl Hub {
    /// A hub whose time starts now. `outputs` are recordings and links in words; `scene` is JSON that the page draws.
    pub fn new(station: Station, outputs: Vec<String>, scene: Option<String>) -> Self {
        let unix = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self {
            station: Mutex::new(station),
            start: Instant::now(),
            start_unix_ns: u64::try_from(unix.as_nanos()).unwrap_or(u64::MAX),
            outputs,
            scene,
            stop: AtomicBool::new(false),
        }
    }

    /// Time of the station, s since its start.
    pub fn now_s(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// Time of day at a time of the station, ns since 1970.
    pub fn unix_ns(&self, now_s: f64) -> u64 {
        self.start_unix_ns.saturating_add((now_s * 1e9) as u64)
    }

    /// Tells one run of the station from another.
    pub fn session(&self) -> u64 {
        self.start_unix_ns
    }

    /// The state. A thread that panicked leaves it as it was: counters may be off by one, nothing worse.
    pub fn station(&self) -> MutexGuard<'_, Station> {
        self.station.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Recordings and links in words.
    pub fn outputs(&self) -> &[String] {
        &self.outputs
    }

    /// A scene that the page draws behind the map, as JSON.
    pub fn scene(&self) -> Option<&str> {
        self.scene.as_deref()
    }

    /// Asks every thread to end.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Whether every thread is to end.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

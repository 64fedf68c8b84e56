//! Made-up UAVs that fly in real time on a thread of their own.

use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use cslam_core::telemetry::Key;
use cslam_host_sim::ground::flock::MadeUpUav;

/// Points a second of each UAV.
const POINTS_PER_S: f64 = 300.0;

/// UAVs in the air.
pub(crate) struct Fleet {
    flies: Arc<AtomicBool>,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Fleet {
    /// UAVs 1..=`count`, on the ground until [`Fleet::fly`].
    pub(crate) fn new(count: u8, to: SocketAddr) -> Self {
        let (flies, ends) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
        let (in_air, ended) = (Arc::clone(&flies), Arc::clone(&ends));
        let thread = thread::spawn(move || {
            let mut uavs: Vec<MadeUpUav> = (1..=count)
                .map(|id| MadeUpUav::new(id, &Key::TEST, 1, POINTS_PER_S))
                .collect();
            let socket = UdpSocket::bind("127.0.0.1:0").expect("a free port");
            let mut due = Instant::now();
            while !ended.load(Ordering::Relaxed) {
                due += Duration::from_millis(100);
                thread::sleep(due.saturating_duration_since(Instant::now()));
                if !in_air.load(Ordering::Relaxed) {
                    continue;
                }
                for frame in uavs.iter_mut().flat_map(MadeUpUav::step) {
                    // While the station is away, nobody hears.
                    let _unheard = socket.send_to(&frame, to);
                }
            }
        });
        Self {
            flies,
            ends,
            thread: Some(thread),
        }
    }

    /// Begins to send, or ends.
    pub(crate) fn fly(&self, flies: bool) {
        self.flies.store(flies, Ordering::Relaxed);
    }
}

impl Drop for Fleet {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _panicked = thread.join();
        }
    }
}

//! A flight that is shown while it is flown: at real-time speed, in real packets over a real socket, to a ground station of its
//! own.

use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use crate::ground::inputs::Udp;
use crate::ground::keys::Trust;
use crate::ground::{Inputs, Options, Running};
use crate::input::InputError;

/// How long a wish to end may go unheard.
const PATIENCE: Duration = Duration::from_millis(50);

/// A ground station beside a flight.
pub(super) struct Live {
    running: Running,
    socket: UdpSocket,
    to: SocketAddr,
    start: Instant,
    interrupted: Arc<AtomicBool>,
}

impl Live {
    /// Starts a station with its page at `http` and a scene behind the map, and says where the page is.
    pub(super) fn start(
        http: SocketAddr,
        scene: Option<&str>,
        interrupted: &Arc<AtomicBool>,
    ) -> anyhow::Result<Self> {
        let any = SocketAddr::from(([127, 0, 0, 1], 0));
        let input = Udp::open(any)?;
        let to = input.address();
        let inputs = Inputs::Live {
            udp: vec![input],
            #[cfg(unix)]
            serial: Vec::new(),
        };
        let options = Options {
            // A simulated flight signs with the published key.
            trust: Trust::Test,
            http,
            scene: scene.map(str::to_owned),
            ..Options::default()
        };
        // The option is called otherwise here.
        let renamed = |e: anyhow::Error| match e.downcast_ref::<InputError>() {
            Some(error) => InputError::new(error.to_string().replace("--http", "--live")).into(),
            None => e,
        };
        let running = Running::start(inputs, &options).map_err(renamed)?;
        eprintln!("watch the flight at http://{}/", running.page);
        Ok(Self {
            running,
            socket: UdpSocket::bind(any)?,
            to,
            start: Instant::now(),
            interrupted: Arc::clone(interrupted),
        })
    }

    /// Sends what goes to the ground when its time has come.
    pub(super) fn send(&self, at_ns: u64, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        let due = Duration::from_nanos(at_ns);
        while !self.interrupted.load(Ordering::Relaxed) {
            let ahead = due.saturating_sub(self.start.elapsed());
            if ahead.is_zero() {
                break;
            }
            thread::sleep(ahead.min(PATIENCE));
        }
        // On the loopback of this machine; what it does not take shows as lost on the page.
        let _lost = self.socket.send_to(bytes, self.to);
    }

    /// Keeps the page until Ctrl-C.
    pub(super) fn wait(self) -> anyhow::Result<()> {
        if !self.interrupted.load(Ordering::Relaxed) {
            eprintln!("the page stays at http://{}/ until Ctrl-C", self.running.page);
        }
        while !self.interrupted.load(Ordering::Relaxed) {
            thread::sleep(PATIENCE);
        }
        self.running.stop()
    }
}

//! The ground station: hears UAVs over UDP, a serial port or from a file, merges their maps, records, passes on, and shows a
//! live page.
//!
//! Packets come in on one thread ([`engine`]) that owns decoders and outputs; the state ([`station`]) lies behind a lock in the
//! [`hub`], from which a web server ([`page`]) on another thread tells every open page what has changed.

pub mod cloud;
mod crowd;
pub mod decode;
pub mod engine;
pub mod flock;
pub mod hub;
pub mod inputs;
pub mod keys;
pub mod load;
pub mod losses;
pub mod mavlink;
pub mod model;
pub mod page;
pub mod playback;
pub mod record;
pub mod station;
pub mod surfaces;
pub mod trail;
pub mod uav;

use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::SyncSender;
use std::thread::{self, JoinHandle};

use cloud::Size;
use decode::Ears;
use engine::Engine;
use hub::Hub;
use inputs::{Said, Udp};
use keys::Trust;
use playback::{Pace, Playback};
use record::Recording;
use station::Station;

use crate::scene::Scene;

/// Where the page is when nothing else is said.
pub const PAGE: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 8080);

/// Where packets come in when nothing else is said.
pub const LISTEN: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 14_650);

/// Where packets come from.
#[derive(Debug)]
pub enum Inputs {
    /// Sockets and ports, already open.
    Live {
        /// UDP sockets.
        udp: Vec<Udp>,
        /// Serial ports.
        #[cfg(unix)]
        serial: Vec<inputs::Serial>,
    },
    /// A recorded file and how it is played.
    File(Playback, Pace),
}

/// Everything else about a station.
#[derive(Clone, Debug)]
pub struct Options {
    /// Whose packets are taken.
    pub trust: Trust,
    /// Address of the page.
    pub http: SocketAddr,
    /// Directory of a recording.
    pub record: Option<PathBuf>,
    /// Where MAVLink goes.
    pub mavlink: Option<SocketAddr>,
    /// What its poses' frame is called.
    pub mavlink_frame: mavlink::Frame,
    /// Scene behind the map.
    pub scene: Option<String>,
    /// Size of the merged map.
    pub size: Size,
}

impl Default for Options {
    /// Takes nothing, for there is no key, and serves the page at [`PAGE`].
    fn default() -> Self {
        Self {
            trust: Trust::Keys(BTreeMap::new()),
            http: PAGE,
            record: None,
            mavlink: None,
            mavlink_frame: mavlink::Frame::default(),
            scene: None,
            size: Size::default(),
        }
    }
}

/// A running station. When it is dropped, it ends, and its recording is closed.
#[derive(Debug)]
pub struct Running {
    /// Its state.
    pub hub: Arc<Hub>,
    /// Where its page is.
    pub page: SocketAddr,
    threads: Vec<JoinHandle<anyhow::Result<()>>>,
}

impl Running {
    /// Starts a station; it runs until its hub is stopped.
    ///
    /// # Errors
    /// [`InputError`](crate::input::InputError) naming the address, file or directory that cannot be used.
    pub fn start(inputs: Inputs, options: &Options) -> anyhow::Result<Self> {
        let listener = page::bind(options.http)?;
        let address = listener.local_addr()?;
        let scene = options.scene.as_deref().map(Scene::load).transpose()?;
        let recording = options.record.as_deref().map(Recording::begin).transpose()?;
        let mavlink = options
            .mavlink
            .map(|to| mavlink::Out::new(to, options.mavlink_frame))
            .transpose()?;
        let mut outputs = vec![options.trust.words()];
        outputs.extend(
            options
                .record
                .as_ref()
                .map(|to| format!("recording to {}", to.display())),
        );
        outputs.extend(options.mavlink.map(|to| format!("MAVLink to {to}")));
        let station = Station::new(options.size);
        let hub = Arc::new(Hub::new(station, outputs, scene.as_ref().map(edges)));
        let engine = Engine::new(
            Arc::clone(&hub),
            Ears::new(options.trust.clone()),
            recording,
            mavlink,
        );
        let mut threads = vec![{
            let hub = Arc::clone(&hub);
            thread::spawn(move || page::serve(listener, hub))
        }];
        threads.extend(start_inputs(inputs, engine, &hub));
        Ok(Self {
            hub,
            page: address,
            threads,
        })
    }

    /// Ends the station and closes its recording.
    ///
    /// # Errors
    /// Those of its threads.
    pub fn stop(mut self) -> anyhow::Result<()> {
        self.end()
    }

    /// Waits for every thread, whatever the others say: the first error.
    fn end(&mut self) -> anyhow::Result<()> {
        self.hub.stop();
        let mut result = Ok(());
        for thread in self.threads.drain(..) {
            let panicked = |_| Err(anyhow::anyhow!("a thread of the station panicked"));
            result = result.and(thread.join().unwrap_or_else(panicked));
        }
        result
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // Whoever wants to know stops it.
        let _ended = self.end();
    }
}

fn start_inputs(inputs: Inputs, engine: Engine, hub: &Arc<Hub>) -> Vec<JoinHandle<anyhow::Result<()>>> {
    let mut threads = Vec::new();
    match inputs {
        Inputs::File(mut playback, pace) => {
            hub.station().input(playback.name(), 0);
            let hub = Arc::clone(hub);
            threads.push(thread::spawn(move || {
                let mut engine = engine;
                let played = playback.play(&mut engine, &hub, pace);
                let finished = engine.finish();
                // With the file ends the station.
                hub.stop();
                played.and(finished)
            }));
        }
        Inputs::Live {
            udp,
            #[cfg(unix)]
            serial,
        } => {
            let (to, said) = inputs::queue();
            threads.push(thread::spawn(move || engine.run(&said)));
            for input in udp {
                hub.station().input(input.name(), 0);
                threads.push(listen(hub, &to, move |hub, to| input.run(hub, to)));
            }
            #[cfg(unix)]
            for input in serial {
                hub.station().input(input.name(), 0);
                threads.push(listen(hub, &to, move |hub, to| input.run(hub, to)));
            }
        }
    }
    threads
}

fn listen(
    hub: &Arc<Hub>,
    to: &SyncSender<Said>,
    run: impl FnOnce(&Hub, &SyncSender<Said>) + Send + 'static,
) -> JoinHandle<anyhow::Result<()>> {
    let (hub, to) = (Arc::clone(hub), to.clone());
    thread::spawn(move || {
        run(&hub, &to);
        Ok(())
    })
}

/// Edges of a scene's faces as JSON: `{"edges": [x, y, z, x, y, z, ...]}`, m.
fn edges(scene: &Scene) -> String {
    let ends = scene.faces().iter().flat_map(|face| {
        let corners = face.vertices();
        let next = corners.iter().cycle().skip(1);
        corners.iter().zip(next).flat_map(|(a, b)| [*a, *b])
    });
    let numbers: Vec<f32> = ends.flat_map(|v| [v.x as f32, v.y as f32, v.z as f32]).collect();
    serde_json::json!({"edges": numbers}).to_string()
}

/// Runs a station until it is interrupted or its file ends. Prints the address of its page on standard output, everything else on standard error.
///
/// # Errors
/// [`InputError`](crate::input::InputError) naming what cannot be used.
pub fn run(inputs: Inputs, options: &Options, interrupted: &AtomicBool) -> anyhow::Result<()> {
    let running = Running::start(inputs, options)?;
    println!("http://{}/", running.page);
    eprintln!("cslam ground: {}", options.trust.words());
    for name in running.hub.station().inputs().keys() {
        eprintln!("cslam ground: hears {name}");
    }
    while !(interrupted.load(Ordering::Relaxed) || running.hub.is_stopped()) {
        thread::sleep(std::time::Duration::from_millis(50));
    }
    running.stop()
}

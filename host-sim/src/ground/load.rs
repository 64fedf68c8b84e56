//! A ground station under load: made-up UAVs send to a station in a process of its own, with a page open, and every packet is
//! counted at both ends.

use std::fmt;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream, UdpSocket};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context;
use cslam_core::telemetry::Key;
use serde::Serialize;
use serde_json::Value;

use super::crowd::Crowd;
use super::flock::MadeUpUav;

/// How long the station may take to count what has come.
const PATIENCE: Duration = Duration::from_secs(20);

/// What became of the packets.
#[derive(Clone, Debug, Serialize)]
pub struct Figures {
    /// UAVs that sent.
    pub uavs: u8,
    /// How long they sent, s.
    pub seconds: u32,
    /// Packets that were sent.
    pub sent: u64,
    /// Packets that the station took.
    pub received: u64,
    /// Packets that the station says were lost on the way.
    pub lost: u64,
    /// Frames that it refused.
    pub refused: u64,
    /// Datagrams that the operating system dropped; `None` where it does not say.
    pub dropped_by_system: Option<u64>,
    /// Bytes that were sent.
    pub bytes: u64,
    /// Reflection points that came.
    pub points: u64,
    /// Points of the merged map.
    pub map_points: u64,
    /// Bytes that went to the open page.
    pub page_bytes: u64,
    /// Connections to the page on which nothing is sent.
    pub idle: usize,
    /// Connections to the page on which a request is sent byte by byte.
    pub slow: usize,
    /// Times that the page was asked for beside them.
    pub page_answers: usize,
    /// Median time until the page was there, s.
    pub page_median_s: f64,
    /// Longest time until the page was there, s.
    pub page_longest_s: f64,
    /// Largest lag of the sender behind real time, s.
    pub lag_s: f64,
    /// Most memory that the station held after a sixth of the time, MiB; `None` where it is not known.
    pub early_rss_mib: Option<f64>,
    /// Most memory that the station held, MiB.
    pub peak_rss_mib: Option<f64>,
    /// Time of a processor that the station took, s.
    pub cpu_s: Option<f64>,
}

impl Figures {
    /// Whether everything that was sent has been taken.
    pub fn is_whole(&self) -> bool {
        self.sent > 0 && self.received == self.sent && self.lost == 0 && self.refused == 0
    }
}

impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let known = |value: Option<f64>| value.map_or("unknown".to_owned(), |v| format!("{v:.1}"));
        writeln!(f, "{} UAVs for {} s", self.uavs, self.seconds)?;
        writeln!(
            f,
            "packets sent, received        {}, {}",
            self.sent, self.received
        )?;
        writeln!(f, "lost, refused                 {}, {}", self.lost, self.refused)?;
        let dropped = self
            .dropped_by_system
            .map_or("unknown".to_owned(), |d| d.to_string());
        writeln!(f, "dropped by the system         {dropped}")?;
        let rate = self.bytes as f64 / f64::from(self.seconds.max(1)) / f64::from(self.uavs.max(1));
        writeln!(f, "bytes per second and UAV      {rate:.0}")?;
        writeln!(
            f,
            "points sent, in the map       {}, {}",
            self.points, self.map_points
        )?;
        writeln!(f, "bytes to the open page        {}", self.page_bytes)?;
        writeln!(f, "connections idle, slow        {}, {}", self.idle, self.slow)?;
        writeln!(
            f,
            "page there after, s           {:.3} (median of {}), {:.3} (longest)",
            self.page_median_s, self.page_answers, self.page_longest_s
        )?;
        writeln!(f, "sender behind real time, s    {:.2}", self.lag_s)?;
        writeln!(
            f,
            "memory early, at most, MiB    {}, {}",
            known(self.early_rss_mib),
            known(self.peak_rss_mib)
        )?;
        write!(f, "processor time, s             {}", known(self.cpu_s))
    }
}

/// Ends the station with the measurement.
struct Station(Child);

impl Drop for Station {
    fn drop(&mut self) {
        let _ended = self.0.kill();
        let _ended = self.0.wait();
    }
}

/// Runs the load.
///
/// # Errors
/// When the station does not start or does not answer.
pub fn run(uavs: u8, seconds: u32, idle: usize, slow: usize) -> anyhow::Result<Figures> {
    let (station, page, udp) = start()?;
    let page_bytes = watch(page)?;
    let crowd = Crowd::gather(page, idle, slow)?;
    let mut flock: Vec<MadeUpUav> = (1..=uavs)
        .map(|id| MadeUpUav::new(id, &Key::TEST, 1, f64::INFINITY))
        .collect();
    let socket = UdpSocket::bind("127.0.0.1:0")?;
    let start = Instant::now();
    let (mut sent, mut bytes, mut lag_s, mut early_rss_mib) = (0, 0, 0.0_f64, None);
    let bar = crate::progress::bar(u64::from(seconds) * 10, "sending");
    for tick in 0..u64::from(seconds) * 10 {
        for (index, uav) in flock.iter_mut().enumerate() {
            // Spread over the tenth of a second, as independent UAVs are.
            let due_s = 0.1 * (tick as f64 + index as f64 / f64::from(uavs));
            let ahead_s = due_s - start.elapsed().as_secs_f64();
            if ahead_s > 0.0 {
                thread::sleep(Duration::from_secs_f64(ahead_s));
            }
            lag_s = lag_s.max(-ahead_s);
            for frame in uav.step() {
                socket.send_to(&frame, udp)?;
                sent += 1;
                bytes += frame.len() as u64;
            }
        }
        if tick == u64::from(seconds) * 10 / 6 {
            early_rss_mib = peak_rss_mib(station.0.id());
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    let status = settle(page, sent)?;
    let answers_s = crowd.leave()?;
    let of_uavs = |pointer: &str| -> u64 {
        let uavs = status["uavs"].as_array().into_iter().flatten();
        uavs.filter_map(|uav| uav.pointer(pointer)?.as_u64()).sum()
    };
    let refused = status["refused"].as_object().into_iter().flatten();
    Ok(Figures {
        uavs,
        seconds,
        sent,
        received: of_uavs("/losses/received"),
        lost: of_uavs("/losses/lost"),
        refused: refused.filter_map(|(_, count)| count.as_u64()).sum(),
        dropped_by_system: dropped(udp.port()),
        bytes,
        points: of_uavs("/points"),
        map_points: status["map"]["points"].as_u64().unwrap_or_default(),
        page_bytes: page_bytes.load(Ordering::Relaxed),
        idle,
        slow,
        page_answers: answers_s.len(),
        page_median_s: answers_s.get(answers_s.len() / 2).copied().unwrap_or_default(),
        page_longest_s: answers_s.last().copied().unwrap_or_default(),
        lag_s,
        early_rss_mib,
        peak_rss_mib: peak_rss_mib(station.0.id()),
        cpu_s: cpu_s(station.0.id()),
    })
}

/// Starts a station: its process, its page and its UDP address.
fn start() -> anyhow::Result<(Station, SocketAddr, SocketAddr)> {
    let program = std::env::current_exe().context("the program does not know itself")?;
    let child = Command::new(program)
        .args([
            "ground",
            "--test-key",
            "--listen",
            "127.0.0.1:0",
            "--http",
            "127.0.0.1:0",
        ])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()?;
    let mut station = Station(child);
    let stdout = station.0.stdout.take().context("no output of the station")?;
    let stderr = station.0.stderr.take().context("no output of the station")?;
    let mut url = String::new();
    BufReader::new(stdout).read_line(&mut url)?;
    let page = url
        .trim()
        .trim_start_matches("http://")
        .trim_end_matches('/')
        .parse()?;
    for line in BufReader::new(stderr).lines() {
        if let Some((_, udp)) = line?.split_once("hears udp ") {
            return Ok((station, page, udp.trim().parse()?));
        }
    }
    anyhow::bail!("the station does not say where it listens")
}

/// Opens a websocket as a page does, and counts what comes.
fn watch(page: SocketAddr) -> anyhow::Result<Arc<AtomicU64>> {
    let mut stream = TcpStream::connect(page)?;
    // The key is any 16 bytes: whoever only reads need not check the answer to it.
    write!(
        stream,
        "GET /ws HTTP/1.1\r\nHost: {page}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
         Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
    )?;
    let count = Arc::new(AtomicU64::new(0));
    let counted = Arc::clone(&count);
    thread::spawn(move || {
        let mut buffer = vec![0; 1 << 16];
        while let Ok(length @ 1..) = stream.read(&mut buffer) {
            counted.fetch_add(length as u64, Ordering::Relaxed);
        }
    });
    Ok(count)
}

/// The station's status, once it has counted `sent` packets or does not count any further.
fn settle(page: SocketAddr, sent: u64) -> anyhow::Result<Value> {
    let start = Instant::now();
    loop {
        let mut stream = TcpStream::connect(page)?;
        write!(
            stream,
            "GET /status.json HTTP/1.1\r\nHost: {page}\r\nConnection: close\r\n\r\n"
        )?;
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer)?;
        let text = String::from_utf8(answer)?;
        let (_, body) = text.split_once("\r\n\r\n").context("no answer of the station")?;
        let status: Value = serde_json::from_str(body)?;
        let uavs = status["uavs"].as_array().into_iter().flatten();
        let received: u64 = uavs.filter_map(|uav| uav["losses"]["received"].as_u64()).sum();
        if received >= sent || start.elapsed() > PATIENCE {
            return Ok(status);
        }
        thread::sleep(Duration::from_millis(200));
    }
}

/// Most memory that a process has held, where the system tells (Linux).
fn peak_rss_mib(process: u32) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().trim_end_matches("kB").trim().parse().ok()?;
    Some(kib / 1024.0)
}

/// Time of a processor that a process took, s, where the system tells (Linux).
fn cpu_s(process: u32) -> Option<f64> {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // After the name in brackets: state is field 3, user and system time fields 14 and 15, in hundredths of a second.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |index: usize| fields.get(index)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) / 100.0)
}

/// Datagrams for a port that the system dropped, where it tells (Linux).
fn dropped(port: u16) -> Option<u64> {
    let table = std::fs::read_to_string("/proc/net/udp").ok()?;
    let local = format!("0100007F:{port:04X}");
    let row = table
        .lines()
        .find(|row| row.split_whitespace().nth(1) == Some(&local))?;
    row.split_whitespace().last()?.parse().ok()
}

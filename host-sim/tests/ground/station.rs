//! A station in a process of its own, and what its page says.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream, UdpSocket};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

/// How long anything may take that must come.
pub(crate) const PATIENCE: Duration = Duration::from_secs(300);

/// `cslam ground` with arguments.
pub(crate) fn cslam(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cslam"));
    command.arg("ground").args(arguments);
    command
}

/// `cslam ground` with arguments under limits that a shell sets, for instance `ulimit -n 512`.
pub(crate) fn limited(limits: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new("sh");
    command
        .args(["-c", &format!("{limits}; exec \"$0\" ground \"$@\"")])
        .arg(env!("CARGO_BIN_EXE_cslam"))
        .args(arguments);
    command
}

/// Arguments of a station that takes packets signed with the published key, over UDP.
pub(crate) const TEST_KEY: [&str; 3] = ["--test-key", "--listen", "127.0.0.1:0"];

/// Sends a signal to a process that this test started.
pub(crate) fn signal(child: &Child, signal: Signal) {
    let process = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
    kill_process(process.expect("a process"), signal).expect("it runs");
}

/// A station that is ended with the test.
pub(crate) struct Station {
    child: Child,
    /// Address of its page.
    pub(crate) page: SocketAddr,
    /// Address of its UDP input, if it has one.
    pub(crate) udp: Option<SocketAddr>,
}

impl Station {
    /// Starts a station.
    pub(crate) fn start(arguments: &[&str]) -> Self {
        Self::from(cslam(arguments))
    }

    /// Starts a station of a command.
    pub(crate) fn from(mut command: Command) -> Self {
        let mut child = command
            .args(["--http", "127.0.0.1:0"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        let mut url = String::new();
        let stdout = child.stdout.take().expect("piped");
        BufReader::new(stdout).read_line(&mut url).expect("text");
        let page = url.trim().trim_start_matches("http://").trim_end_matches('/');
        let page = page.parse().expect("an address");
        let stderr = BufReader::new(child.stderr.take().expect("piped"));
        let heard = stderr.lines().map(|line| line.expect("text")).find_map(|line| {
            let (_, input) = line.split_once("hears ")?;
            Some(
                input
                    .strip_prefix("udp ")
                    .map(|udp| udp.parse().expect("an address")),
            )
        });
        let udp = heard.expect("it says what it hears");
        Self { child, page, udp }
    }

    /// Sends datagrams to its UDP input.
    pub(crate) fn send<'a>(&self, socket: &UdpSocket, datagrams: impl IntoIterator<Item = &'a Vec<u8>>) {
        for datagram in datagrams {
            socket.send_to(datagram, self.udp.expect("udp")).expect("sent");
        }
    }

    /// All figures.
    pub(crate) fn status(&self) -> Value {
        status_of(self.page)
    }

    /// The answer to a request of a connection of its own, until the station closes it.
    pub(crate) fn ask(&self, request: &str) -> String {
        ask(self.page, request)
    }

    /// Waits until the status is as wanted.
    pub(crate) fn wait_for(&self, what: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let start = Instant::now();
        loop {
            let status = self.status();
            if wanted(&status) {
                return status;
            }
            assert!(start.elapsed() < PATIENCE, "{what}: {status}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Ends it as a service manager does: its exit status.
    pub(crate) fn end(mut self) -> ExitStatus {
        signal(&self.child, Signal::TERM);
        self.child.wait().expect("it ends")
    }

    /// Ends it as a service manager does; all must be well.
    pub(crate) fn terminate(self) {
        assert!(self.end().success());
    }

    /// Waits until it ends of itself: its exit status.
    pub(crate) fn wait(mut self) -> ExitStatus {
        self.child.wait().expect("it ends")
    }

    /// Ends it as a power cut would, but for what the system keeps.
    pub(crate) fn kill(mut self) {
        signal(&self.child, Signal::KILL);
        self.child.wait().expect("it ends");
    }
}

impl Drop for Station {
    fn drop(&mut self) {
        let _ended = self.child.kill();
        let _ended = self.child.wait();
    }
}

/// The answer of a page to a request of a connection of its own, until the connection is closed.
fn ask(page: SocketAddr, request: &str) -> String {
    let mut stream = TcpStream::connect(page).expect("it listens");
    stream.set_read_timeout(Some(PATIENCE)).expect("settable");
    stream.write_all(request.as_bytes()).expect("sent");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer");
    answer
}

/// All figures of the station with this page.
pub(crate) fn status_of(page: SocketAddr) -> Value {
    let request = format!("GET /status.json HTTP/1.1\r\nHost: {page}\r\nConnection: close\r\n\r\n");
    let answer = ask(page, &request);
    let (_, body) = answer.split_once("\r\n\r\n").expect("a body");
    serde_json::from_str(body).expect("JSON")
}

/// Packets that were taken of a UAV.
pub(crate) fn received(status: &Value, uav: u64) -> u64 {
    let uavs = status["uavs"].as_array().into_iter().flatten();
    let mut of_uav = uavs.filter(|u| u["uav"] == uav);
    of_uav
        .next()
        .map_or(0, |u| u["losses"]["received"].as_u64().expect("a number"))
}

//! Connections that never finish asking, to load a page with, and how long it takes to answer others meanwhile.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use anyhow::Context;

/// Time between two bytes of a slow connection, and between two requests that are timed.
const PACE: Duration = Duration::from_millis(100);

/// Files beside the connections that this process may need.
const OTHER_FILES: u64 = 64;

/// A crowd, and somebody among it who asks for the page.
#[derive(Debug)]
pub(super) struct Crowd {
    ends: Arc<AtomicBool>,
    slow: JoinHandle<()>,
    answers: JoinHandle<anyhow::Result<Vec<f64>>>,
    /// Opened, and nothing sent.
    _idle: Vec<TcpStream>,
}

impl Crowd {
    /// Opens `idle` connections on which nothing is sent, and `slow` ones on which a request is sent byte by byte, again when the
    /// station has closed them.
    ///
    /// # Errors
    /// When this process may not open so many, or the station does not take them.
    pub(super) fn gather(page: SocketAddr, idle: usize, slow: usize) -> anyhow::Result<Self> {
        #[cfg(unix)]
        allow((idle + slow) as u64 + OTHER_FILES)?;
        let idle = (0..idle).map(|_| TcpStream::connect(page));
        let idle = idle
            .collect::<io::Result<Vec<_>>>()
            .context("no idle connection")?;
        let slow = (0..slow).map(|_| begin(page));
        let mut slow = slow
            .collect::<io::Result<Vec<_>>>()
            .context("no slow connection")?;
        let ends = Arc::new(AtomicBool::new(false));
        let ended = Arc::clone(&ends);
        let slow = thread::spawn(move || {
            while !ended.load(Ordering::Relaxed) {
                for stream in &mut slow {
                    if stream.write_all(b"x").is_err()
                        && let Ok(new) = begin(page)
                    {
                        *stream = new;
                    }
                }
                thread::sleep(PACE);
            }
        });
        let ended = Arc::clone(&ends);
        let answers = thread::spawn(move || {
            let mut answers_s = Vec::new();
            while !ended.load(Ordering::Relaxed) {
                answers_s.push(ask(page)?);
                thread::sleep(PACE);
            }
            Ok(answers_s)
        });
        Ok(Self {
            ends,
            slow,
            answers,
            _idle: idle,
        })
    }

    /// Sends the crowd home: how long each answer took, s, in ascending order.
    ///
    /// # Errors
    /// When the page did not answer.
    pub(super) fn leave(self) -> anyhow::Result<Vec<f64>> {
        self.ends.store(true, Ordering::Relaxed);
        let panicked = |_| anyhow::anyhow!("a thread of the crowd panicked");
        self.slow.join().map_err(panicked)?;
        let mut answers_s = self.answers.join().map_err(panicked)??;
        answers_s.sort_by(f64::total_cmp);
        Ok(answers_s)
    }
}

/// A request that is not ended.
fn begin(page: SocketAddr) -> io::Result<TcpStream> {
    let mut stream = TcpStream::connect(page)?;
    stream.write_all(b"GET / HTTP/1.1\r\nX: ")?;
    Ok(stream)
}

/// Seconds until the page is there.
fn ask(page: SocketAddr) -> anyhow::Result<f64> {
    let start = Instant::now();
    let mut stream = TcpStream::connect(page)?;
    write!(
        stream,
        "GET / HTTP/1.1\r\nHost: {page}\r\nConnection: close\r\n\r\n"
    )?;
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer)?;
    anyhow::ensure!(
        answer.starts_with(b"HTTP/1.1 200 ") && answer.ends_with(b"</html>\n"),
        "the page is not whole"
    );
    Ok(start.elapsed().as_secs_f64())
}

/// Lets this process open so many files.
#[cfg(unix)]
fn allow(files: u64) -> anyhow::Result<()> {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let limit = getrlimit(Resource::Nofile);
    if limit.current.is_none_or(|current| current >= files) {
        return Ok(());
    }
    let current = Some(files);
    setrlimit(Resource::Nofile, Rlimit { current, ..limit })
        .with_context(|| format!("a process may not open {files} files here"))
}

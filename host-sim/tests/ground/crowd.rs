//! A page that many ask for at once, and who never finish asking.

use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

use crate::station::{PATIENCE, Station, TEST_KEY, limited};

const IDLE: usize = 2000;
const SLOW: usize = 200;

/// Lets this process hold as many connections as the test needs.
fn raise_limit() {
    let limit = getrlimit(Resource::Nofile);
    let wanted = 4096;
    let maximum = limit.maximum.unwrap_or(wanted);
    assert!(maximum >= wanted, "no process may open {wanted} files here");
    let current = Some(limit.current.unwrap_or(wanted).max(wanted));
    setrlimit(Resource::Nofile, Rlimit { current, ..limit }).expect("below the maximum");
}

fn connect(page: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect_timeout(&page, PATIENCE).expect("it listens");
    stream.set_read_timeout(Some(PATIENCE)).expect("settable");
    stream
}

#[test]
fn the_page_answers_among_idle_and_slow_connections() {
    // As many files as most systems let a process open.
    let station = Station::from(limited("ulimit -n 1024", &TEST_KEY));
    raise_limit();
    let idle: Vec<TcpStream> = (0..IDLE).map(|_| connect(station.page)).collect();
    let mut slow: Vec<TcpStream> = (0..SLOW).map(|_| connect(station.page)).collect();
    for stream in &mut slow {
        // The station may have had enough of it by now.
        let _closed = stream.write_all(b"GET / HTTP/1.1\r\nHost: ");
    }
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !done.load(Ordering::Relaxed) {
                for stream in &mut slow {
                    let _closed = stream.write_all(b"x");
                }
                std::thread::sleep(Duration::from_millis(50));
            }
        });
        let page = station.page;
        // Of the thread below too when an assertion fails.
        let answers = std::panic::catch_unwind(|| {
            let request = format!("GET / HTTP/1.1\r\nHost: {page}\r\nConnection: close\r\n\r\n");
            for _ in 0..5 {
                assert!(station.ask(&request).starts_with("HTTP/1.1 200 OK\r\n"));
                station.status();
            }
        });
        done.store(true, Ordering::Relaxed);
        assert!(answers.is_ok(), "the page does not answer");
    });
    drop((idle, slow));
    station.terminate();
}

#[test]
fn a_request_that_never_ends_is_closed() {
    let station = Station::start(&TEST_KEY);
    let mut stream = connect(station.page);
    stream.write_all(b"GET / HTTP/1.1\r\nHost: ").expect("sent");
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).expect("it is closed");
    assert!(!answer.starts_with(b"HTTP/1.1 200"));
}

#[test]
fn a_request_with_a_body_is_refused_before_it_is_sent() {
    let station = Station::start(&TEST_KEY);
    let page = station.page;
    for length in ["Content-Length: 1000000000", "Transfer-Encoding: chunked"] {
        let answer = station.ask(&format!("POST / HTTP/1.1\r\nHost: {page}\r\n{length}\r\n\r\n"));
        assert!(answer.starts_with("HTTP/1.1 413 "), "{answer}");
    }
    // Nor is a head of any length read.
    let long = "x".repeat(1 << 20);
    let mut stream = connect(page);
    // It is closed before all is sent.
    let _closed = write!(stream, "GET / HTTP/1.1\r\nHost: {page}\r\nX: {long}\r\n\r\n");
    let mut answer = [0; 12];
    if stream.read_exact(&mut answer).is_ok() {
        assert_eq!(&answer, b"HTTP/1.1 431");
    }
}

/// Status codes of handshakes of websockets, all sent before any is answered; and the sockets.
fn handshakes(page: SocketAddr, count: usize) -> (Vec<String>, Vec<TcpStream>) {
    let mut streams: Vec<TcpStream> = (0..count).map(|_| connect(page)).collect();
    for stream in &mut streams {
        write!(
            stream,
            "GET /ws HTTP/1.1\r\nHost: {page}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
             Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
        )
        .expect("sent");
    }
    let code = |stream: &mut TcpStream| {
        let mut answer = [0; 12];
        stream.read_exact(&mut answer).expect("an answer");
        String::from_utf8_lossy(&answer[9..]).into_owned()
    };
    (streams.iter_mut().map(code).collect(), streams)
}

#[test]
fn no_more_pages_are_open_than_there_are_places() {
    let station = Station::start(&TEST_KEY);
    let (codes, streams) = handshakes(station.page, 100);
    let of = |code: &str| codes.iter().filter(|c| *c == code).count();
    assert_eq!((of("101"), of("503")), (32, 68));
    // Whoever goes makes room.
    for stream in &streams {
        stream.shutdown(Shutdown::Both).expect("open");
    }
    let start = Instant::now();
    while handshakes(station.page, 1).0 != ["101"] {
        assert!(start.elapsed() < PATIENCE, "nobody gets in any more");
    }
}

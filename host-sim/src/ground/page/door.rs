//! The way in to the page: how many may ask at once, and for how long.
//!
//! Whoever opens connections and asks for nothing, or asks one byte at a time, must not keep others out. So the oldest connection
//! makes room when there is no other: a page is asked for within milliseconds, and an update over a websocket is no longer one
//! of these connections.

use std::collections::VecDeque;
use std::io::ErrorKind;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::task::AbortHandle;
use tokio::time::{sleep, timeout};

/// Connections at once: a browser opens up to six, and there are [`MOST_PAGES`](super::MOST_PAGES). Together with those it is far
/// less than a process may open, 1024 on most systems.
const MOST_CONNECTIONS: usize = 256;

/// A request's head must come within so long, counted from the answer before.
const HEAD: Duration = Duration::from_secs(5);

/// Bytes of a request's head at most; browsers send less than one thousand.
const MOST_HEAD: usize = 16 << 10;

/// The longest that one connection is served: a full map over 60 kB/s.
const LONGEST: Duration = Duration::from_secs(600);

/// Time until another try when the system has no more files for this process.
const AGAIN: Duration = Duration::from_millis(50);

/// Serves connections, for ever.
pub(super) async fn serve(listener: &TcpListener, router: Router) {
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new())
        .header_read_timeout(HEAD)
        .max_buf_size(MOST_HEAD);
    let service = TowerToHyperService::new(router);
    let places = Arc::new(Semaphore::new(MOST_CONNECTIONS));
    let mut open: VecDeque<AbortHandle> = VecDeque::new();
    loop {
        let stream = accept(listener).await;
        open.retain(|connection| !connection.is_finished());
        let place = Arc::clone(&places);
        if place.available_permits() == 0
            && let Some(oldest) = open.pop_front()
        {
            oldest.abort();
        }
        // The place of the one that was ended, at the latest.
        let Ok(place) = place.acquire_owned().await else {
            return;
        };
        let connection = http
            .serve_connection(TokioIo::new(stream), service.clone())
            .with_upgrades();
        let served = tokio::spawn(async move {
            // Ended in order, by a timeout, or by the other side: there is nobody to tell.
            let _ended = timeout(LONGEST, connection).await;
            drop(place);
        });
        open.push_back(served.abort_handle());
    }
}

async fn accept(listener: &TcpListener) -> TcpStream {
    loop {
        match listener.accept().await {
            Ok((stream, _)) => return stream,
            // Gone again before it was taken.
            Err(e)
                if matches!(
                    e.kind(),
                    ErrorKind::ConnectionAborted | ErrorKind::ConnectionReset
                ) => {}
            Err(_) => sleep(AGAIN).await,
        }
    }
}

//! The page: a small web server on a thread of its own, with everything a browser needs in the program itself.
//!
//! A page that opens its websocket gets the whole state, in portions, and from then on what changes, ten times per second. The state
//! is a set of numbered slots, so a portion that crosses a change does no harm. A page that is too slow to follow gets the whole
//! state again instead of a queue that grows.

mod assets;
mod door;
mod guard;
mod messages;
pub(super) mod ply;
mod socket;

use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Bytes;
use axum::extract::State;
use axum::http::StatusCode;
use axum::http::header::{CONTENT_DISPOSITION, CONTENT_TYPE};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, broadcast};

use super::hub::Hub;
use crate::input::InputError;

/// Updates that a page may lag behind.
const MOST_UPDATES: usize = 64;

/// Pages that may be open at once.
const MOST_PAGES: usize = 32;

/// Copies of the map that may be on their way at once: a full one has 38 MB.
const MOST_DOWNLOADS: usize = 4;

/// What the handlers share.
#[derive(Clone)]
struct Page {
    hub: Arc<Hub>,
    updates: broadcast::Sender<axum::extract::ws::Message>,
    /// Places for websockets.
    places: Arc<Semaphore>,
    /// Places for copies of the map.
    downloads: Arc<Semaphore>,
}

/// Takes the address of the page.
///
/// # Errors
/// [`InputError`] naming the address when it is in use or not this machine's.
pub fn bind(address: SocketAddr) -> Result<TcpListener, InputError> {
    let refused = |e: std::io::Error| {
        InputError::new(format!(
            "--http {address}: cannot be listened on ({e}); choose another port"
        ))
    };
    let listener = TcpListener::bind(address).map_err(refused)?;
    listener.set_nonblocking(true).map_err(refused)?;
    Ok(listener)
}

/// Serves the page until the hub is stopped.
///
/// # Errors
/// Those of the operating system.
pub fn serve(listener: TcpListener, hub: Arc<Hub>) -> anyhow::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?;
    let address = listener.local_addr()?;
    runtime.block_on(async move {
        let page = Page {
            hub: Arc::clone(&hub),
            updates: broadcast::channel(MOST_UPDATES).0,
            places: Arc::new(Semaphore::new(MOST_PAGES)),
            downloads: Arc::new(Semaphore::new(MOST_DOWNLOADS)),
        };
        let ticks = tokio::spawn(socket::tell(page.clone()));
        let router = Router::new()
            .route("/ws", get(socket::open))
            .route("/status.json", get(status))
            .route("/scene.json", get(scene))
            .route("/map.ply", get(map))
            .fallback(assets::get)
            .layer(axum::middleware::from_fn_with_state(address, guard::check))
            .with_state(page);
        let listener = tokio::net::TcpListener::from_std(listener)?;
        let stopped = async {
            while !hub.is_stopped() {
                tokio::time::sleep(Duration::from_millis(50)).await;
            }
        };
        tokio::select! {
            () = door::serve(&listener, router) => {}
            () = stopped => {}
        }
        ticks.abort();
        Ok(())
    })
}

/// The same figures as on the page, for scripts.
async fn status(State(page): State<Page>) -> impl IntoResponse {
    let hub = &page.hub;
    let now_s = hub.now_s();
    let status = messages::Status::new(&hub.station(), now_s, hub.outputs().to_vec(), |_| true);
    ([(CONTENT_TYPE, "application/json")], status.json())
}

/// The scene behind the map; `null` when there is none.
async fn scene(State(page): State<Page>) -> impl IntoResponse {
    let scene = page.hub.scene().unwrap_or("null").to_owned();
    ([(CONTENT_TYPE, "application/json")], scene)
}

/// A copy of the map and its place, which is free again when the copy was sent or its connection ended.
struct Download {
    bytes: Vec<u8>,
    _place: OwnedSemaphorePermit,
}

impl AsRef<[u8]> for Download {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}

/// The merged map as a file.
async fn map(State(page): State<Page>) -> Response {
    let Ok(place) = Arc::clone(&page.downloads).try_acquire_owned() else {
        return (StatusCode::SERVICE_UNAVAILABLE, "too many download the map\n").into_response();
    };
    // A copy, so that the packets that come in meanwhile need not wait for the writing.
    let points: Vec<_> = page.hub.station().cloud().points().collect();
    let bytes = tokio::task::spawn_blocking(move || ply::write(&points)).await;
    let headers = [
        (CONTENT_TYPE, "application/octet-stream"),
        (CONTENT_DISPOSITION, "attachment; filename=\"map.ply\""),
    ];
    let download = Download {
        bytes: bytes.unwrap_or_default(),
        _place: place,
    };
    (headers, Bytes::from_owner(download)).into_response()
}

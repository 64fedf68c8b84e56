//! The websocket: the whole state first, then what changes.

use std::sync::Arc;
use std::time::Duration;

use axum::extract::State;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use tokio::sync::broadcast::error::RecvError;
use tokio::time::{MissedTickBehavior, interval, timeout};

use super::{Page, messages};

/// Time between two updates.
const TICK: Duration = Duration::from_millis(100);

/// Counters and health are sent with every so many-th update.
const TICKS_PER_STATUS: u32 = 5;

/// Messages with points of one update; more wait for the next.
const MOST_POINT_MESSAGES: usize = 4;

/// A page that does not take a message for so long is given up.
const PATIENCE: Duration = Duration::from_secs(10);

/// A browser wants updates.
pub(super) async fn open(State(page): State<Page>, upgrade: WebSocketUpgrade) -> Response {
    // Taken before it is promised, and given back with the socket, also by one that never comes about.
    let Ok(place) = Arc::clone(&page.places).try_acquire_owned() else {
        return (StatusCode::SERVICE_UNAVAILABLE, "too many pages are open\n").into_response();
    };
    // A page has nothing to say.
    upgrade
        .max_message_size(1024)
        .on_upgrade(move |socket| async move {
            // It has gone: there is nobody to tell.
            let _gone = talk(socket, &page).await;
            drop(place);
        })
}

/// The page has gone, or is too slow.
struct Gone;

async fn send(socket: &mut WebSocket, message: Message) -> Result<(), Gone> {
    match timeout(PATIENCE, socket.send(message)).await {
        Ok(Ok(())) => Ok(()),
        _ => Err(Gone),
    }
}

async fn talk(mut socket: WebSocket, page: &Page) -> Result<(), Gone> {
    loop {
        // First the ear, then the state: what changes in between comes twice, never not at all.
        let mut updates = page.updates.subscribe();
        tell_all(&mut socket, page).await?;
        loop {
            tokio::select! {
                update = updates.recv() => match update {
                    Ok(message) => send(&mut socket, message).await?,
                    Err(RecvError::Lagged(_)) => break,
                    Err(RecvError::Closed) => return Err(Gone),
                },
                said = socket.recv() => match said {
                    Some(Ok(Message::Close(_)) | Err(_)) | None => return Err(Gone),
                    Some(Ok(_)) => {}
                },
            }
        }
    }
}

/// The whole state, in portions: the station is held only while one is written.
async fn tell_all(socket: &mut WebSocket, page: &Page) -> Result<(), Gone> {
    let hub = &page.hub;
    let hello = messages::hello(&hub.station(), hub.session(), hub.now_s(), hub.scene().is_some());
    send(socket, Message::text(hello)).await?;
    let ids: Vec<u8> = hub.station().uavs().keys().copied().collect();
    for id in ids {
        let of_uav = hub.station().uavs().get(&id).map(|uav| {
            let links = messages::links(std::iter::once((&id, uav)), |_| usize::MAX);
            (messages::trails(id, uav), links)
        });
        let Some((trails, links)) = of_uav else { continue };
        for trail in trails {
            send(socket, Message::binary(trail)).await?;
        }
        if let Some(links) = links {
            send(socket, Message::text(links)).await?;
        }
    }
    let poses = messages::poses(&hub.station(), hub.now_s(), |_| true);
    if let Some(poses) = poses {
        send(socket, Message::binary(poses)).await?;
    }
    let status = messages::Status::new(&hub.station(), hub.now_s(), hub.outputs().to_vec(), |_| true).json();
    send(socket, Message::text(status)).await?;
    let mut first = 0;
    loop {
        let portion = {
            let station = hub.station();
            let cloud = station.cloud();
            // An empty map is told too: the page shows it as such.
            (first == 0 || (first as usize) < cloud.len())
                .then(|| messages::points_in(cloud, first, messages::MOST_POINTS))
        };
        let Some(portion) = portion else { return Ok(()) };
        send(socket, Message::binary(portion)).await?;
        first += messages::MOST_POINTS as u32;
    }
}

/// Tells every page what has changed, until nobody runs the server any more.
pub(super) async fn tell(page: Page) {
    let mut ticks = interval(TICK);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    for tick in 0_u32.. {
        ticks.tick().await;
        for message in changes(&page, tick.is_multiple_of(TICKS_PER_STATUS)) {
            // Nobody listens: then it is all in the state that the next page gets.
            let _heard = page.updates.send(message);
        }
    }
}

fn changes(page: &Page, with_status: bool) -> Vec<Message> {
    let hub = &page.hub;
    let mut told = Vec::new();
    let mut station = hub.station();
    let now_s = hub.now_s();
    // A map that is smaller is told even when no slot has another point.
    let mut has_shrunk = station.cloud_mut().take_shrunk();
    for _ in 0..MOST_POINT_MESSAGES {
        let slots = station.cloud_mut().take_changed(messages::MOST_POINTS);
        if slots.is_empty() && !has_shrunk {
            break;
        }
        has_shrunk = false;
        told.push(Message::binary(messages::points_at(station.cloud(), &slots)));
    }
    if let Some(poses) = messages::poses(&station, now_s, |uav| uav.fresh_pose) {
        told.push(Message::binary(poses));
    }
    if let Some(links) = messages::links(station.uavs().iter(), |uav| uav.fresh_links) {
        told.push(Message::text(links));
    }
    for uav in station.uavs_mut().values_mut() {
        (uav.fresh_pose, uav.fresh_links) = (false, 0);
    }
    if with_status {
        // Sent even when nothing has changed: a page that hears nothing knows that the station is gone.
        let status = messages::Status::new(&station, now_s, hub.outputs().to_vec(), |uav| uav.changed);
        told.push(Message::text(status.json()));
        for uav in station.uavs_mut().values_mut() {
            uav.changed = false;
        }
    }
    told
}

//! Files of the page, in the program itself.

use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE};
use axum::http::{Method, StatusCode, Uri};
use axum::response::{IntoResponse, Response};

/// An asset: path, media type, content.
macro_rules! asset {
    ($path:literal, $media:literal) => {
        (
            concat!("/", $path),
            $media,
            include_bytes!(concat!("../../../assets/ground/", $path)),
        )
    };
}

/// Path, media type, content.
const ASSETS: &[(&str, &str, &[u8])] = &[
    asset!("index.html", "text/html; charset=utf-8"),
    asset!("style.css", "text/css; charset=utf-8"),
    asset!("main.mjs", "text/javascript; charset=utf-8"),
    asset!("cloud.mjs", "text/javascript; charset=utf-8"),
    asset!("link.mjs", "text/javascript; charset=utf-8"),
    asset!("markers.mjs", "text/javascript; charset=utf-8"),
    asset!("panel.mjs", "text/javascript; charset=utf-8"),
    asset!("timeline.mjs", "text/javascript; charset=utf-8"),
    asset!("view.mjs", "text/javascript; charset=utf-8"),
    asset!("vendor/three.mjs", "text/javascript; charset=utf-8"),
];

/// An asset, or 404.
pub(super) async fn get(method: Method, uri: Uri) -> Response {
    let path = if uri.path() == "/" {
        "/index.html"
    } else {
        uri.path()
    };
    let asset = ASSETS.iter().find(|(name, _, _)| *name == path);
    match asset {
        Some((_, media, content)) if method == Method::GET || method == Method::HEAD => {
            // A newer program must not run an older page.
            ([(CONTENT_TYPE, *media), (CACHE_CONTROL, "no-cache")], *content).into_response()
        }
        _ => (StatusCode::NOT_FOUND, "there is no such page\n").into_response(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_asks_nobody_but_its_station() {
        for (path, media, content) in ASSETS {
            let text = std::str::from_utf8(content).expect("text");
            if *path == "/vendor/three.mjs" {
                assert!(text.starts_with("/* three.js ") && text[..120].contains("MIT licence"));
                continue;
            }
            for word in ["http://", "https://", "@import", "url("] {
                assert!(!text.contains(word), "{path} ({media}): {word}");
            }
        }
    }

    #[test]
    fn every_script_that_a_script_asks_for_is_there() {
        for (path, _, content) in ASSETS.iter().filter(|(path, _, _)| path.ends_with(".mjs")) {
            let text = std::str::from_utf8(content).expect("text");
            for rest in text.split(" from './").skip(1) {
                let name = rest.split('\'').next().unwrap_or_default();
                let wanted = format!("/{name}");
                assert!(
                    ASSETS.iter().any(|(path, _, _)| *path == wanted),
                    "{path} asks for {wanted}"
                );
            }
        }
    }
}

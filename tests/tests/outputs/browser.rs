//! The page in a browser: its script runs without an error, draws, and fits a phone.

use std::fs;
use std::path::Path;
use std::process::Command;

use cslam_host_sim::flight_files::ply::Encoding;
use cslam_host_sim::scene::Scene;

use crate::{synthetic, write};

/// Notes errors of the page's scripts and, when it has been drawn, how wide it is, where a dump of the page shows them.
const WATCH: &str = "<script>addEventListener('error', e => { document.body.dataset.error = e.message; });\
const look = () => {\
 if (document.body.dataset.error) return void (document.body.dataset.seen = true);\
 if (!document.body.dataset.view) return void setTimeout(look, 50);\
 const gl = document.getElementById('view').getContext('webgl');\
 const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight], pixels = new Uint8Array(4 * w * h);\
 gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);\
 let drawn = 0; for (let k = 0; k < pixels.length; k += 4) drawn += pixels[k] !== pixels[0] || pixels[k + 1] !== pixels[1];\
 Object.assign(document.body.dataset, { drawn, wide: document.documentElement.scrollWidth, view: document.body.dataset.view });\
 document.body.dataset.seen = true;\
};\
addEventListener('load', look);</script>";

/// The page after its scripts have run in a frame of a width, in CSS pixels.
fn dump(directory: &Path, width: u32) -> String {
    let page = fs::read_to_string(directory.join("report.html")).expect("written");
    fs::write(
        directory.join("watched.html"),
        page.replace("<header>", &format!("{WATCH}<header>")),
    )
    .expect("writable");
    // A browser's window has a least width, a frame has none.
    let frame = format!(
        "<!doctype html><iframe style='border:0;width:{width}px;height:900px' src='watched.html'></iframe><script>\
         const look = () => {{ const page = document.querySelector('iframe').contentDocument.body; \
         if (!page?.dataset.seen) return setTimeout(look, 50); \
         document.body.append(Object.entries(page.dataset).map(([k, v]) => `[${{k}}=${{v}}]`).join('')); }}; look();</script>"
    );
    fs::write(directory.join("frame.html"), frame).expect("writable");
    let output = Command::new("chromium")
        .args([
            "--headless=new",
            "--no-sandbox",
            "--disable-dev-shm-usage",
            "--use-angle=swiftshader",
        ])
        .args([
            "--enable-unsafe-swiftshader",
            "--allow-file-access-from-files",
            // Of the page's own time, which stands still while the browser works: nothing is waited for when it is done.
            "--virtual-time-budget=60000",
            "--dump-dom",
        ])
        .arg(format!("--user-data-dir={}", directory.join("browser").display()))
        .arg(directory.join("frame.html"))
        .output()
        .expect("`cargo verify` installs chromium");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// A value that the page left, such as `[view=drawn]`.
fn value<'a>(dump: &'a str, name: &str) -> Option<&'a str> {
    let mark = format!("[{name}=");
    dump.split_once(&mark)?.1.split_once(']').map(|(value, _)| value)
}

#[test]
fn the_page_draws_without_an_error_and_fits() {
    let scene = Scene::load("outdoor").expect("built in");
    let directory = tempfile::tempdir().expect("a directory");
    write(
        &mut synthetic::fly(&scene, 30.0, 2),
        &scene,
        directory.path(),
        Encoding::Binary,
    );
    for width in [1280, 390] {
        let dump = dump(directory.path(), width);
        assert_eq!(value(&dump, "error"), None, "{width}");
        assert_eq!(
            value(&dump, "view"),
            Some("drawn"),
            "{width}: {}",
            &dump[dump.len().saturating_sub(400)..]
        );
        let number = |name| {
            value(&dump, name)
                .and_then(|v| v.parse::<u32>().ok())
                .expect("noted")
        };
        assert!(number("drawn") > 2000, "{width}: the view shows next to nothing");
        assert!(
            number("wide") <= width,
            "{width}: the page is {} wide",
            number("wide")
        );
    }
}

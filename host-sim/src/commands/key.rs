//! `cslam key`: the secrets of the links.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::Subcommand;
use cslam_core::telemetry::Key;
use cslam_firmware::storage::Mount;

use crate::config::Config;
use crate::input::InputError;
use crate::link_key::{self, LinkKey};
use crate::settings_image;

/// Arguments of `cslam key`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand, Debug)]
enum What {
    /// Draw a new key and write it to a new file that only its owner may read
    New {
        /// The file, which must not exist
        file: PathBuf,
        /// Number of the UAV
        #[arg(long, value_name = "0-255")]
        uav: u8,
    },
    /// Check a key file and print its fingerprint, which says whether two files hold the same key
    Check {
        /// The file
        file: PathBuf,
    },
    /// Write the first settings of a UAV, the key among them, as they lie in its flash
    ///
    /// The image goes to the beginning of the erased settings sectors. Its counters begin at 0, so a UAV that has flown with this
    /// key needs a new one.
    Image {
        /// The key file
        file: PathBuf,
        /// The image, which must not exist
        out: PathBuf,
        /// Configuration file (TOML), of which [board], [radio], [receiver.gmt_setup] and [receiver.magnetic_field] count; `cslam config`
        /// shows what it may hold
        #[arg(long, value_name = "FILE")]
        config: Option<PathBuf>,
        /// Body axes forward, left, up as axes of the inertial sensor: 1, 2, 3 for its x, y, z, negative for the opposite; instead
        /// of the configuration's
        #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
        mount: Option<String>,
    },
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let (file, LinkKey { uav, key }) = match &args.what {
        What::New { file, uav } => (file, link_key::create(file, *uav)?),
        What::Check { file } => (file, link_key::read(file)?),
        What::Image {
            file,
            out,
            config,
            mount,
        } => {
            let mut config = Config::read(config.as_deref(), None)?;
            if let Some(mount) = mount {
                config.board.mount = read_mount(mount)?;
            }
            let (uav, bytes) = link_key::read_bytes(file)?;
            let settings = settings_image::settings(uav, bytes, &config)?;
            write(out, &settings_image::image(&settings)?)?;
            let key = Key::new(bytes);
            (out, LinkKey { uav, key })
        }
    };
    let print: Vec<String> = key
        .fingerprint()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    println!("{}: UAV {uav}, fingerprint {}", file.display(), print.join(":"));
    Ok(())
}

fn read_mount(text: &str) -> Result<Mount, InputError> {
    let axes: Result<Vec<i8>, _> = text.split(',').map(|axis| axis.trim().parse()).collect();
    axes.ok()
        .and_then(|axes| Mount::new(axes.try_into().ok()?))
        .ok_or_else(|| {
            InputError::new(format!(
                "--mount {text}: expected three axes that make a rotation, as 1,2,3 or -2,1,3"
            ))
        })
}

fn write(file: &Path, bytes: &[u8]) -> Result<(), InputError> {
    link_key::private(file)
        .and_then(|mut new| new.write_all(bytes))
        .map_err(|e| InputError::unwritable(file, "cannot be written as a new file", &e))
}

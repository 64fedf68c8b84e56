//! Makes the settings of a board: the record that its flash holds, to be written by a probe (docs/board.md section 4).
//!
//! ```text
//! cargo run -p cslam-firmware --example settings -- settings.bin --uav 1 --key key.bin [--mount 1,2,3] [--counter N]
//! ```
//! `--key`: a file of 32 random bytes, the same that the ground station has. `--counter`: first counter of the downlink; only needed when the
//! board has sent before with this key and its own record is gone.

use std::process::ExitCode;
use std::{env, fs};

use cslam_firmware::storage::{Mount, Settings, image};

fn main() -> ExitCode {
    match run() {
        Ok(line) => {
            println!("{line}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("settings: {error}");
            ExitCode::from(2)
        }
    }
}

fn run() -> Result<String, String> {
    let mut words = env::args().skip(1);
    let out = words
        .next()
        .filter(|word| !word.starts_with('-'))
        .ok_or("expected: FILE --uav N --key FILE [--mount X,Y,Z] [--counter N]")?;
    let mut settings = Settings::default();
    while let Some(word) = words.next() {
        let value = words.next().ok_or_else(|| format!("{word} needs a value"))?;
        match word.as_str() {
            "--uav" => settings.uav = number(&word, &value)?,
            "--counter" => settings.downlink_counter = number(&word, &value)?,
            "--key" => settings.key = Some(key(&value)?),
            "--mount" => settings.mount = mount(&value)?,
            _ => return Err(format!("{word}: there are --uav, --key, --mount and --counter")),
        }
    }
    if settings.key.is_none() {
        return Err("--key is missing: a board without a key does not fly".into());
    }
    fs::write(&out, image(&settings)).map_err(|error| format!("{out}: {error}"))?;
    Ok(format!("{out}: {settings:?}"))
}

fn number<T: std::str::FromStr>(word: &str, value: &str) -> Result<T, String> {
    value
        .parse()
        .map_err(|_| format!("{word} {value}: expected a number in range"))
}

fn key(path: &str) -> Result<[u8; 32], String> {
    let bytes = fs::read(path).map_err(|error| format!("{path}: {error}"))?;
    let length = bytes.len();
    bytes
        .try_into()
        .map_err(|_| format!("{path}: {length} bytes, expected 32"))
}

fn mount(value: &str) -> Result<Mount, String> {
    let axes: Vec<i8> = value
        .split(',')
        .filter_map(|axis| axis.trim().parse().ok())
        .collect();
    let axes: Option<[i8; 3]> = axes.try_into().ok();
    axes.and_then(Mount::new).ok_or_else(|| {
        format!("--mount {value}: expected the sensor's axes that point forward, left and up, a rotation, as in 1,2,3 or -2,1,3")
    })
}

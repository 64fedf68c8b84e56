//! Packets from a radio on a serial port: raw bytes, 8 data bits, no parity. A port that goes away is opened again when it is
//! back.

use std::fs::{File, OpenOptions};
use std::io::{self, Read};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use std::sync::mpsc::SyncSender;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::OFlags;
use rustix::termios::{OptionalActions, isatty, tcgetattr, tcsetattr};

use super::{Said, Source};
use crate::ground::hub::Hub;
use crate::input::InputError;

/// Rate of the radio of the budget, bit/s.
const DEFAULT_BAUD: u32 = 57_600;

/// Time between two tries to open a port that went away.
const AGAIN: Duration = Duration::from_secs(1);

/// How long a wish to end may go unheard, ns.
const PATIENCE_NS: i64 = 100_000_000;

/// `DEVICE[:BAUD]` of the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SerialPort {
    /// Device file.
    pub device: PathBuf,
    /// Bits a second.
    pub baud: u32,
}

impl FromStr for SerialPort {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (device, baud) = match text.rsplit_once(':') {
            Some((device, baud)) => {
                let number = baud.parse().ok().filter(|baud| (300..=4_000_000).contains(baud));
                let expected = "expected DEVICE or DEVICE:BAUD with 300 to 4000000 bit/s";
                (
                    device,
                    number.ok_or(format!("`{baud}` is no baud rate; {expected}"))?,
                )
            }
            None => (text, DEFAULT_BAUD),
        };
        Ok(Self {
            device: device.into(),
            baud,
        })
    }
}

/// An input.
#[derive(Debug)]
pub struct Serial {
    port: SerialPort,
    file: File,
    name: Arc<str>,
}

impl Serial {
    /// Opens a port.
    ///
    /// # Errors
    /// [`InputError`] naming the device when it cannot be opened, is no serial port, or cannot be set to its rate.
    pub fn open(port: SerialPort) -> Result<Self, InputError> {
        let file = open(&port.device, port.baud).map_err(|e| {
            InputError::in_file(&port.device, format!("cannot be opened as a serial port: {e}"))
        })?;
        let name = format!("serial {}", port.device.display()).into();
        Ok(Self { port, file, name })
    }

    /// Its name.
    pub fn name(&self) -> &Arc<str> {
        &self.name
    }

    /// Passes on what comes until the hub is stopped.
    pub fn run(mut self, hub: &Hub, to: &SyncSender<Said>) {
        let trouble = |what: Option<String>| Said::Trouble(Arc::clone(&self.name), what);
        let source = Source::Stream(Arc::clone(&self.name));
        let mut buffer = [0; 4096];
        while !hub.is_stopped() {
            let said = match read(&mut self.file, &mut buffer) {
                Ok(0) => continue,
                Ok(length) => Said::Bytes(source.clone(), buffer.get(..length).unwrap_or_default().to_vec()),
                Err(e) => {
                    if to
                        .send(trouble(Some(format!("closed ({e}), waiting for it"))))
                        .is_err()
                    {
                        return;
                    }
                    let Some(file) = self.reopen(hub) else { return };
                    self.file = file;
                    trouble(None)
                }
            };
            if to.send(said).is_err() {
                return;
            }
        }
    }

    /// Waits until the port can be opened; `None` when the hub is stopped.
    fn reopen(&self, hub: &Hub) -> Option<File> {
        while !hub.is_stopped() {
            std::thread::sleep(AGAIN);
            if let Ok(file) = open(&self.port.device, self.port.baud) {
                return Some(file);
            }
        }
        None
    }
}

fn open(device: &Path, baud: u32) -> io::Result<File> {
    // Neither wait for a carrier nor become the terminal of this process.
    let flags = OFlags::NONBLOCK | OFlags::NOCTTY;
    let file = OpenOptions::new()
        .read(true)
        .write(true)
        .custom_flags(flags.bits().cast_signed())
        .open(device)?;
    if !isatty(&file) {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "it is no terminal device",
        ));
    }
    let mut settings = tcgetattr(&file)?;
    settings.make_raw();
    settings.set_speed(baud)?;
    tcsetattr(&file, OptionalActions::Now, &settings)?;
    Ok(file)
}

/// Bytes that have come, none after a while. An end of file is an error: a port has none.
fn read(file: &mut File, buffer: &mut [u8]) -> io::Result<usize> {
    let wait = Timespec {
        tv_sec: 0,
        tv_nsec: PATIENCE_NS,
    };
    let mut ready = [PollFd::new(&*file, PollFlags::IN)];
    match poll(&mut ready, Some(&wait)) {
        Ok(0) => return Ok(0),
        Ok(_) => {}
        Err(rustix::io::Errno::INTR) => return Ok(0),
        Err(e) => return Err(e.into()),
    }
    match file.read(buffer) {
        Ok(0) => Err(io::Error::new(io::ErrorKind::UnexpectedEof, "the device is gone")),
        Err(e) if e.kind() == io::ErrorKind::WouldBlock => Ok(0),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ports_are_read_with_their_rate() {
        let port = |text: &str| text.parse::<SerialPort>();
        let expected = SerialPort {
            device: "/dev/ttyUSB0".into(),
            baud: 115_200,
        };
        assert_eq!(port("/dev/ttyUSB0:115200"), Ok(expected));
        assert_eq!(port("/dev/ttyACM1").map(|p| p.baud), Ok(DEFAULT_BAUD));
        assert!(
            port("/dev/ttyACM1:fast")
                .expect_err("no number")
                .contains("`fast` is no baud rate")
        );
    }

    #[test]
    fn what_is_no_port_is_refused() {
        let refused = |device: &str| {
            let port = SerialPort {
                device: device.into(),
                baud: DEFAULT_BAUD,
            };
            Serial::open(port).expect_err("no port").to_string()
        };
        assert!(refused("/dev/no-such-port").contains("/dev/no-such-port: cannot be opened"));
        assert!(refused("/dev/null").contains("it is no terminal device"));
    }
}

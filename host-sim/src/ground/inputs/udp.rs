//! Packets over UDP: a datagram holds whole frames.

use std::io::{self, ErrorKind};
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::mpsc::SyncSender;
use std::time::Duration;

use socket2::SockRef;

use super::{Said, Source};
use crate::ground::hub::Hub;
use crate::input::InputError;

/// Asked of the operating system, which may grant less: several seconds of 100 UAVs.
const KERNEL_BUFFER: usize = 8 << 20;

/// How long a wish to end may go unheard.
const PATIENCE: Duration = Duration::from_millis(100);

/// An input.
#[derive(Debug)]
pub struct Udp {
    socket: UdpSocket,
    address: SocketAddr,
    name: Arc<str>,
}

impl Udp {
    /// Listens on an address.
    ///
    /// # Errors
    /// [`InputError`] naming the address when it is in use or not this machine's.
    pub fn open(address: SocketAddr) -> Result<Self, InputError> {
        let refused = |e: io::Error| {
            InputError::new(format!(
                "--listen {address}: cannot be listened on ({e}); choose another port"
            ))
        };
        let socket = UdpSocket::bind(address).map_err(refused)?;
        socket.set_read_timeout(Some(PATIENCE)).map_err(refused)?;
        // Granted or not: less means only that bursts must be shorter.
        let _granted = SockRef::from(&socket).set_recv_buffer_size(KERNEL_BUFFER);
        let address = socket.local_addr().map_err(refused)?;
        Ok(Self {
            socket,
            address,
            name: format!("udp {address}").into(),
        })
    }

    /// Where it listens; when port 0 was asked for, which one it got.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Its name.
    pub fn name(&self) -> &Arc<str> {
        &self.name
    }

    /// Passes on what comes until the hub is stopped.
    pub fn run(self, hub: &Hub, to: &SyncSender<Said>) {
        let mut buffer = vec![0; 1 << 16];
        while !hub.is_stopped() {
            let said = match self.socket.recv(&mut buffer) {
                Ok(length) => {
                    let bytes = buffer.get(..length).unwrap_or_default().to_vec();
                    Said::Bytes(Source::Datagram(Arc::clone(&self.name)), bytes)
                }
                Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => continue,
                // What a peer's machine says about an earlier datagram.
                Err(e) if e.kind() == ErrorKind::ConnectionReset => continue,
                Err(e) => {
                    std::thread::sleep(PATIENCE);
                    Said::Trouble(Arc::clone(&self.name), Some(e.to_string()))
                }
            };
            if to.send(said).is_err() {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_in_use_is_one_clear_line() {
        let first = Udp::open(([127, 0, 0, 1], 0).into()).expect("a free port");
        let address = first.address();
        let error = Udp::open(address).expect_err("in use").to_string();
        assert!(
            error.starts_with(&format!("--listen {address}: cannot be listened on")),
            "{error}"
        );
        assert!(!error.contains('\n'));
    }
}

//! What the library half does for a board, whatever its devices answer: FIFO, settings, mount, supervision, fault record.
//!
//! Of the asynchronous drivers only what they do between two transfers: a future that is polled after its end panics by design, and the compiler does not see
//! that no executor does so.

use core::hint::black_box;
use core::sync::atomic::AtomicU32;
use core::task::Poll;

use cslam_core::geometry::Vector3;
use cslam_core::inertial::ImuSample;
use cslam_core::telemetry::{Key, Sender};
use cslam_firmware::fault::{FaultRecord, WORDS};
use cslam_firmware::front_end::{Capture, Look, Port};
use cslam_firmware::icm42688::{Fifo, Samples, TRANSFER};
use cslam_firmware::log::Lines;
use cslam_firmware::storage::{EraseInBackground, Ledger, Mount, Store};
use cslam_firmware::supervisor::{Progress, Supervisor, Watched};
use embedded_storage::nor_flash::{self, NorFlash, NorFlashErrorKind, ReadNorFlash};

/// A flash of which the compiler knows nothing.
struct Opaque;

impl nor_flash::ErrorType for Opaque {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Opaque {
    const READ_SIZE: usize = 4;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        black_box((offset, bytes));
        black_box(Ok(()))
    }

    fn capacity(&self) -> usize {
        black_box(0)
    }
}

impl NorFlash for Opaque {
    const WRITE_SIZE: usize = 32;
    const ERASE_SIZE: usize = 128 * 1024;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        black_box((from, to));
        black_box(Ok(()))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        black_box((offset, bytes));
        black_box(Ok(()))
    }
}

impl EraseInBackground for Opaque {
    fn begin_erase(&mut self, sector: u32) -> Result<(), NorFlashErrorKind> {
        black_box(sector);
        black_box(Ok(()))
    }

    fn poll_erase(&mut self) -> Poll<Result<(), NorFlashErrorKind>> {
        black_box(Poll::Pending)
    }
}

/// A camera port of which the compiler knows nothing.
struct OpaquePort;

impl Port for OpaquePort {
    fn arm(&mut self) {
        black_box(());
    }

    fn disarm(&mut self) {
        black_box(());
    }

    fn ready(&mut self, high: bool) {
        black_box(high);
    }

    fn look(&mut self) -> Look {
        black_box(Look::default())
    }
}

/// Uses all of it.
pub(crate) fn drive() {
    if let Ok(store) = Store::open(Opaque) {
        black_box((store.refused(), store.left()));
        if let Ok(mut ledger) = Ledger::begin(store) {
            let mut sender = Sender::new(1, &Key::TEST, ledger.first_downlink());
            sender.allow(ledger.settings().downlink_counter);
            let opener = ledger.opener(&Key::TEST);
            black_box(ledger.reserve_uplink(black_box(0)));
            black_box(ledger.renew_downlink(&mut sender).is_ok());
            black_box(ledger.next_session().is_ok());
            black_box(ledger.tend().is_ok());
            black_box(ledger.close(&mut sender, opener.next()).is_ok());
        }
    }
    let mut capture = Capture::offer(&mut OpaquePort, black_box(0));
    black_box(capture.step(&mut OpaquePort, black_box(0)));
    let (write, read) = (AtomicU32::new(black_box(0)), AtomicU32::new(black_box(0)));
    let mut lines = Lines::new(black_box(&[]), &write, &read);
    lines.begin();
    lines.put(black_box(&[]));
    lines.end();
    black_box((lines.lost(), lines.room()));
    let mount = Mount::new(black_box([1, 2, 3])).unwrap_or_default();
    black_box(mount.to_body(&black_box(ImuSample {
        time_ns: 0,
        rate_rad_per_s: Vector3::zeros(),
        specific_force_m_per_s2: Vector3::zeros(),
    })));
    let mut fifo = Fifo::new();
    let mut samples = Samples::new();
    while black_box(fifo.request()) > 0 {
        black_box(fifo.answer(&black_box([0; TRANSFER]), black_box(0), &mut samples));
        black_box((fifo.counters(), samples.as_slice()));
    }
    let record = FaultRecord::from_words(&black_box([0; WORDS]));
    black_box(record.map(|record| record.to_words()));
    let progress = Progress::new();
    let tasks = [Watched {
        name: "task",
        progress: &progress,
        deadline_ns: black_box(0),
    }];
    let mut supervisor = Supervisor::new(tasks, black_box(0));
    progress.mark();
    black_box(supervisor.check(black_box(0)).is_ok());
}

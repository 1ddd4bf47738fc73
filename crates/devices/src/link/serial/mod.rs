//! Real serial ports, and pseudo-terminals in their place.

mod pty;

use std::fs::OpenOptions;
use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::{Duration, Instant};

use rustix::fs::OFlags;
use rustix::process::{Pid, Signal};
use rustix::termios::{ControlModes, OptionalActions, tcgetattr, tcsetattr};
use serialport::{SerialPort, SerialPortType, TTYPort};
use tracing::{debug, trace};

use super::{Link, LinkError, PortFacts, PortLock, UsbFacts, holder};

pub use pty::{PtyServer, serve};

/// A message takes a few ms to send; a port that accepts nothing for this time is stuck.
const SEND_PATIENCE: Duration = Duration::from_secs(2);

/// A serial port of this machine, locked by this process.
pub struct SerialLink {
    path: String,
    port: TTYPort,
    opened: Instant,
    session: u64,
    _lock: PortLock,
}

impl SerialLink {
    /// Opens `path` at `baud`, 8 data bits, no parity, 1 stop bit.
    ///
    /// The first opening after connecting the board resets an Arduino. Later ones do not, because the port
    /// keeps its control lines when it is closed.
    ///
    /// # Errors
    /// [`LinkError`] if there is no such port, another process uses it, or the user may not open it.
    pub fn open(path: &str, baud: u32) -> Result<Self, LinkError> {
        if !Path::new(path).exists() {
            return Err(LinkError::NoSuchPort(path.to_owned()));
        }
        let lock = PortLock::take(path)?;
        keep_control_lines(path)?;
        let builder = serialport::new(path, baud).timeout(SEND_PATIENCE);
        let port = TTYPort::open(&builder).map_err(|error| match error.kind {
            serialport::ErrorKind::NoDevice => {
                LinkError::Busy { port: path.to_owned(), holder: "another program".to_owned() }
            }
            serialport::ErrorKind::Io(kind) => unopened(path, kind, &error),
            _ => unopened(path, ErrorKind::Other, &error),
        })?;
        debug!(port = path, "line opened");
        Ok(Self {
            path: path.to_owned(),
            port,
            opened: Instant::now(),
            session: RandomState::new().build_hasher().finish(),
            _lock: lock,
        })
    }

    fn failed(&self, action: &'static str, error: &std::io::Error) -> LinkError {
        match error.kind() {
            // A hang-up is a broken pipe, end of file, or an input/output error without a kind of its own.
            ErrorKind::BrokenPipe | ErrorKind::UnexpectedEof | ErrorKind::NotFound | ErrorKind::Other => {
                LinkError::Lost(self.path.clone())
            }
            _ => LinkError::Io { port: self.path.clone(), action, detail: error.to_string() },
        }
    }
}

fn unopened(path: &str, kind: ErrorKind, error: &dyn std::fmt::Display) -> LinkError {
    let port = path.to_owned();
    match kind {
        ErrorKind::PermissionDenied => LinkError::Permission(port),
        ErrorKind::NotFound => LinkError::NoSuchPort(port),
        ErrorKind::ResourceBusy => LinkError::Busy { port, holder: "another program".to_owned() },
        _ => LinkError::Io { port, action: "open it as a serial port", detail: error.to_string() },
    }
}

/// Clears "hang up on close". Else each command would drop DTR at its end and the next would raise it, which
/// resets an Arduino, and the position would be lost.
fn keep_control_lines(path: &str) -> Result<(), LinkError> {
    let flags = (OFlags::NOCTTY | OFlags::NONBLOCK).bits() as i32;
    let file = OpenOptions::new().read(true).write(true).custom_flags(flags).open(path);
    let file = file.map_err(|error| unopened(path, error.kind(), &error))?;
    let unset = tcgetattr(&file).and_then(|mut modes| {
        modes.control_modes.remove(ControlModes::HUPCL);
        tcsetattr(&file, OptionalActions::Now, &modes)
    });
    unset.map_err(|error| unopened(path, std::io::Error::from(error).kind(), &error))
}

/// Opens a serial port; see [`SerialLink::open`].
///
/// # Errors
/// [`LinkError`] if there is no such port, another process uses it, or the user may not open it.
pub fn open(path: &str, baud: u32) -> Result<Box<dyn Link>, LinkError> {
    Ok(Box::new(SerialLink::open(path, baud)?))
}

/// Asks the process that uses a port to stop its stage now (SIGUSR1), if it is this program and heeds the signal, which
/// would end it otherwise. Returns its id.
pub fn ask_holder_to_stop(port: &str) -> Option<i32> {
    let pid = holder(port)?;
    // A lock file may be older than the process that has the id now.
    let program = |process: &str| std::fs::read_link(format!("/proc/{process}/exe")).ok();
    if program(&pid.to_string())?.file_name() != program("self")?.file_name() {
        return None;
    }
    if !catches(pid, Signal::USR1) {
        return None;
    }
    rustix::process::kill_process(Pid::from_raw(pid)?, Signal::USR1).ok()?;
    Some(pid)
}

/// Whether a process has a handler for `signal`, as the kernel tells (proc(5)).
fn catches(pid: i32, signal: Signal) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    let caught = caught.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    caught.is_some_and(|mask| mask >> (signal.as_raw() - 1) & 1 == 1)
}

impl Link for SerialLink {
    fn name(&self) -> &str {
        &self.path
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        let sent = self.port.set_timeout(SEND_PATIENCE).map_err(std::io::Error::from);
        let sent = sent.and_then(|()| self.port.write_all(bytes));
        trace!(port = self.path, bytes = %bytes.escape_ascii(), ok = sent.is_ok(), "sent");
        sent.map_err(|error| self.failed("send", &error))
    }

    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> Result<usize, LinkError> {
        let until = Instant::now() + patience;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let read = self.port.set_timeout(left).map_err(std::io::Error::from);
            match read.and_then(|()| self.port.read(buffer)) {
                Ok(0) => return Err(LinkError::Lost(self.path.clone())),
                Ok(count) => {
                    trace!(port = self.path, bytes = %buffer[..count].escape_ascii(), "received");
                    return Ok(count);
                }
                Err(error) if error.kind() == ErrorKind::Interrupted && !left.is_zero() => {}
                Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {
                    return Ok(0);
                }
                Err(error) => return Err(self.failed("receive", &error)),
            }
        }
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }

    fn session(&self) -> u64 {
        self.session
    }
}

/// The serial ports of this machine, sorted by path.
///
/// # Errors
/// [`LinkError::Io`] if the system cannot list them.
pub fn ports() -> Result<Vec<PortFacts>, LinkError> {
    // The crate panics on a system without this folder.
    if !Path::new("/sys/class/tty").is_dir() {
        return Ok(Vec::new());
    }
    let found = serialport::available_ports().map_err(|error| LinkError::Io {
        port: "/sys/class/tty".to_owned(),
        action: "list the serial ports",
        detail: error.to_string(),
    })?;
    let mut ports: Vec<PortFacts> = found
        .into_iter()
        .map(|port| PortFacts {
            path: port.port_name,
            usb: match port.port_type {
                SerialPortType::UsbPort(usb) => Some(UsbFacts {
                    vendor: usb.vid,
                    product: usb.pid,
                    serial_number: usb.serial_number,
                    manufacturer: usb.manufacturer,
                    name: usb.product,
                }),
                _ => None,
            },
        })
        .collect();
    ports.sort_by(|one, other| one.path.cmp(&other.path));
    Ok(ports)
}

//! A simulated device behind a pseudo-terminal, for programs that open a port.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use serialport::TTYPort;

use crate::link::{LineNoise, LinkError, PortLock, SimulatedDevice};

/// Baud rate of all simulated dialects.
const BAUD: u32 = 115_200;
/// Longest time for which the server waits for bytes before it advances the device.
const PATIENCE: Duration = Duration::from_millis(1);
/// The device's time passes in steps of this length at most, a tenth of what its watchdog waits. On a busy machine this
/// thread may have to wait longer for its turn, and so may what it serves: the device is then late, instead of missing
/// what was sent to it meanwhile.
const LONGEST_STEP: Duration = Duration::from_millis(50);

/// Runs a simulated device in real time behind a pseudo-terminal, or on a serial port, until it is dropped.
///
/// The cable of the device is the pseudo-terminal: when it is disconnected the terminal hangs up, and when it
/// returns there is a new terminal under the same link. On a serial port the line is silent meanwhile.
pub struct PtyServer {
    link: PathBuf,
    quit: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl PtyServer {
    /// Whether the device is running; `false` after a failure to create a new terminal.
    pub fn alive(&self) -> bool {
        self.thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }
}

/// Puts `device` behind a pseudo-terminal with the symbolic link `link`; or, if `link` is a serial port,
/// on that port.
///
/// # Errors
/// [`LinkError`] if there is no pseudo-terminal, the link cannot be created or the port cannot be opened.
/// Any other file at `link` is not changed.
pub fn serve(
    device: impl SimulatedDevice + 'static,
    noise: &LineNoise,
    link: &Path,
) -> Result<PtyServer, LinkError> {
    let quit = Arc::new(AtomicBool::new(false));
    let pty = Pty::open(link)?;
    let mut server = Server {
        device,
        to_device: noise.clone(),
        from_device: noise.reversed(),
        held_until: Instant::now(),
        link: link.to_owned(),
        quit: Arc::clone(&quit),
    };
    let thread = Builder::new().spawn(move || server.run(pty)).map_err(|error| {
        remove_link(link);
        LinkError::Io {
            port: link.display().to_string(),
            action: "start the device",
            detail: error.to_string(),
        }
    })?;
    Ok(PtyServer { link: link.to_owned(), quit, thread: Some(thread) })
}

impl Drop for PtyServer {
    fn drop(&mut self) {
        self.quit.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        remove_link(&self.link);
    }
}

/// Removes the symbolic link; a serial port is not removed.
fn remove_link(link: &Path) {
    if link.is_symlink() {
        // It may have been removed already.
        let _ = std::fs::remove_file(link);
    }
}

/// Bytes in both directions, for which reading and writing wait no longer than [`PATIENCE`].
trait Host: Read + Write + Send {}

impl<T: Read + Write + Send> Host for T {}

/// The device's line: both ends of a pseudo-terminal, or a serial port.
struct Pty {
    host: Box<dyn Host>,
    /// The device's end stays open, so that clients may connect and disconnect.
    _device: Option<OwnedFd>,
    _lock: Option<PortLock>,
}

/// The host's end of a pseudo-terminal. No process that is started meanwhile keeps it open: the terminal would not
/// hang up when it is closed here.
struct Terminal(File);

impl Terminal {
    /// Both ends, of which nothing changes the bytes, and the path of the device's.
    fn pair() -> rustix::io::Result<(Self, OwnedFd, PathBuf)> {
        let host = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&host)?;
        unlockpt(&host)?;
        let name = ptsname(&host, Vec::new())?;
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        let device = rustix::fs::open(name.as_c_str(), flags, Mode::empty())?;
        let mut modes = tcgetattr(&device)?;
        modes.make_raw();
        tcsetattr(&device, OptionalActions::Now, &modes)?;
        Ok((Self(File::from(host)), device, OsStr::from_bytes(name.as_bytes()).into()))
    }

    fn wait_for(&self, flags: PollFlags) -> std::io::Result<()> {
        let patience = Timespec { tv_sec: 0, tv_nsec: PATIENCE.subsec_nanos().into() };
        match poll(&mut [PollFd::new(&self.0, flags)], Some(&patience))? {
            0 => Err(ErrorKind::TimedOut.into()),
            _ => Ok(()),
        }
    }
}

impl Read for Terminal {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        self.wait_for(PollFlags::IN)?;
        self.0.read(buffer)
    }
}

impl Write for Terminal {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.wait_for(PollFlags::OUT)?;
        self.0.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

/// Whether a path is a device itself, and not a link to a pseudo-terminal.
fn is_port(path: &Path) -> bool {
    std::fs::symlink_metadata(path).is_ok_and(|there| there.file_type().is_char_device())
}

impl Pty {
    /// A serial port, if there is one at `path` itself; else a pseudo-terminal with a link there.
    fn open(path: &Path) -> Result<Self, LinkError> {
        if !is_port(path) {
            return Self::pair(path);
        }
        let name = path.display().to_string();
        let lock = PortLock::take(&name)?;
        let port = serialport::new(&name, BAUD).timeout(PATIENCE);
        let host = TTYPort::open(&port).map_err(|error| LinkError::Io {
            port: name,
            action: "open it as a serial port",
            detail: error.to_string(),
        })?;
        Ok(Self { host: Box::new(host), _device: None, _lock: Some(lock) })
    }

    fn pair(link: &Path) -> Result<Self, LinkError> {
        let failed = |action: &'static str, detail: String| LinkError::Io {
            port: link.display().to_string(),
            action,
            detail,
        };
        let (host, device, target) =
            Terminal::pair().map_err(|error| failed("make a pseudo-terminal", error.to_string()))?;
        if link.exists() {
            return Err(failed(
                "create this link",
                "it exists and points to something; give another name".to_owned(),
            ));
        }
        if link.is_symlink() {
            std::fs::remove_file(link).map_err(|error| failed("replace the link", error.to_string()))?;
        }
        std::os::unix::fs::symlink(target, link)
            .map_err(|error| failed("link the pseudo-terminal", error.to_string()))?;
        Ok(Self { host: Box::new(host), _device: Some(device), _lock: None })
    }
}

struct Server<D> {
    device: D,
    to_device: LineNoise,
    from_device: LineNoise,
    held_until: Instant,
    link: PathBuf,
    quit: Arc<AtomicBool>,
}

impl<D: SimulatedDevice> Server<D> {
    fn run(&mut self, pty: Pty) {
        let mut pty = Some(pty);
        let mut waiting = Vec::new();
        let mut last = Instant::now();
        while !self.quit.load(Ordering::Relaxed) {
            let now = Instant::now();
            self.device.advance((now - last).min(LONGEST_STEP));
            last = now;
            if !self.device.connected() {
                if pty.take().is_some() {
                    remove_link(&self.link);
                }
                waiting.clear();
                self.device.take_sent();
                std::thread::sleep(PATIENCE);
                continue;
            }
            let Some(pty) = &mut pty else {
                // Without a terminal there is no client; `alive` reports it.
                let Ok(opened) = Pty::open(&self.link) else { return };
                pty = Some(opened);
                continue;
            };
            self.exchange(pty, &mut waiting);
        }
    }

    fn exchange(&mut self, pty: &mut Pty, waiting: &mut Vec<u8>) {
        let mut buffer = [0; 256];
        // A failed read is a time-out: the terminal cannot hang up while its other end is open here, and a
        // disconnected port is silent.
        let count = pty.host.read(&mut buffer).unwrap_or(0);
        for &byte in &buffer[..count] {
            for arrived in self.to_device.pass(byte) {
                self.device.receive(arrived);
            }
        }
        for byte in self.device.take_sent() {
            self.held_until = self.held_until.max(Instant::now() + self.from_device.hold_up());
            waiting.extend(self.from_device.pass(byte));
        }
        if Instant::now() >= self.held_until && !waiting.is_empty() {
            // Bytes that are not read are lost, as on a wire.
            let _ = pty.host.write_all(waiting);
            waiting.clear();
        }
    }
}

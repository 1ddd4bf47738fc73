//! A simulated device behind a pseudo-terminal, for programs that open a port.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serialport::{SerialPort, TTYPort};

use crate::link::{LineNoise, LinkError, SimulatedDevice};

/// How long the device may be deaf while its server waits for bytes.
const PATIENCE: Duration = Duration::from_millis(1);

/// Runs a simulated device in real time behind a pseudo-terminal until it is dropped.
///
/// The device's cable is the pseudo-terminal: when it is pulled the terminal hangs up, and when it returns there is
/// another one under the same link.
pub struct PtyServer {
    link: PathBuf,
    quit: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl PtyServer {
    /// Puts `device` behind a pseudo-terminal to which `link` becomes a symbolic link.
    ///
    /// # Errors
    /// [`LinkError::Io`] if there is no pseudo-terminal or the link cannot be made; a file at `link` that is no link is
    /// left alone.
    pub fn start(
        device: impl SimulatedDevice + 'static,
        noise: &LineNoise,
        link: &Path,
    ) -> Result<Self, LinkError> {
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
        let thread = std::thread::spawn(move || server.run(pty));
        Ok(Self { link: link.to_owned(), quit, thread: Some(thread) })
    }

    /// Whether the device is still being run; not after a failure to make a new terminal.
    pub fn alive(&self) -> bool {
        self.thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }
}

impl Drop for PtyServer {
    fn drop(&mut self) {
        self.quit.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        let _ = std::fs::remove_file(&self.link);
    }
}

/// Both ends of a pseudo-terminal. The device's end is held open, so that clients may come and go.
struct Pty {
    host: TTYPort,
    _device: TTYPort,
}

impl Pty {
    fn open(link: &Path) -> Result<Self, LinkError> {
        let failed = |action: &'static str, detail: String| LinkError::Io {
            port: link.display().to_string(),
            action,
            detail,
        };
        let pair = TTYPort::pair().and_then(|(mut host, device)| {
            host.set_timeout(PATIENCE)?;
            Ok((host, device))
        });
        let (host, device) = pair.map_err(|error| failed("make a pseudo-terminal", error.to_string()))?;
        let target =
            device.name().ok_or_else(|| failed("make a pseudo-terminal", "it has no name".to_owned()))?;
        if link.exists() {
            return Err(failed(
                "make this link",
                "it exists and leads somewhere; give another name".to_owned(),
            ));
        }
        if link.is_symlink() {
            std::fs::remove_file(link).map_err(|error| failed("replace the link", error.to_string()))?;
        }
        std::os::unix::fs::symlink(target, link)
            .map_err(|error| failed("link the pseudo-terminal", error.to_string()))?;
        Ok(Self { host, _device: device })
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
            self.device.advance(now - last);
            last = now;
            if !self.device.connected() {
                if pty.take().is_some() {
                    // As the name of a device goes with it.
                    let _ = std::fs::remove_file(&self.link);
                }
                waiting.clear();
                self.device.take_sent();
                std::thread::sleep(PATIENCE);
                continue;
            }
            let Some(pty) = &mut pty else {
                // Without a terminal there is nobody to tell; `alive` says it.
                let Ok(opened) = Pty::open(&self.link) else { return };
                pty = Some(opened);
                continue;
            };
            self.exchange(pty, &mut waiting);
        }
    }

    fn exchange(&mut self, pty: &mut Pty, waiting: &mut Vec<u8>) {
        let mut buffer = [0; 256];
        // A read that fails has timed out: the terminal cannot hang up while its other end is held open here.
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
            // What nobody reads is lost, as on a wire.
            let _ = pty.host.write_all(waiting);
            waiting.clear();
        }
    }
}

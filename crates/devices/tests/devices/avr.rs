//! A processor in simavr, in a process of its own: its UART is a port, and it answers orders with lines of JSON.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde_json::Value;

/// One processor is simulated at a time: two would be too slow for real time.
static ONE: Mutex<()> = Mutex::new(());

pub(crate) struct Avr {
    process: Child,
    answers: BufReader<ChildStdout>,
    port: String,
    _folder: tempfile::TempDir,
    _alone: MutexGuard<'static, ()>,
}

impl Drop for Avr {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Avr {
    /// Switches on a processor with `firmware`, which `host` simulates.
    pub(crate) fn start(host: &Path, firmware: &Path) -> Self {
        let alone = ONE.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = tempfile::tempdir().unwrap();
        let port = folder.path().join("port").to_string_lossy().into_owned();
        let mut process = Command::new(host)
            .arg(firmware)
            .arg(&port)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let answers = BufReader::new(process.stdout.take().unwrap());
        let mut avr = Self { process, answers, port, _folder: folder, _alone: alone };
        avr.answer();
        avr
    }

    fn answer(&mut self) -> Value {
        loop {
            let mut line = String::new();
            assert!(self.answers.read_line(&mut line).unwrap() > 0, "the simulation has ended");
            // The simulator has some words of its own.
            if let Some(start) = line.find('{') {
                return serde_json::from_str(&line[start..]).unwrap();
            }
        }
    }

    /// The answer to an order.
    pub(crate) fn tell(&mut self, order: &str) -> Value {
        writeln!(self.process.stdin.as_mut().unwrap(), "{order}").unwrap();
        self.answer()
    }

    pub(crate) fn port(&self) -> &str {
        &self.port
    }
}

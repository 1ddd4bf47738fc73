//! Replacement in builds without serial ports: an error that says how to build with them.

use std::path::Path;

use super::{LineNoise, Link, LinkError, PortFacts, SimulatedDevice};

fn not_built<T>(port: &str) -> Result<T, LinkError> {
    Err(LinkError::NotBuilt { port: port.to_owned() })
}

/// Opens a serial port.
///
/// # Errors
/// Always [`LinkError::NotBuilt`].
pub fn open(path: &str, _baud: u32) -> Result<Box<dyn Link>, LinkError> {
    not_built(path)
}

/// The serial ports of this machine.
///
/// # Errors
/// Always [`LinkError::NotBuilt`].
pub fn ports() -> Result<Vec<PortFacts>, LinkError> {
    not_built("a serial port")
}

/// Asks the process that uses a port to stop its stage; this build knows of none.
pub fn ask_holder_to_stop(_port: &str) -> Option<i32> {
    None
}

/// In other builds, runs simulated devices behind pseudo-terminals.
#[derive(Debug)]
pub enum PtyServer {}

impl PtyServer {
    /// Whether the device is running.
    pub fn alive(&self) -> bool {
        match *self {}
    }
}

/// Puts a simulated device behind a pseudo-terminal.
///
/// # Errors
/// Always [`LinkError::NotBuilt`].
pub fn serve(
    _device: impl SimulatedDevice + 'static,
    _noise: &LineNoise,
    link: &Path,
) -> Result<PtyServer, LinkError> {
    not_built(&link.display().to_string())
}

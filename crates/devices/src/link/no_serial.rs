//! Serial ports where there is no Unix: an error that says so.

use std::path::Path;

use super::{LineNoise, Link, LinkError, PortFacts, SimulatedDevice};

fn not_here<T>(port: &str) -> Result<T, LinkError> {
    Err(LinkError::NotOnThisSystem(port.to_owned()))
}

/// Opens a serial port.
///
/// # Errors
/// Always [`LinkError::NotOnThisSystem`].
pub fn open(path: &str, _baud: u32) -> Result<Box<dyn Link>, LinkError> {
    not_here(path)
}

/// The serial ports of this machine.
///
/// # Errors
/// Always [`LinkError::NotOnThisSystem`].
pub fn ports() -> Result<Vec<PortFacts>, LinkError> {
    not_here("a serial port")
}

/// The process that uses `port`; here none is known.
pub fn holder(_port: &str) -> Option<i32> {
    None
}

/// Asks the process that uses a port to stop its stage; here none is known.
pub fn ask_holder_to_stop(_port: &str) -> Option<i32> {
    None
}

/// On Unix, runs simulated devices behind pseudo-terminals.
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
/// Always [`LinkError::NotOnThisSystem`].
pub fn serve(
    _device: impl SimulatedDevice + 'static,
    _noise: &LineNoise,
    link: &Path,
) -> Result<PtyServer, LinkError> {
    not_here(&link.display().to_string())
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    struct Silent;

    impl SimulatedDevice for Silent {
        fn receive(&mut self, _byte: u8) {}

        fn advance(&mut self, _time: Duration) {}

        fn take_sent(&mut self) -> Vec<u8> {
            Vec::new()
        }
    }

    #[test]
    fn a_system_without_serial_ports_says_so() {
        let served = serve(Silent, &LineNoise::quiet(1), Path::new("stage"));
        let errors = [open("COM3", 115_200).err(), ports().err(), served.err()];
        for error in errors {
            assert!(error.unwrap().to_string().contains("epirig opens serial ports on Linux"));
        }
        assert_eq!((holder("COM3"), ask_holder_to_stop("COM3")), (None, None));
    }
}

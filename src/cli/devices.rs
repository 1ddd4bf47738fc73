//! `epirig devices`.

use clap::Args;
use serde::Serialize;

use super::{CliError, Talk};
use crate::link::{LinkError, holder, ports};

/// List the serial ports that a stage may be connected to
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig devices
  epirig devices --json

What stands in brackets can be given to --port. Nothing is sent to any device.")]
pub(super) struct Devices {}

#[derive(Serialize)]
struct Port {
    path: String,
    usb: Option<Usb>,
    /// Number of the process that has it, if it is an epirig or says so in the lock file.
    used_by: Option<i32>,
}

#[derive(Serialize)]
struct Usb {
    vendor: String,
    product: String,
    serial_number: Option<String>,
    manufacturer: Option<String>,
    name: Option<String>,
}

impl Devices {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let found = ports()?;
        if found.is_empty() {
            return Err(LinkError::NoMatch {
                wanted: "a serial port".to_owned(),
                connected: "nothing".to_owned(),
            }
            .into());
        }
        let mut text = String::new();
        let mut listed = Vec::new();
        for port in found {
            let used_by = holder(&port.path);
            text += &port.to_string();
            if let Some(pid) = used_by {
                text += &format!(", in use by process {pid}");
            }
            text.push('\n');
            let usb = port.usb.map(|usb| Usb {
                vendor: format!("{:04x}", usb.vendor),
                product: format!("{:04x}", usb.product),
                serial_number: usb.serial_number,
                manufacturer: usb.manufacturer,
                name: usb.name,
            });
            listed.push(Port { path: port.path, usb, used_by });
        }
        talk.result(&listed, || text)
    }
}

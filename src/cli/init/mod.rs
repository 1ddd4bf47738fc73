//! `epirig init`.

mod questions;

use std::io::IsTerminal;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::files::write_new;
use super::progress::tell;
use super::{CliError, Talk};
use crate::profile::{Draft, Findings, FoundCamera, commented};
use epirig_core::shell::quoted;
use epirig_devices::camera::pixels::PixelFormat;
use epirig_devices::camera::{Camera, CameraError, CameraIdentity, V4l2Camera, V4l2Device, cameras};
use epirig_devices::link::{LinkError, PortFacts, ports};
use questions::{ask, mistakes};

/// Write a rig profile for the connected devices
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig init                     writes rig.toml here, which other commands then take
  epirig init --out lab/rig.toml
  epirig init --non-interactive   asks nothing

The connected USB serial port and camera are filled in, if there is exactly one of each. In a
terminal it asks for lens, steps and boards. All other keys are listed as comments with their
meaning. An existing file is refused.")]
pub(super) struct Init {
    /// The file to write
    #[arg(long, value_name = "FILE", default_value = "rig.toml")]
    out: PathBuf,
    /// Ask nothing, also in a terminal
    #[arg(long)]
    non_interactive: bool,
}

#[derive(Serialize)]
struct Written {
    file: String,
    ports: Vec<String>,
    cameras: Vec<String>,
}

impl Init {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        if self.out.exists() {
            return Err(CliError::Usage(format!(
                "{} exists already; give another name with --out",
                self.out.display()
            )));
        }
        let findings = findings()?;
        let mut draft = Draft::read(&commented(&findings), "rig.toml", &[])?;
        if !self.non_interactive && std::io::stdin().is_terminal() {
            draft = ask(draft, &mut std::io::stdin().lock(), &mut |line| tell(line));
        }
        for mistake in mistakes(&draft) {
            talk.say(&format!("note: {mistake}"));
        }
        write_new(&self.out, draft.commented(&findings).as_bytes())?;
        let written = Written {
            file: self.out.display().to_string(),
            cameras: findings.cameras.iter().map(|camera| camera.choice.clone()).collect(),
            ports: findings.ports,
        };
        talk.result(&written, || {
            let list = |found: &[String], what: &str| match found {
                [] => format!("no {what} found"),
                found => format!("{what}: {}", found.join(", ")),
            };
            let file = quoted(&self.out);
            format!(
                "{file} written ({}; {})\nfill in what is missing of plan and optics, then `epirig doctor --rig {file}` examines the rig\n",
                list(&written.ports, "serial port"),
                list(&written.cameras, "camera")
            )
        })
    }
}

fn findings() -> Result<Findings, CliError> {
    let ports = match ports() {
        Err(LinkError::NotOnThisSystem { .. }) => Vec::new(),
        found => found?,
    };
    let cameras = match cameras() {
        Err(CameraError::NotOnThisSystem { .. }) => Vec::new(),
        found => found?,
    };
    Ok(Findings {
        // Ports of the main board exist whether or not anything is connected to them.
        ports: ports.iter().filter(|port| port.usb.is_some()).map(port_choice).collect(),
        cameras: cameras.iter().map(|camera| found_camera(camera, &cameras)).collect(),
    })
}

/// A name that does not depend on the socket, if the port has one.
fn port_choice(port: &PortFacts) -> String {
    let serial_number = port.usb.as_ref().and_then(|usb| usb.serial_number.as_ref());
    serial_number.map_or_else(|| port.path.clone(), |serial_number| format!("usb:{serial_number}"))
}

fn found_camera(identity: &CameraIdentity, connected: &[CameraIdentity]) -> FoundCamera {
    let offered = V4l2Device::open(&identity.name()).and_then(|device| V4l2Camera::new(device).offered());
    // A camera that another program uses is listed too.
    let formats = offered.unwrap_or_default();
    let known = formats.iter().filter(|format| PixelFormat::from_four_cc(format.four_cc).is_some());
    FoundCamera {
        choice: identity.lasting_name(connected),
        model: identity.model.clone(),
        formats: known.map(|format| format.four_cc.to_string()).collect(),
    }
}

//! `epirig init`.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::files::write_new;
use super::{CliError, Talk};
use crate::profile::{Findings, FoundCamera, commented};
use epirig_devices::camera::pixels::PixelFormat;
use epirig_devices::camera::{Camera, CameraError, CameraIdentity, V4l2Camera, V4l2Device, cameras};
use epirig_devices::link::{LinkError, PortFacts, ports};

/// Write a rig profile from what is connected
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig init                     writes rig.toml here, which other commands then take
  epirig init --out lab/rig.toml

A USB serial port and a camera that are connected are filled in, if there is one of each; everything else stands there as a \
comment, with what it means. A file that exists is refused.")]
pub(super) struct Init {
    /// The file to write
    #[arg(long, value_name = "FILE", default_value = "rig.toml")]
    out: PathBuf,
}

#[derive(Serialize)]
struct Written {
    file: String,
    ports: Vec<String>,
    cameras: Vec<String>,
}

impl Init {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let findings = findings()?;
        write_new(&self.out, commented(&findings).as_bytes())?;
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
            format!(
                "{} written ({}; {})\nfill in the plan and the optics, then `epirig doctor --rig {}` examines the rig\n",
                written.file,
                list(&written.ports, "serial port"),
                list(&written.cameras, "camera"),
                written.file
            )
        })
    }
}

fn findings() -> Result<Findings, CliError> {
    let ports = match ports() {
        Err(LinkError::NotBuilt { .. }) => Vec::new(),
        found => found?,
    };
    let cameras = match cameras() {
        Err(CameraError::NotBuilt { .. }) => Vec::new(),
        found => found?,
    };
    Ok(Findings {
        // Ports of the main board are there whether or not anything is connected to them.
        ports: ports.iter().filter(|port| port.usb.is_some()).map(port_choice).collect(),
        cameras: cameras.iter().map(found_camera).collect(),
    })
}

/// The name that stays the same when cables are moved, if there is one.
fn port_choice(port: &PortFacts) -> String {
    let serial_number = port.usb.as_ref().and_then(|usb| usb.serial_number.as_ref());
    serial_number.map_or_else(|| port.path.clone(), |serial_number| format!("usb:{serial_number}"))
}

fn found_camera(identity: &CameraIdentity) -> FoundCamera {
    let offered = V4l2Device::open(&identity.name()).and_then(|device| V4l2Camera::new(device).offered());
    // A camera that another program uses is there all the same.
    let formats = offered.unwrap_or_default();
    let known = formats.iter().filter(|format| PixelFormat::from_four_cc(format.four_cc).is_some());
    FoundCamera {
        choice: identity.links.first().cloned().unwrap_or_else(|| identity.name()),
        model: identity.model.clone(),
        formats: known.map(|format| format.four_cc.to_string()).collect(),
    }
}

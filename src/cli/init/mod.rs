//! `epirig init`.

mod questions;

use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::PossibleValuesParser;
use serde::Serialize;

use super::devices::{CAMERAS_AT, PORTS_AT, look_for_cameras, look_for_ports};
use super::files::write_new;
use super::progress::tell;
use super::rig::{LOCAL, named_profile, simulated_names};
use super::{CliError, Talk};
use crate::profile::{Draft, Findings, FoundCamera, commented};
use epirig_core::shell::quoted;
use epirig_devices::camera::pixels::PixelFormat;
use epirig_devices::camera::{CameraIdentity, open_camera};
use epirig_devices::link::PortFacts;
use questions::{ask, mistakes};

/// Write a rig profile: of connected devices, or of a simulated rig
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig init                     writes rig.toml here, which other commands then take
  epirig init --rig sim           the same for a simulated rig: no hardware needed
  epirig init --out lab/rig.toml
  epirig init --non-interactive   asks nothing

The connected USB serial port and camera are filled in, if there is exactly one of each. In a
terminal it asks for lens, steps and boards. All other keys are listed as comments with their
meaning. An existing file is refused.")]
pub(super) struct Init {
    /// The file to write
    #[arg(long, value_name = "FILE", default_value = LOCAL)]
    out: PathBuf,
    /// Write the whole profile of a simulated rig: sim, or real for one with the faults of real ones
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(simulated_names()))]
    rig: Option<String>,
    /// Ask nothing, also in a terminal
    #[arg(long)]
    non_interactive: bool,
}

#[derive(Serialize)]
struct Written {
    file: String,
    /// `None` if nobody looked for them.
    ports: Option<Vec<String>>,
    cameras: Option<Vec<String>>,
}

impl Init {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        if self.out.exists() {
            return Err(CliError::usage(format!(
                "{} exists already; give another name with --out",
                self.out.display()
            )));
        }
        match &self.rig {
            Some(name) => self.simulated(name, talk),
            None => self.connected(talk),
        }
    }

    /// Writes the profile of a simulated rig.
    fn simulated(&self, name: &str, talk: &Talk) -> Result<(), CliError> {
        let (text, source) = named_profile(Path::new(name))?;
        let nobody_looked = Findings::default();
        let draft = Draft::read(&text, &source, &[])?;
        write_new(&self.out, draft.commented(&nobody_looked).as_bytes())?;
        let written = Written { file: self.out.display().to_string(), ports: None, cameras: None };
        talk.result(&written, || {
            format!(
                "{} written: stage and camera are simulated\n`epirig doctor{1}` examines the rig, `epirig run{1} --out \
                 tile` measures\n",
                quoted(&self.out),
                self.named()
            )
        })
    }

    /// Writes a profile for the connected devices.
    fn connected(&self, talk: &Talk) -> Result<(), CliError> {
        let findings = findings()?;
        let mut draft = Draft::read(&commented(&findings), LOCAL, &[])?;
        if !self.non_interactive && std::io::stdin().is_terminal() {
            draft = ask(draft, &mut std::io::stdin().lock(), &mut |line| tell(line));
        }
        for mistake in mistakes(&draft) {
            talk.say(&format!("note: {mistake}"));
        }
        write_new(&self.out, draft.commented(&findings).as_bytes())?;
        let names = |cameras: Vec<FoundCamera>| cameras.into_iter().map(|camera| camera.choice).collect();
        let written = Written {
            file: self.out.display().to_string(),
            cameras: findings.cameras.map(names),
            ports: findings.ports,
        };
        talk.result(&written, || {
            let lacks_some = [&written.ports, &written.cameras].iter().any(|found| found.as_ref().is_none_or(Vec::is_empty));
            let simulate = if lacks_some {
                "without hardware: `epirig init --rig sim` writes a simulated rig, in another file or folder\n"
            } else {
                ""
            };
            format!(
                "{} written\n{}{}fill in what is missing of stage, camera, plan and optics; then `epirig doctor{}` examines the \
                 rig\n{simulate}",
                quoted(&self.out),
                found(written.ports.as_deref(), "USB serial port", PORTS_AT),
                found(written.cameras.as_deref(), "camera", CAMERAS_AT),
                self.named()
            )
        })
    }

    /// The option that names the file to other commands, if they need it.
    fn named(&self) -> String {
        if self.out == Path::new(LOCAL) { String::new() } else { format!(" --rig {}", quoted(&self.out)) }
    }
}

/// A line about devices: which were found, or where they were looked for.
fn found(names: Option<&[String]>, what: &str, at: &str) -> String {
    match names {
        None => format!("{what}: not looked for; this epirig has no driver for those of this system\n"),
        Some([]) => format!("{what}: none found in {at}\n"),
        Some(names) => format!("{what}: {}\n", names.join(", ")),
    }
}

fn findings() -> Result<Findings, CliError> {
    // Ports of the main board exist whether or not anything is connected to them.
    let of_usb =
        |ports: Vec<PortFacts>| ports.iter().filter(|port| port.usb.is_some()).map(port_choice).collect();
    let known =
        |cameras: Vec<CameraIdentity>| cameras.iter().map(|camera| found_camera(camera, &cameras)).collect();
    Ok(Findings { ports: look_for_ports()?.map(of_usb), cameras: look_for_cameras()?.map(known) })
}

/// A name that does not depend on the socket, if the port has one.
fn port_choice(port: &PortFacts) -> String {
    let serial_number = port.usb.as_ref().and_then(|usb| usb.serial_number.as_ref());
    serial_number.map_or_else(|| port.path.clone(), |serial_number| format!("usb:{serial_number}"))
}

fn found_camera(identity: &CameraIdentity, connected: &[CameraIdentity]) -> FoundCamera {
    let offered = open_camera(&identity.name()).and_then(|mut camera| camera.offered());
    // A camera that another program uses is listed too.
    let formats = offered.unwrap_or_default();
    let known = formats.iter().filter(|format| PixelFormat::from_four_cc(format.four_cc).is_some());
    FoundCamera {
        choice: identity.lasting_name(connected),
        model: identity.model.clone(),
        formats: known.map(|format| format.four_cc.to_string()).collect(),
    }
}

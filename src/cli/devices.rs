//! `epirig devices`.

use clap::Args;
use serde::Serialize;

use super::{CliError, Talk};
use epirig_devices::camera::pixels::PixelFormat;
use epirig_devices::camera::{
    CameraError, CameraIdentity, Control, Interval, OfferedFormat, Sizes, cameras, open_camera,
};
use epirig_devices::link::{LinkError, PortFacts, holder, ports};

/// List serial ports, and cameras with their formats and controls
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig devices
  epirig devices --json

Names in brackets can be given to --port and --camera. Nothing is sent to a stage, and no camera
setting is changed. Simulated devices need no list: --driver sim, --camera sim, --rig sim.")]
pub(super) struct Devices {}

/// Where serial ports are looked for.
pub(super) const PORTS_AT: &str = "/sys/class/tty";
/// Where cameras are looked for.
pub(super) const CAMERAS_AT: &str = "/dev/video* (V4L2)";

/// The serial ports; `None` if this system has none that epirig can drive.
pub(super) fn look_for_ports() -> Result<Option<Vec<PortFacts>>, CliError> {
    match ports() {
        Err(LinkError::NotOnThisSystem { .. }) => Ok(None),
        found => Ok(Some(found?)),
    }
}

/// The cameras; `None` if this system has none that epirig can drive.
pub(super) fn look_for_cameras() -> Result<Option<Vec<CameraIdentity>>, CliError> {
    match cameras() {
        Err(CameraError::NotOnThisSystem { .. }) => Ok(None),
        found => Ok(Some(found?)),
    }
}

#[derive(Serialize)]
struct Found {
    ports: Vec<Port>,
    /// `None` if nobody looked for them: there is no driver for cameras of this system.
    cameras: Option<Vec<CameraOutput>>,
}

#[derive(Serialize)]
struct Port {
    path: String,
    usb: Option<Usb>,
    /// Id of the process that uses it, if that is an epirig or the lock file names it.
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

#[derive(Serialize)]
struct CameraOutput {
    path: Option<String>,
    model: String,
    driver: String,
    bus: String,
    usb_serial_number: Option<String>,
    links: Vec<String>,
    formats: Vec<FormatOutput>,
    controls: Vec<Control>,
    /// Why formats and controls are not known.
    trouble: Option<String>,
}

#[derive(Serialize)]
struct FormatOutput {
    format: String,
    description: String,
    /// Whether epirig can decode this format.
    supported: bool,
    sizes: Vec<SizeOutput>,
}

#[derive(Serialize)]
struct SizeOutput {
    columns: usize,
    rows: usize,
    /// Set for a range of sizes: all from this one up to `columns` x `rows`, in steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    from: Option<(usize, usize)>,
    rates_hz: Vec<f64>,
}

impl Devices {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let (ports, cameras) = (look_for_ports()?, look_for_cameras()?);
        let mut text = String::new();
        let mut found = Found { ports: Vec::new(), cameras: cameras.as_ref().map(|_| Vec::new()) };
        for port in ports.iter().flatten() {
            let used_by = holder(&port.path);
            text += &port.to_string();
            if let Some(pid) = used_by {
                text += &format!(", in use by process {pid}");
            }
            text.push('\n');
            found.ports.push(port_output(port, used_by));
        }
        for identity in cameras.iter().flatten() {
            let (output, lines) = look_at(identity);
            text += &lines;
            found.cameras.get_or_insert_default().push(output);
        }
        for (what, count, at) in [
            ("serial port", ports.as_ref().map(Vec::len), PORTS_AT),
            ("camera", cameras.as_ref().map(Vec::len), CAMERAS_AT),
        ] {
            match count {
                None => {
                    talk.say(&format!("note: {what}s were not looked for; this epirig has no driver for those of this system"));
                }
                Some(0) => talk.say(&format!("no {what} found in {at}")),
                Some(_) => {}
            }
        }
        talk.say("simulated: --driver sim is a stage, --camera sim a camera, and --rig sim a whole rig");
        if text.is_empty() {
            return Err(LinkError::NoMatch {
                wanted: "a serial port or a camera".to_owned(),
                connected: "nothing".to_owned(),
            }
            .into());
        }
        talk.result(&found, || text)
    }
}

fn port_output(port: &PortFacts, used_by: Option<i32>) -> Port {
    let usb = port.usb.as_ref().map(|usb| Usb {
        vendor: format!("{:04x}", usb.vendor),
        product: format!("{:04x}", usb.product),
        serial_number: usb.serial_number.clone(),
        manufacturer: usb.manufacturer.clone(),
        name: usb.name.clone(),
    });
    Port { path: port.path.clone(), usb, used_by }
}

/// A camera as data and as text, with its formats and controls if it tells them.
fn look_at(identity: &CameraIdentity) -> (CameraOutput, String) {
    let ask = || -> Result<_, CameraError> {
        let mut camera = open_camera(&identity.name())?;
        Ok((camera.offered()?, camera.controls()?))
    };
    let mut text = format!("{identity}\n");
    let (formats, controls, trouble) = match ask() {
        Ok((formats, controls)) => (formats, controls, None),
        Err(error) => (Vec::new(), Vec::new(), Some(error.to_string())),
    };
    text.extend(trouble.iter().map(|trouble| format!("  {trouble}\n")));
    let (known, other): (Vec<_>, Vec<_>) =
        formats.iter().partition(|format| PixelFormat::from_four_cc(format.four_cc).is_some());
    for format in known {
        text += &format!("  format {:<7} {}\n", format.four_cc.to_string(), sizes(&format.sizes));
    }
    if !other.is_empty() {
        text += &format!("  and {} formats that epirig cannot decode\n", other.len());
    }
    text.extend(controls.iter().map(|control| format!("  control {control}\n")));
    let output = CameraOutput {
        path: identity.path.clone(),
        model: identity.model.clone(),
        driver: identity.driver.clone(),
        bus: identity.bus.clone(),
        usb_serial_number: identity.serial_number.clone(),
        links: identity.links.clone(),
        formats: formats.iter().map(format_output).collect(),
        controls,
        trouble,
    };
    (output, text)
}

fn sizes(sizes: &Sizes) -> String {
    match sizes {
        Sizes::Range { least, greatest, step } => {
            format!("{least} to {greatest} in steps of {} x {}", step.columns, step.rows)
        }
        Sizes::Discrete(sizes) => {
            let each = sizes.iter().map(|(size, intervals)| {
                let rates: Vec<String> =
                    intervals.iter().map(|interval| format!("{:.4}", interval.rate_hz())).collect();
                let rates = rates.iter().map(|rate| rate.trim_end_matches('0').trim_end_matches('.'));
                let rates = rates.collect::<Vec<_>>().join(", ");
                if rates.is_empty() { size.to_string() } else { format!("{size} ({rates} Hz)") }
            });
            each.collect::<Vec<_>>().join(", ")
        }
    }
}

fn format_output(format: &OfferedFormat) -> FormatOutput {
    let rates = |intervals: &[Interval]| {
        let rates = intervals.iter().map(|interval| interval.rate_hz());
        rates.filter(|rate| rate.is_finite()).collect::<Vec<f64>>()
    };
    let sizes = match &format.sizes {
        Sizes::Discrete(sizes) => {
            let each = sizes.iter().map(|(size, intervals)| SizeOutput {
                columns: size.columns,
                rows: size.rows,
                from: None,
                rates_hz: rates(intervals),
            });
            each.collect()
        }
        Sizes::Range { least, greatest, .. } => vec![SizeOutput {
            columns: greatest.columns,
            rows: greatest.rows,
            from: Some((least.columns, least.rows)),
            rates_hz: Vec::new(),
        }],
    };
    FormatOutput {
        format: format.four_cc.to_string(),
        description: format.description.clone(),
        supported: PixelFormat::from_four_cc(format.four_cc).is_some(),
        sizes,
    }
}

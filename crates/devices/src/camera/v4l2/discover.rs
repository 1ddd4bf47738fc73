//! The cameras of this machine.

use std::fs;
use std::path::{Path, PathBuf};

use v4l::v4l_sys::{V4L2_CAP_STREAMING, V4L2_CAP_VIDEO_CAPTURE};

use super::failure::unopened;
use super::kernel::{Capabilities, Node};
use crate::camera::{CameraError, CameraIdentity};

/// Folder in which the kernel lists video devices.
const CLASS: &str = "/sys/class/video4linux";
/// Folders of udev's stable names.
const LINKS: [&str; 2] = ["/dev/v4l/by-id", "/dev/v4l/by-path"];

/// The cameras of this machine, in the order of their numbers. Nodes without images are omitted. A node that
/// may not be opened is listed under its kernel name.
///
/// # Errors
/// None at present: a machine without cameras gives an empty list.
pub fn cameras() -> Result<Vec<CameraIdentity>, CameraError> {
    let mut numbers: Vec<u32> = fs::read_dir(CLASS)
        .into_iter()
        .flatten()
        .filter_map(|entry| entry.ok()?.file_name().to_str()?.strip_prefix("video")?.parse().ok())
        .collect();
    numbers.sort_unstable();
    Ok(numbers.into_iter().filter_map(|number| listed(&format!("/dev/video{number}"))).collect())
}

fn listed(path: &str) -> Option<CameraIdentity> {
    let opened = Node::open(path).map_err(unopened(path));
    match opened {
        Ok(node) => {
            let capabilities = node.capabilities().ok()?;
            is_camera(&capabilities).then(|| identity(path, Some(&capabilities)))
        }
        Err(CameraError::Permission { .. }) => Some(identity(path, None)),
        Err(_) => None,
    }
}

/// Whether a node gives images in a supported way.
pub(super) fn is_camera(capabilities: &Capabilities) -> bool {
    let needed = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    capabilities.flags & needed == needed
}

/// Identity of a node.
pub(super) fn identity(path: &str, capabilities: Option<&Capabilities>) -> CameraIdentity {
    let real = fs::canonicalize(path).unwrap_or_else(|_| PathBuf::from(path));
    let node = real.file_name().map_or_else(PathBuf::new, |name| Path::new(CLASS).join(name));
    let named = || {
        let name = fs::read_to_string(node.join("name")).unwrap_or_default();
        name.trim().to_owned()
    };
    CameraIdentity {
        driver: capabilities.map_or_else(String::new, |known| known.driver.clone()),
        model: capabilities.map_or_else(named, |known| known.card.clone()),
        bus: capabilities.map_or_else(String::new, |known| known.bus.clone()),
        path: Some(path.to_owned()),
        part: part(&node),
        usb_product: usb_product(&node),
        serial_number: usb_fact(&node, "serial"),
        links: links_to(&real),
    }
}

/// The part of its device that a node belongs to.
fn part(node: &Path) -> String {
    let device = fs::canonicalize(node.join("device")).unwrap_or_default();
    let folder = device.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let interface = folder.split_once(':').map_or("", |(_, interface)| interface).to_owned();
    let index = fs::read_to_string(node.join("index")).unwrap_or_default();
    format!("{interface}, {}", index.trim())
}

/// Vendor and product of a node's USB device.
fn usb_product(node: &Path) -> Option<String> {
    Some(format!("{}:{}", usb_fact(node, "idVendor")?, usb_fact(node, "idProduct")?))
}

/// What the kernel knows of a node's USB device.
fn usb_fact(node: &Path, file: &str) -> Option<String> {
    let device = fs::canonicalize(node.join("device")).ok()?;
    let usb = device.ancestors().find(|folder| folder.join("idVendor").exists())?;
    let text = fs::read_to_string(usb.join(file)).ok()?;
    Some(text.trim().to_owned()).filter(|text| !text.is_empty())
}

/// Names of by-id first: they do not depend on the socket.
fn links_to(real: &Path) -> Vec<String> {
    let leads_there =
        |entry: &fs::DirEntry| fs::canonicalize(entry.path()).is_ok_and(|target| target == real);
    let names = LINKS.iter().flat_map(|folder| {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten().filter(leads_there);
        let mut names: Vec<String> =
            entries.filter_map(|entry| entry.file_name().to_str().map(str::to_owned)).collect();
        names.sort();
        names
    });
    names.collect()
}

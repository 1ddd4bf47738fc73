//! A UVC camera played by threads of the tests, for the kernel's own `uvcvideo`: over USB/IP, without a
//! network. The tests own its pictures, the stage before it, and its faults.

#![allow(unreachable_pub, reason = "a module of a test program has no outside")]

mod controls;
mod descriptors;
mod device;
mod faults;
mod jpeg;
mod picture;
mod scene;
mod stream;
mod usbip;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

pub use controls::{EXPOSURE, EXPOSURE_DEFAULT, GAIN};
pub use descriptors::Model;
pub use faults::Faults;
pub use picture::{Format, Stamp, decoded, grey};
pub use scene::{Renderer, Scene};

use device::Device;

/// Of what the kernel does by itself.
const LIMIT: Duration = Duration::from_secs(15);
const NODES: &str = "/sys/class/video4linux";
const LINKS: &str = "/dev/v4l/by-id";

/// The camera, plugged in or not.
pub struct UvcCamera {
    /// Number of the controller's socket, from 0.
    port: u32,
    model: Model,
    scene: Scene,
    /// Pictures show the settings of this number of frames before.
    delay: usize,
    /// From the start of an exposure to the first byte on the wire.
    lag: Duration,
    plugged: Option<(Arc<Device>, Vec<JoinHandle<()>>)>,
}

impl UvcCamera {
    /// A camera, plugged in.
    pub fn new(port: u32, model: Model, scene: Scene, delay: usize, lag: Duration) -> Self {
        let mut camera = Self { port, model, scene, delay, lag, plugged: None };
        camera.plug_in();
        camera
    }

    /// Its name in /dev/v4l/by-id, as udev forms it.
    pub fn link(&self) -> String {
        format!("usb-Virtual_UVC_camera_{}-video-index0", self.model.serial_number)
    }

    /// Plugs it in, and waits for its node. It has forgotten all settings.
    pub fn plug_in(&mut self) {
        assert!(self.plugged.is_none(), "it is plugged in");
        let wire = usbip::plug(self.port).unwrap();
        let (model, scene) = (self.model.clone(), self.scene.clone());
        let device = Arc::new(Device::new(model, scene, self.delay, self.lag, wire.try_clone().unwrap()));
        let (answers, films) = (Arc::clone(&device), Arc::clone(&device));
        let threads =
            vec![std::thread::spawn(move || answers.answer(wire)), std::thread::spawn(move || films.film())];
        self.plugged = Some((device, threads));
        let node = wait_for("the node of the UVC camera", || self.node());
        // udev, which is not in the guest, keeps a link to it.
        let (link, name) = (Path::new(LINKS).join(self.link()), node.file_name().unwrap());
        let _ = std::fs::remove_file(&link);
        std::os::unix::fs::symlink(Path::new("../..").join(name), link).unwrap();
    }

    /// Pulls the plug, and waits until the kernel has noticed.
    pub fn unplug(&mut self) {
        let Some((_, threads)) = self.plugged.take() else { return };
        usbip::unplug(self.port).unwrap();
        threads.into_iter().for_each(|thread| thread.join().unwrap());
        wait_for("the end of the UVC camera's node", || self.node().is_none().then_some(()));
        let _ = std::fs::remove_file(Path::new(LINKS).join(self.link()));
    }

    /// Becomes another one of its model while it is not plugged in.
    pub fn exchange(&mut self, serial_number: &str) {
        assert!(self.plugged.is_none(), "it is plugged in");
        serial_number.clone_into(&mut self.model.serial_number);
    }

    /// Puts the plug, which is pulled, before another socket.
    pub fn move_to_socket(&mut self, port: u32) {
        assert!(self.plugged.is_none(), "it is plugged in");
        self.port = port;
    }

    /// The device file that gives its images, while it is plugged in.
    pub fn node(&self) -> Option<PathBuf> {
        let entries = std::fs::read_dir(NODES).into_iter().flatten().flatten();
        let nodes = entries.filter(|entry| {
            let socket = std::fs::canonicalize(entry.path().join("device/..")).unwrap_or_default();
            let socket = socket.to_string_lossy().into_owned();
            let index = std::fs::read_to_string(entry.path().join("index")).unwrap_or_default();
            // Index 1 is that of the metadata.
            socket.contains("/vhci_hcd.0/")
                && socket.ends_with(&format!("-{}", self.port + 1))
                && index.trim() == "0"
        });
        let paths = nodes.map(|entry| Path::new("/dev").join(entry.file_name()));
        paths.into_iter().find(|path| path.exists())
    }

    /// Changes what goes wrong from the next frame or request on.
    pub fn inject(&self, change: impl FnOnce(&mut Faults)) {
        if let Some((device, _)) = &self.plugged {
            change(&mut device.state().faults);
            device.changed.notify_all();
        }
    }

    /// What is still to go wrong.
    pub fn faults(&self) -> Faults {
        self.plugged.as_ref().map(|(device, _)| device.state().faults.clone()).unwrap_or_default()
    }
}

impl Drop for UvcCamera {
    fn drop(&mut self) {
        // A test that has failed leaves the guest to the next one.
        if !std::thread::panicking() {
            self.unplug();
        } else if let Some((_, threads)) = self.plugged.take() {
            let _ = usbip::unplug(self.port);
            threads.into_iter().for_each(|thread| drop(thread.join()));
        }
    }
}

/// Waits for what the kernel does by itself.
pub fn wait_for<T>(what: &str, mut there: impl FnMut() -> Option<T>) -> T {
    let began = Instant::now();
    loop {
        if let Some(found) = there() {
            return found;
        }
        assert!(began.elapsed() < LIMIT, "no {what} within {} s", LIMIT.as_secs());
        std::thread::sleep(Duration::from_millis(20));
    }
}

//! The virtual rig's guest with a UVC camera, behind the kernel's own `uvcvideo`. The test plays the stage,
//! too: its simulator stands before the camera, and every picture names where the stage was.

#![allow(unreachable_pub, reason = "a module of a test program has no outside")]

use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use epirig_core::frame::Frame;
use epirig_devices::camera::{Camera, CameraError, CameraSettings, Moment, Size, V4l2Camera, V4l2Device};
use epirig_devices::link::{LineNoise, PtyServer, serve};
use epirig_devices::stage::Stage;
use epirig_devices::stage::simulator::{FaultScript, NativeDevice};

use super::faults::{Bench, Fault};
use super::guest::{OTHER_END, Rig, SIZE, connect_stage};
use super::uvc::{EXPOSURE, Faults, Format, Model, Renderer, Scene, Stamp, UvcCamera, decoded, grey};

/// A picture shows the settings of two frames before, and its first byte comes 20 ms after its exposure
/// began: `uvcvideo` stamps it then, and calls that the start of the exposure.
pub const DELAY: usize = 2;
pub const LAG: Duration = Duration::from_millis(20);

pub const SERIAL_NUMBER: &str = "V0001";

/// How a camera is connected, and what it sends.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    pub format: Format,
    pub isochronous: bool,
}

impl Kind {
    pub fn bulk(format: Format) -> Self {
        Self { format, isochronous: false }
    }

    pub fn isochronous(format: Format) -> Self {
        Self { format, isochronous: true }
    }

    pub fn model(self, serial_number: &str) -> Model {
        // Small payloads for small pictures, so that a lost one is a part only.
        let payload = if self.format == Format::Mjpg { 1024 } else { 16 * 1024 };
        Model { isochronous: self.isochronous, serial_number: serial_number.to_owned(), payload }
    }
}

/// Stage and camera, played by this process.
pub struct UvcRig {
    pub camera: UvcCamera,
    pub scene: Scene,
    pub kind: Kind,
    /// The socket into which the camera is put back.
    pub back_in: u32,
    link: String,
    /// The device file of a camera that was pulled out, as a slow program holds it: the number is not free.
    held: Option<(PathBuf, File)>,
    // In the order in which they end.
    _stage: PtyServer,
    _renderer: Renderer,
}

impl UvcRig {
    pub fn start(kind: Kind) -> Self {
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap();
        // A board counts its starts; each rig is another one.
        let mut stage = NativeDevice::new(FaultScript::default()).at_boot(now.as_millis() as u32);
        let size: Size = SIZE.parse().unwrap();
        let (scene, renderer) = Scene::before(&mut stage, size);
        let served = serve(stage, &LineNoise::bad(1, 0.0), Path::new(OTHER_END)).unwrap();
        let camera = UvcCamera::new(0, kind.model(SERIAL_NUMBER), scene.clone(), DELAY, LAG);
        Self {
            link: camera.link(),
            held: None,
            back_in: 0,
            camera,
            scene,
            kind,
            _stage: served,
            _renderer: renderer,
        }
    }

    /// Plugs a camera of another kind in, in place of the former.
    pub fn change_camera(&mut self, kind: Kind) {
        self.camera.unplug();
        self.camera = UvcCamera::new(0, kind.model(SERIAL_NUMBER), self.scene.clone(), DELAY, LAG);
        self.kind = kind;
    }

    /// What the picture says of itself, if it is one of the camera's, to the sample.
    pub fn stamp(&self, frame: &Frame) -> Option<Stamp> {
        let stamp = Stamp::of(frame, self.kind.format)?;
        let scene = self.scene.at(stamp.steps?.into());
        let again = grey(&scene, frame.columns(), stamp, self.kind.format);
        (decoded(again, frame.columns(), self.kind.format) == *frame).then_some(stamp)
    }
}

impl Rig for UvcRig {
    fn camera(&self) -> &str {
        &self.link
    }

    fn format(&self) -> &str {
        self.kind.format.four_cc()
    }

    fn truth(&mut self, position_mm: f64) -> Frame {
        let levels = self.scene.at(steps_at(position_mm));
        decoded(levels.to_vec(), self.scene.size().columns, self.kind.format)
    }

    fn shows(&mut self, frame: &Frame, position_mm: f64) -> bool {
        let stamp = self.stamp(frame);
        stamp.and_then(|stamp| stamp.steps).is_some_and(|steps| i64::from(steps) == steps_at(position_mm))
    }

    fn taken(&self, frame: &Frame, about: Moment) -> Option<Moment> {
        let taken_us = self.stamp(frame)?.taken_us;
        let ahead_us = taken_us.wrapping_sub((about.as_ns() / 1000) as u32).cast_signed();
        let ahead = Duration::from_micros(ahead_us.unsigned_abs().into());
        Some(if ahead_us < 0 { about.before(ahead) } else { about.after(ahead) })
    }

    fn pull_camera_out(&mut self) {
        let node = self.camera.node().unwrap();
        self.held = Some((node.clone(), File::open(node).unwrap()));
        self.camera.unplug();
    }

    /// It comes back under another number.
    fn put_camera_back(&mut self) {
        self.camera.move_to_socket(self.back_in);
        self.camera.plug_in();
        let (before, _) = self.held.take().unwrap();
        assert_ne!(self.camera.node().unwrap(), before);
    }
}

/// The steps of the carriage at a position that is a whole number of them.
fn steps_at(position_mm: f64) -> i64 {
    let from_home = position_mm / NativeDevice::STEP_MM;
    let home = -NativeDevice::mm_from_home(0) / NativeDevice::STEP_MM;
    (home + from_home).round() as i64
}

pub struct UvcBench {
    pub rig: UvcRig,
    stage: Box<dyn Stage>,
    pub camera: V4l2Camera,
}

impl UvcBench {
    pub fn new(kind: Kind) -> Self {
        let rig = UvcRig::start(kind);
        let camera = opened(&rig);
        let mut stage = connect_stage();
        stage.home().unwrap();
        Self { rig, stage, camera }
    }

    /// With its camera configured and started.
    pub fn streaming(kind: Kind) -> Self {
        let mut bench = Self::new(kind);
        bench.begin();
        bench
    }

    /// Configures and starts the camera.
    pub fn begin(&mut self) {
        self.camera.configure(&self.settings()).unwrap();
        self.camera.start().unwrap();
    }

    /// Stage and camera at once.
    pub fn both(&mut self) -> (&mut dyn Stage, &mut V4l2Camera) {
        (&mut *self.stage, &mut self.camera)
    }

    /// Opens the camera, wherever it is now, and starts it.
    pub fn open_again(&mut self) {
        self.camera = opened(&self.rig);
        self.begin();
    }

    /// Pulls the camera's plug, which the driver notices, and puts it into another socket.
    pub fn move_to_socket(&mut self, port: u32) {
        self.rig.camera.unplug();
        let moment = self.camera.now();
        let error = self.camera.grab_after(moment).unwrap_err();
        assert!(matches!(error, CameraError::Gone { .. }), "{error:?}");
        self.rig.camera.move_to_socket(port);
        self.rig.camera.plug_in();
    }

    /// Goes on with a camera of another kind.
    pub fn change_camera(&mut self, kind: Kind) {
        self.camera.stop().unwrap();
        self.rig.change_camera(kind);
        self.camera = opened(&self.rig);
    }
}

fn opened(rig: &UvcRig) -> V4l2Camera {
    V4l2Camera::new(V4l2Device::open(rig.camera.node().unwrap().to_str().unwrap()).unwrap())
}

impl Bench for UvcBench {
    fn stage(&mut self) -> &mut dyn Stage {
        &mut *self.stage
    }

    fn camera(&mut self) -> &mut dyn Camera {
        &mut self.camera
    }

    fn settings(&self) -> CameraSettings {
        CameraSettings {
            four_cc: Some(self.rig.kind.format.four_cc().parse().unwrap()),
            size: Some(self.rig.scene.size()),
            controls: vec![("gain".to_owned(), "0".to_owned())],
            patience: Duration::from_secs(10),
            ..CameraSettings::default()
        }
    }

    fn truth(&mut self, position_mm: f64) -> Frame {
        self.rig.truth(position_mm)
    }

    fn shows(&mut self, frame: &Frame, position_mm: f64) -> bool {
        self.rig.shows(frame, position_mm)
    }

    fn has(&self, fault: Fault) -> bool {
        let Kind { format, isochronous } = self.rig.kind;
        match fault {
            Fault::ShortBuffer => format != Format::Mjpg,
            Fault::CompressedShort => format == Format::Mjpg,
            Fault::LostPacket => isochronous,
            Fault::Halt | Fault::Halts => !isochronous,
            Fault::ErrorFlag
            | Fault::FrameMarkMissing
            | Fault::FrameMarkInside
            | Fault::LongSilence
            | Fault::ControlStalled
            | Fault::ControlChanged
            | Fault::Disconnect
            | Fault::AnotherSocket
            | Fault::AnotherCamera => true,
            _ => false,
        }
    }

    fn inject(&mut self, fault: Fault) -> bool {
        let camera = &mut self.rig.camera;
        match fault {
            Fault::ErrorFlag => camera.inject(|faults| faults.error_bit = 1),
            Fault::ShortBuffer | Fault::CompressedShort => camera.inject(|faults| faults.short = 1),
            Fault::FrameMarkMissing => camera.inject(|faults| faults.same_fid = 1),
            Fault::FrameMarkInside => camera.inject(|faults| faults.split_fid = 1),
            Fault::LostPacket => camera.inject(|faults| faults.lost_packet = 1),
            Fault::Halt => camera.inject(|faults| faults.halt = 1),
            Fault::Halts => camera.inject(|faults| faults.halt = 5),
            Fault::LongSilence => camera.inject(|faults| faults.silent = true),
            Fault::ControlStalled => camera.inject(|faults| faults.stall = Some((EXPOSURE, 1))),
            Fault::Disconnect | Fault::AnotherSocket | Fault::AnotherCamera => camera.unplug(),
            Fault::ControlChanged => {
                let node = camera.node().unwrap();
                super::vivid_bench::v4l2_ctl(&["-d", node.to_str().unwrap(), "-c", "gain=50"]);
            }
            _ => return false,
        }
        true
    }

    fn bring_back(&mut self, fault: Fault) {
        if fault == Fault::AnotherCamera {
            self.rig.camera.exchange("V0002");
        }
        if fault == Fault::AnotherSocket {
            self.rig.camera.move_to_socket(1);
        }
        self.rig.camera.plug_in();
    }

    fn mend(&mut self, fault: Fault) {
        assert!(self.rig.camera.faults().are_spent(), "{fault:?} has not come to pass");
        self.rig.camera.inject(|faults| *faults = Faults::default());
        if fault == Fault::AnotherCamera {
            self.rig.camera.unplug();
            self.rig.camera.exchange(SERIAL_NUMBER);
            self.rig.camera.plug_in();
        }
        if fault == Fault::AnotherSocket {
            self.rig.camera.unplug();
            self.rig.camera.move_to_socket(0);
            self.rig.camera.plug_in();
        }
    }
}

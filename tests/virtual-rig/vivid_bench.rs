//! The virtual rig's guest as a bench for faults: vivid's capture side looped to its output, a stage behind a USB serial port.

#![allow(unreachable_pub, reason = "a module of test programs has no outside")]

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use epirig_core::frame::Frame;
use epirig_devices::camera::pixels::FourCc;
use epirig_devices::camera::{Camera, CameraSettings, FrameFacts, Size, V4l2Camera, V4l2Device};
use epirig_devices::link::{PortChoice, choose, ports};
use epirig_devices::stage::Stage;
use epirig_simulator::{Simulator, SimulatorConfig};

use super::faults::{Bench, Fault};
use super::guest::{OTHER_END, PORT, Rig, SIZE, connect_stage};

/// A name of the camera that stays the same.
pub const CAMERA: &str = "virtual-vivid-000-video-index0";
const CAMERA_PATH: &str = "/dev/v4l/by-id/virtual-vivid-000-video-index0";
const OUTPUT: &str = "/dev/video1";
/// Of what the guest's kernel does by itself.
const LIMIT: Duration = Duration::from_secs(10);

/// Runs `v4l2-ctl`, which must succeed.
pub fn v4l2_ctl(arguments: &[&str]) -> String {
    let output = Command::new("v4l2-ctl").args(arguments).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        output.status.success(),
        "v4l2-ctl {arguments:?}: {text}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    text
}

fn wait_for(what: &str, mut there: impl FnMut() -> bool) {
    let began = Instant::now();
    while !there() {
        assert!(began.elapsed() < LIMIT, "{what} within {} s", LIMIT.as_secs());
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// The timings that vivid has when it is new, 1280 x 720 at 60 Hz: what loops its output need not be first to set them.
const TIMINGS: &str = "--set-dv-bt-timings=index=7";

/// Loops vivid's output into its capture side.
fn loop_video() {
    v4l2_ctl(&["-d0", "-c", "loop_video=1,osd_text_mode=2"]);
    v4l2_ctl(&["-d0", TIMINGS]);
    v4l2_ctl(&["-d1", TIMINGS]);
}

/// The program's simulator, playing stage and world in a process of its own.
pub struct Playing {
    child: Child,
    simulator: Simulator,
    seen: Vec<(f64, Frame)>,
}

impl Playing {
    pub fn start() -> Self {
        loop_video();
        let arguments = ["simulate", "native", "--port", OTHER_END, "--video-output", OUTPUT, "--size", SIZE];
        let program = std::env::var_os("EPIRIG_PROGRAM").unwrap();
        let child = Command::new(program).args(arguments).stderr(Stdio::null()).spawn().unwrap();
        let size: Size = SIZE.parse().unwrap();
        let simulator = Simulator::new(SimulatorConfig::textured_plane(size.columns, size.rows, 2)).unwrap();
        Self { child, simulator, seen: Vec::new() }
    }
}

impl Rig for Playing {
    fn camera(&self) -> &str {
        CAMERA
    }

    fn format(&self) -> &str {
        "GREY"
    }

    fn truth(&mut self, position_mm: f64) -> Frame {
        if let Some((_, frame)) = self.seen.iter().find(|(position, _)| *position == position_mm) {
            return frame.clone();
        }
        let frame = self.simulator.expose(position_mm, 0);
        self.seen.push((position_mm, frame.clone()));
        frame
    }

    fn pull_camera_out(&mut self) {
        v4l2_ctl(&["-d0", "-c", "disconnect=1"]);
    }

    /// It comes back when everybody has let it go.
    fn put_camera_back(&mut self) {}
}

/// Takes the cameras of vivid away, or gives them back as they are when the guest starts.
pub fn plug_vivid(there: bool) {
    let file = Path::new("/sys/bus/platform/drivers/vivid").join(if there { "bind" } else { "unbind" });
    std::fs::write(file, "vivid.0").unwrap();
    wait_for("vivid comes or goes", || Path::new(OUTPUT).exists() == there);
}

impl Drop for Playing {
    fn drop(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

/// Takes the USB device of the serial port away, or gives it back, as far as drivers can tell.
pub fn plug_serial_port(there: bool) {
    let devices = std::fs::read_dir("/sys/bus/usb/devices").unwrap().map(|entry| entry.unwrap().path());
    let serial_number = |device: &Path| std::fs::read_to_string(device.join("serial")).unwrap_or_default();
    let device = devices.into_iter().find(|device| serial_number(device).trim() == "virtual-stage").unwrap();
    std::fs::write(device.join("authorized"), if there { "1" } else { "0" }).unwrap();
    // While a program still has the port that has gone, the new one gets another number.
    let choice: PortChoice = PORT.parse().unwrap();
    wait_for("the serial port comes or goes", || choose(&choice, &ports().unwrap()).is_ok() == there);
}

pub struct VividBench {
    stage: Option<Box<dyn Stage>>,
    camera: V4l2Camera,
    playing: Playing,
}

impl VividBench {
    pub fn new() -> Self {
        let playing = Playing::start();
        let camera = V4l2Camera::new(V4l2Device::open(CAMERA_PATH).unwrap());
        let mut bench = Self { stage: None, camera, playing };
        bench.reconnect_stage();
        bench.stage().home().unwrap();
        bench
    }

    /// With its camera configured and started.
    pub fn streaming() -> Self {
        let mut bench = Self::new();
        bench.camera.configure(&bench.settings()).unwrap();
        bench.camera.start().unwrap();
        bench
    }

    /// Moves, and takes a frame, which must be the simulator's for the place.
    pub fn move_and_see(&mut self, position_mm: f64) -> FrameFacts {
        self.stage().move_to(position_mm).unwrap();
        let moment = self.camera.now();
        let taken = self.camera.grab_after(moment).unwrap();
        assert!(taken.frame == self.truth(position_mm), "at {position_mm} mm: A WRONG FRAME");
        assert!(taken.facts.exposure_start >= moment);
        taken.facts
    }

    /// Connects to the stage anew.
    pub fn reconnect_stage(&mut self) {
        self.stage = None;
        self.stage = Some(connect_stage());
    }

    /// By another program, as faults come.
    fn press(&self, control: &str, value: &str) {
        v4l2_ctl(&["-d0", "-c", &format!("{control}={value}")]);
    }

    fn driver(&self, action: &str) {
        let file = Path::new("/sys/bus/platform/drivers/vivid").join(action);
        std::fs::write(file, "vivid.0").unwrap();
    }
}

impl Bench for VividBench {
    fn stage(&mut self) -> &mut dyn Stage {
        self.stage.as_deref_mut().unwrap()
    }

    fn camera(&mut self) -> &mut dyn Camera {
        &mut self.camera
    }

    fn settings(&self) -> CameraSettings {
        CameraSettings {
            four_cc: Some(FourCc(*b"GREY")),
            size: Some(SIZE.parse().unwrap()),
            patience: Duration::from_secs(10),
            ..CameraSettings::default()
        }
    }

    fn truth(&mut self, position_mm: f64) -> Frame {
        self.playing.truth(position_mm)
    }

    fn inject(&mut self, fault: Fault) -> bool {
        match fault {
            Fault::DroppedBuffers => self.press("percentage_of_dropped_buffers", "50"),
            Fault::ErrorFlag => self.press("inject_v4l2_buf_flag_error", "1"),
            Fault::QueueError => self.press("inject_vidioc_qbuf_error", "1"),
            Fault::RequestError => self.press("inject_vidioc_reqbufs_error", "1"),
            Fault::StartError => self.press("inject_vidioc_streamon_error", "1"),
            Fault::FatalError => self.press("inject_fatal_streaming_error", "1"),
            Fault::Disconnect => self.press("disconnect", "1"),
            Fault::UnbindAndBind => self.driver("unbind"),
            Fault::SequenceWrap => self.press("wrap_sequence_number", "1"),
            // Items of a menu: no signal, no lock, out of range, other timings.
            Fault::NoSignal => self.press("dv_timings_signal_mode", "1"),
            Fault::NoLock => self.press("dv_timings_signal_mode", "2"),
            Fault::TimingsOutOfRange => self.press("dv_timings_signal_mode", "3"),
            Fault::OtherTimings => self.press("dv_timings_signal_mode", "4"),
            Fault::InputSetOtherwise => {
                self.camera.stop().unwrap();
                v4l2_ctl(&["-d0", "--set-dv-bt-timings=index=0"]);
            }
            Fault::ControlChanged => self.press("brightness", "99"),
            Fault::StampsOfTheStart => self.press("timestamp_source", "1"),
            Fault::StampsOfTheEnd => self.press("timestamp_source", "0"),
            Fault::StampsOfAnotherClock => self.press("wrap_timestamp", "1"),
            _ => return false,
        }
        true
    }

    fn bring_back(&mut self, fault: Fault) {
        if fault == Fault::UnbindAndBind {
            // After binding, the device has its defaults, so its loop-back must be set again.
            self.driver("bind");
            wait_for("/dev/video0", || Path::new("/dev/video0").exists());
            wait_for("/dev/video1", || Path::new("/dev/video1").exists());
            loop_video();
        }
    }

    fn mend(&mut self, fault: Fault) {
        let set = |assignment: &str| {
            v4l2_ctl(&["-d0", "-c", assignment]);
        };
        match fault {
            Fault::DroppedBuffers => set("percentage_of_dropped_buffers=0"),
            Fault::SequenceWrap => set("wrap_sequence_number=0"),
            Fault::NoSignal | Fault::NoLock | Fault::TimingsOutOfRange | Fault::OtherTimings => {
                set("dv_timings_signal_mode=0");
            }
            Fault::InputSetOtherwise => {
                self.camera.stop().unwrap();
                v4l2_ctl(&["-d0", TIMINGS]);
            }
            Fault::StampsOfTheStart | Fault::StampsOfTheEnd => set("timestamp_source=0"),
            Fault::StampsOfAnotherClock => set("wrap_timestamp=0"),
            _ => {}
        }
    }
}

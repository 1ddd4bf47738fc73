//! The guest and the program in it: the rig's profile, the program as a user runs it, a scan that can be disturbed while it runs.

#![allow(unreachable_pub, reason = "a module of a test program has no outside")]

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output};
use std::time::{Duration, Instant};

use epirig_core::frame::Frame;
use epirig_data::sequence::{Event, RetakeRecord, Sequence, TimesRecord};
use epirig_devices::camera::Moment;
use epirig_devices::link::{PortChoice, choose, open, ports};
use epirig_devices::stage::native::{BAUD, NativeOptions};
use epirig_devices::stage::{NativeStage, Stage};
use firmware_protocol::message::Settings;

/// The stage's port, and the other end of its line.
pub const PORT: &str = "usb:virtual-stage";
pub const OTHER_END: &str = "/dev/ttyS1";
/// Small, because an emulated processor renders slowly.
pub const SIZE: &str = "160x120";

/// Where the first frame of the profile's plan is taken, the distance to the next, and how many there are: each a whole number of the stage's steps
/// of 4 um, so that the simulator stands exactly where the plan says.
pub const START_MM: f64 = 10.0;
pub const STEP_MM: f64 = 0.64;
pub const FRAMES: usize = 16;

/// What a person writes of a rig, but for its camera. Lens and distance are those of the simulator that the camera sees; velocity and
/// acceleration are above the stage's own, as an emulated processor is slow enough.
const PROFILE: &str = r#"
[stage]
port = "usb:virtual-stage"
velocity = "15 mm/s"
acceleration = "100 mm/s2"

[plan]
start = "10 mm"
step = "0.64 mm"
frames = 16
settle = "0 ms"

[optics]
focal_length = "320 px"
distance = "500 mm"
"#;

/// Time-out for all operations here: even on a slow machine only a hang takes longer.
const LIMIT: Duration = Duration::from_secs(240);

/// Whether this is the guest; says so if not.
pub fn here(name: &str) -> bool {
    let here = std::env::var_os("EPIRIG_VIRTUAL_RIG").is_some();
    if !here {
        println!(
            "SKIPPED {name}: it needs the virtual rig; tests/virtual-rig/run.sh boots it and runs this there"
        );
    }
    here
}

/// What run.sh looks for.
pub fn passed(name: &str) {
    println!("PASSED {name}");
}

fn command(arguments: &[&str]) -> Command {
    let program = std::env::var_os("EPIRIG_PROGRAM").unwrap_or_else(|| env!("CARGO_BIN_EXE_epirig").into());
    let mut command = Command::new(program);
    command.args(arguments);
    command
}

/// Runs the program and waits for it.
pub fn program(arguments: &[&str]) -> Output {
    command(arguments).output().unwrap()
}

/// Runs the program, which must succeed, and gives what it prints.
pub fn succeeds(arguments: &[&str]) -> String {
    let output = program(arguments);
    let talk = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {talk}");
    String::from_utf8(output.stdout).unwrap()
}

/// Runs a program of the guest's system, which must succeed.
pub fn system(arguments: &[&str]) {
    let status = Command::new(arguments[0]).args(&arguments[1..]).status().unwrap();
    assert!(status.success(), "{arguments:?}");
}

/// A rig that is played in the guest: what its camera is called, and what it must see.
pub trait Rig {
    /// The camera's lasting name.
    fn camera(&self) -> &str;
    /// Pixel format of the profile.
    fn format(&self) -> &str;
    /// What the camera must see with the stage at a position.
    fn truth(&mut self, position_mm: f64) -> Frame;
    /// Whether a frame is what the camera showed with the stage at a position, to the byte.
    fn shows(&mut self, frame: &Frame, position_mm: f64) -> bool {
        *frame == self.truth(position_mm)
    }
    /// When the exposure of a frame truly began, if the picture tells; `about` is at most half an hour off.
    fn taken(&self, _frame: &Frame, _about: Moment) -> Option<Moment> {
        None
    }
    /// Takes the camera away, as far as drivers can tell.
    fn pull_camera_out(&mut self);
    /// Gives it back; one that comes back by itself needs nothing.
    fn put_camera_back(&mut self);
}

/// Connects to the stage. It is faster than by default: many moves are tried.
pub fn connect_stage() -> Box<dyn Stage> {
    let choice: PortChoice = PORT.parse().unwrap();
    let settings = Settings {
        velocity_nm_s: 15_000_000,
        acceleration_nm_s2: 100_000_000,
        seek_velocity_nm_s: 15_000_000,
        touch_velocity_nm_s: 2_000_000,
        ..Settings::default()
    };
    let options = NativeOptions { settings: Some(settings) };
    let link = open(&choose(&choice, &ports().unwrap()).unwrap(), BAUD).unwrap();
    Box::new(NativeStage::connect(link, options).unwrap())
}

/// A folder with the profile, and a name in it for a sequence.
pub struct Workplace {
    folder: tempfile::TempDir,
}

impl Workplace {
    pub fn new(rig: &dyn Rig) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (device, format) = (rig.camera(), rig.format());
        let camera = format!("[camera]\ndevice = \"{device}\"\nformat = \"{format}\"\nsize = \"{SIZE}\"\n");
        std::fs::write(folder.path().join("rig.toml"), camera + PROFILE).unwrap();
        Self { folder }
    }

    pub fn path(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().unwrap().to_owned()
    }

    /// Begins to capture the profile's scan into `sequence`.
    pub fn capture(&self, sequence: &str) -> Scanning {
        let talk = self.path("talk");
        let arguments = ["capture", "--out", sequence, "--rig", &self.path("rig.toml")];
        let child = command(&arguments).stderr(File::create(&talk).unwrap()).spawn().unwrap();
        Scanning { child, sequence: sequence.into(), talk: talk.into() }
    }
}

/// A process that captures.
pub struct Scanning {
    child: Child,
    sequence: PathBuf,
    talk: PathBuf,
}

impl Scanning {
    fn talk(&self) -> String {
        std::fs::read_to_string(&self.talk).unwrap()
    }

    /// Returns when the journal has this number of frames or more.
    pub fn until(&mut self, frames: usize) {
        let began = Instant::now();
        let journal = self.sequence.join("journal.jsonl");
        let named = |text: String| text.matches("\"event\":\"frame\"").count();
        while std::fs::read_to_string(&journal).map_or(0, named) < frames {
            let ended = self.child.try_wait().unwrap();
            assert!(
                ended.is_none() && began.elapsed() < LIMIT,
                "no {frames} frames; {ended:?}: {}",
                self.talk()
            );
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// As Ctrl-C does.
    pub fn interrupt(&self) {
        system(&["kill", "-INT", &self.child.id().to_string()]);
    }

    /// As a power cut does, as far as the process is concerned.
    pub fn kill(mut self) {
        self.child.kill().unwrap();
        let status = self.child.wait().unwrap();
        assert_eq!(status.code(), None, "it had ended before it could be killed: {}", self.talk());
    }

    /// Waits for its end: the exit code, and what it has said.
    pub fn end(mut self) -> (i32, String) {
        let began = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return (status.code().unwrap(), self.talk());
            }
            assert!(began.elapsed() < LIMIT, "it hangs: {}", self.talk());
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

impl Drop for Scanning {
    fn drop(&mut self) {
        // A test that has failed leaves the rig to the next one.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The program finds the sequence in order, and its frames are those of the plan, each the simulator's to the byte, with its certificate.
pub fn assert_exact(sequence: &str, rig: &mut dyn Rig) -> Sequence {
    succeeds(&["verify", sequence]);
    let read = Sequence::open(Path::new(sequence)).unwrap();
    assert_eq!(read.frames().len(), FRAMES);
    for (index, record) in read.frames().iter().enumerate() {
        let position_mm = START_MM + index as f64 * STEP_MM;
        assert_eq!((record.index, record.commanded_mm), (index, Some(position_mm)));
        let frame = read.read(record).unwrap();
        assert!(rig.shows(&frame, position_mm), "frame {index}: A WRONG FRAME");
        let exposure = record.exposure.as_ref().unwrap();
        assert!(exposure.exposure_start_ns >= exposure.requested_ns, "frame {index}");
        if let Some(taken) = rig.taken(&frame, Moment::from_ns(exposure.requested_ns)) {
            // Whatever the driver's stamp says.
            assert!(taken.as_ns() / 1000 >= exposure.requested_ns / 1000, "frame {index} is old");
            assert!(
                exposure.exposure_start_ns <= taken.as_ns() + 1000,
                "frame {index}: not the earliest start"
            );
        }
        assert!(record.certificate.is_some(), "frame {index}");
    }
    if let Some(times) = read.stop().unwrap().times {
        tell(&times);
    }
    read
}

/// Where the time went.
fn tell(times: &TimesRecord) {
    println!(
        "the last part of the scan took {:.1} s: moving {:.1}, settling {:.1}, exposing {:.1}; overhead {:.3}",
        times.total_s,
        times.moving_s,
        times.settling_s,
        times.exposing_s,
        times.overhead().unwrap_or(f64::NAN)
    );
}

/// Attempts that failed.
pub fn retakes(sequence: &Sequence) -> Vec<&RetakeRecord> {
    let events = sequence.events().iter();
    events.filter_map(|event| if let Event::Retake(retake) = event { Some(retake) } else { None }).collect()
}

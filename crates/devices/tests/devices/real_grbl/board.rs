//! GRBL 1.1h in a simulated processor, with three carriages that count its step pulses.
//!
//! Neither the firmware nor the host of the simulation belongs to the project: without them the tests skip.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use epirig_devices::link::{Link, SerialLink};
use epirig_devices::stage::grbl::{AxisLetter, BAUD, GrblAxis, GrblOptions};
use epirig_devices::stage::{CheckedStage, StageError};
use serde_json::Value;

use crate::avr::Avr;

/// What the tests begin with; 50 mm/s at 100 steps/mm are 5000 pulses/s, which the simulation can tell apart.
const SETTINGS: [(u8, f64); 22] = [
    (1, 255.0),
    (10, 1.0),
    (20, 1.0),
    (21, 0.0),
    (22, 1.0),
    (23, 0.0),
    (24, 300.0),
    (25, 1500.0),
    (26, 25.0),
    (27, 1.0),
    (100, 100.0),
    (101, 100.0),
    (102, 100.0),
    (110, 3000.0),
    (111, 3000.0),
    (112, 3000.0),
    (120, 500.0),
    (121, 500.0),
    (122, 500.0),
    (130, 60.0),
    (131, 10.0),
    (132, 10.0),
];

const SOFT_RESET: u8 = 0x18;

/// Where the switch of the X axis closes, in steps.
pub(super) const SWITCH: i64 = 500;

/// The controller and its carriages.
pub(super) struct Board(Avr);

/// The firmware, and the host of the simulation, which is built once for each process.
fn built() -> &'static Result<(PathBuf, PathBuf), String> {
    static BUILT: OnceLock<Result<(PathBuf, PathBuf), String>> = OnceLock::new();
    BUILT.get_or_init(build)
}

fn build() -> Result<(PathBuf, PathBuf), String> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let folder = std::env::var_os("EPIRIG_GRBL")
        .map_or_else(|| root.join("../shared/virtual-hardware/grbl"), PathBuf::from);
    let firmware =
        std::env::var_os("EPIRIG_GRBL_ELF").map_or_else(|| folder.join("grbl-1.1h.elf"), PathBuf::from);
    let source = folder.join("simhost.c");
    if !firmware.exists() || !source.exists() {
        return Err(format!("there is no {} or no {}", firmware.display(), source.display()));
    }
    // A program that runs cannot be written, so each process has its own.
    let host = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("grbl-simhost-{}", std::process::id()));
    let mut compiler = Command::new("cc");
    compiler.args(["-O1", "-o"]).arg(&host).arg(source).args(["-lsimavr", "-lelf", "-lutil"]);
    match compiler.output() {
        Ok(output) if output.status.success() => Ok((firmware, host)),
        Ok(output) => Err(format!("its host does not build: {}", String::from_utf8_lossy(&output.stderr))),
        Err(error) => Err(format!("there is no C compiler: {error}")),
    }
}

/// A controller with the settings of the tests and `more`; `None`, loudly, where it cannot be built.
pub(super) fn board(more: &[(u8, f64)]) -> Option<Board> {
    let (firmware, host) = match built() {
        Ok(built) => built,
        Err(reason) => {
            assert!(std::env::var_os("EPIRIG_REQUIRE_GRBL").is_none(), "GRBL is required: {reason}");
            println!("SKIPPED: {reason}");
            return None;
        }
    };
    let mut board = Board(Avr::start(host, firmware));
    board.tell(&format!("sw x {SWITCH}"));
    board.tell("sw y 200");
    board.tell("sw z 200");
    let mut link = board.link();
    // It may have started before there was anyone to hear it.
    if !hears(&mut link, "Grbl", Duration::from_secs(2)) {
        link.send(&[SOFT_RESET]).unwrap();
        hear(&mut link, "Grbl");
    }
    while link.receive(&mut [0; 256], Duration::from_millis(200)).unwrap() > 0 {}
    // Its memory is empty.
    link.send(b"$RST=*\n").unwrap();
    hear(&mut link, "Grbl");
    for (number, value) in SETTINGS.iter().chain(more) {
        // Soft limits need homing, which comes later in the list.
        if *number == 20 {
            command(&mut link, "$22=1");
        }
        command(&mut link, &format!("${number}={value}"));
    }
    Some(board)
}

/// Hears lines until one contains `word`; `false` if none does in time.
fn hears(link: &mut SerialLink, word: &str, patience: Duration) -> bool {
    let (until, mut heard) = (Instant::now() + patience, String::new());
    while !heard.contains(word) && Instant::now() < until {
        let mut buffer = [0; 256];
        let count = link.receive(&mut buffer, Duration::from_millis(100)).unwrap();
        heard += &String::from_utf8_lossy(&buffer[..count]);
    }
    heard.contains(word)
}

fn hear(link: &mut SerialLink, word: &str) {
    assert!(hears(link, word, Duration::from_secs(5)), "no {word}");
}

fn command(link: &mut SerialLink, line: &str) {
    link.send(format!("{line}\n").as_bytes()).unwrap();
    hear(link, "ok");
}

impl Board {
    pub(super) fn tell(&mut self, order: &str) -> Value {
        let answer = self.0.tell(order);
        assert_eq!(answer["cmd"], order);
        answer
    }

    /// Where the carriage of an axis is, in steps.
    pub(super) fn carriage(&mut self, axis: usize) -> i64 {
        self.tell("pos")["pos"][axis].as_i64().unwrap()
    }

    /// Forgets how far the X carriage went.
    pub(super) fn forget_extremes(&mut self) {
        self.tell("peaks");
    }

    /// How far the X carriage went since, in steps.
    pub(super) fn extremes(&mut self) -> (i64, i64) {
        let answer = self.tell("pos");
        (answer["min_x"].as_i64().unwrap(), answer["peak_x"].as_i64().unwrap())
    }

    pub(super) fn link(&self) -> SerialLink {
        SerialLink::open(self.0.port(), BAUD).unwrap()
    }

    /// Puts a byte on the line, whoever uses it.
    pub(super) fn slip_in(&self, byte: u8) {
        std::fs::OpenOptions::new().write(true).open(self.0.port()).unwrap().write_all(&[byte]).unwrap();
    }

    /// Sends a line as another program does.
    pub(super) fn other_program(&self, line: &str) {
        command(&mut self.link(), line);
    }

    pub(super) fn connect_axis(&self, axis: AxisLetter) -> Result<CheckedStage<GrblAxis>, StageError> {
        let options = GrblOptions { axis, ..GrblOptions::default() };
        CheckedStage::<GrblAxis>::connect(Box::new(self.link()), options)
    }

    pub(super) fn connect_x(&self) -> Result<CheckedStage<GrblAxis>, StageError> {
        self.connect_axis(AxisLetter::X)
    }

    pub(super) fn connect(&self) -> CheckedStage<GrblAxis> {
        self.connect_x().unwrap()
    }
}

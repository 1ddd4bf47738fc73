//! The GRBL driver and firmware that is not GRBL 1.1 as built by its authors, in the words of that firmware.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use epirig_devices::link::{SimulatedDevice, SimulatedLink};
use epirig_devices::stage::grbl::GrblOptions;
use epirig_devices::stage::simulator::GrblDevice;
use epirig_devices::stage::{GrblStage, Stage, StageError};

fn connect(device: impl SimulatedDevice + 'static) -> Result<GrblStage, StageError> {
    GrblStage::connect(Box::new(SimulatedLink::new(device)), GrblOptions::default())
}

/// Answers a query of the status, and every line with the same words. It remembers what it was sent.
#[derive(Clone)]
struct Parrot {
    boot: &'static str,
    status: &'static str,
    answer: &'static str,
    said: String,
    received: Arc<Mutex<Vec<u8>>>,
}

impl Parrot {
    fn new(boot: &'static str, status: &'static str, answer: &'static str) -> Self {
        Self { boot, status, answer, said: String::new(), received: Arc::default() }
    }
}

impl SimulatedDevice for Parrot {
    fn receive(&mut self, byte: u8) {
        self.received.lock().unwrap().push(byte);
        match byte {
            b'?' => self.said += self.status,
            b'\n' => self.said += self.answer,
            0x18 => self.said += self.boot,
            _ => {}
        }
    }

    fn advance(&mut self, _: Duration) {}

    fn take_sent(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.said).into_bytes()
    }
}

/// `report.c` of GRBL 0.9j prints these, by the mask `$10`; 0.8 had the state `Queue`, too.
#[test]
fn grbl_before_1_1_is_named_at_once_and_sent_no_line() {
    for status in [
        "<Idle,MPos:0.000,0.000,0.000,WPos:0.000,0.000,0.000>\r\n",
        "<Run,MPos:-1.250,0.000,0.000,WPos:-1.250,0.000,0.000,Buf:1,RX:0>\r\n",
        "<Hold,WPos:0.000,0.000,0.000>\r\n",
        "<Alarm,MPos:0.000,0.000,0.000,WPos:0.000,0.000,0.000>\r\n",
        "<Queue,MPos:0.000,0.000,0.000>\r\n",
        "<Idle>\r\n",
    ] {
        let device = Parrot::new("\r\nGrbl 0.9j ['$' for help]\r\n", status, "error: Not idle\r\n");
        let error = connect(device.clone()).err().unwrap().to_string();
        assert_eq!(
            error,
            format!(
                "simulated port answers, but not as a grbl stage: it says \"{}\", as GRBL until 0.9 did; \
                 GRBL 1.1 is needed: update its firmware",
                status.trim()
            )
        );
        assert_eq!(*device.received.lock().unwrap(), b"?", "{status}");
    }
    // Locked after a limit, it is silent until it is reset.
    let device = Parrot::new("\r\nGrbl 0.9j ['$' for help]\r\n", "", "");
    let error = connect(device.clone()).err().unwrap().to_string();
    assert!(error.contains("its version is 0.9j; GRBL 1.1 is needed"), "{error}");
    assert!(device.received.lock().unwrap().iter().all(|byte| matches!(byte, b'?' | 0x18)));
}

/// FluidNC keeps its settings in a file, and `$$` shows few of them.
#[test]
fn a_firmware_without_the_settings_of_grbl_is_refused() {
    let device = Parrot::new(
        "\r\nGrbl 3.7 [FluidNC 3.7.10 (wifi) '$' for help]\r\n",
        "<Idle|MPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000>\r\n",
        "$10=1\r\n$30=1000.000\r\nok\r\n",
    );
    let error = connect(device.clone()).err().unwrap().to_string();
    assert!(error.contains("it does not report its setting $22; GRBL 1.1 does"), "{error}");
    assert!(!device.received.lock().unwrap().contains(&b'='), "nothing was set");
}

/// Rewrites what the simulator says.
struct Dialect {
    device: Arc<Mutex<GrblDevice>>,
    line: Vec<u8>,
    rewrite: fn(&str) -> String,
}

impl SimulatedDevice for Dialect {
    fn receive(&mut self, byte: u8) {
        self.device.receive(byte);
    }

    fn advance(&mut self, time: Duration) {
        self.device.advance(time);
    }

    fn take_sent(&mut self) -> Vec<u8> {
        let mut said = Vec::new();
        for byte in self.device.take_sent() {
            self.line.push(byte);
            if byte == b'\n' {
                let line = String::from_utf8(std::mem::take(&mut self.line)).unwrap();
                said.extend(format!("{}\r\n", (self.rewrite)(line.trim_end())).bytes());
            }
        }
        said
    }
}

/// As grblHAL says it: more fields, modes and settings, and numbers above 255.
fn grbl_hal(line: &str) -> String {
    if line.starts_with("Grbl ") {
        "GrblHAL 1.1f ['$' or '$HELP' for help]".to_owned()
    } else if let Some(status) = line.strip_prefix('<') {
        format!("<{}", status.replace("|FS:", "|Bf:35,1023|FS:").replace('>', "|FW:grblHAL>"))
    } else if line.starts_with("[GC:") {
        line.replace(" G94 ", " G94 G49 G98 G50 ").replace(" S0]", " S0.]")
    } else if line.starts_with("$0=") {
        format!("{line}.0")
    } else if line.starts_with("$132=") {
        format!("{line}\r\n$341=0\r\n$370=1\r\n$384=0")
    } else {
        line.to_owned()
    }
}

/// With the words that GRBL 0.9 put after its settings.
fn explained(line: &str) -> String {
    if line.starts_with('$') { format!("{line} (homing cycle, bool)") } else { line.to_owned() }
}

/// A banner that does not begin with the name.
fn renamed(line: &str) -> String {
    line.replace("Grbl 1.1h ['$' for help]", "MyBoard, based on Grbl 1.1h")
}

#[test]
fn other_words_for_the_same_change_nothing() {
    for rewrite in [grbl_hal, explained, renamed] {
        let device = Arc::new(Mutex::new(GrblDevice::default()));
        let plant = device.lock().unwrap().plant();
        let dialect = || Dialect { device: Arc::clone(&device), line: Vec::new(), rewrite };
        let mut stage = connect(dialect()).unwrap();
        stage.home().unwrap();
        let home = plant.carriage_steps();
        for index in 1..=10_i64 {
            stage.move_to(1.5 * index as f64).unwrap();
            assert_eq!(home - plant.carriage_steps(), index * 375);
        }
        drop(stage);
        assert_eq!(connect(dialect()).unwrap().position_mm(), Ok(15.0));
    }
}

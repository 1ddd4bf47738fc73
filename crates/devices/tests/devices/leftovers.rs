//! Lines that still hold answers to a former process when a program opens them.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use epirig_devices::link::{SimulatedDevice, SimulatedLink};
use epirig_devices::stage::native::NativeOptions;
use epirig_devices::stage::simulator::{NativeDevice, ZaberDevice};
use epirig_devices::stage::zaber::ZaberOptions;
use epirig_devices::stage::{NativeStage, Stage, ZaberStage};
use firmware_protocol::frame::{Direction, encode};
use firmware_protocol::message::{PROTOCOL_VERSION, Request};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A device that hung while a former process asked, and answers now: after a while, and before anything else.
struct Hung<D> {
    device: Arc<Mutex<D>>,
    leftovers: Vec<u8>,
    goes_on_in: Duration,
    held: Vec<u8>,
}

impl<D: SimulatedDevice> SimulatedDevice for Hung<D> {
    fn receive(&mut self, byte: u8) {
        self.device.receive(byte);
    }

    fn advance(&mut self, time: Duration) {
        self.device.advance(time);
        self.goes_on_in = self.goes_on_in.saturating_sub(time);
    }

    fn take_sent(&mut self) -> Vec<u8> {
        self.held.extend(self.device.take_sent());
        if !self.goes_on_in.is_zero() {
            return Vec::new();
        }
        let mut sent = std::mem::take(&mut self.leftovers);
        sent.append(&mut self.held);
        sent
    }
}

/// What the device answers to these bytes, which no one reads.
fn answers<D: SimulatedDevice>(device: &Arc<Mutex<D>>, questions: &[Vec<u8>]) -> Vec<u8> {
    let mut device = device.lock().unwrap();
    let mut answers = device.take_sent();
    for question in questions {
        question.iter().for_each(|byte| device.receive(*byte));
        device.advance(Duration::from_millis(1));
        answers.extend(device.take_sent());
    }
    answers
}

/// A thousand sessions, each of which finds answers about where the stage was before. `questions` are those of a process
/// with the given number.
fn sessions<D: SimulatedDevice + 'static>(
    device: D,
    step_mm: f64,
    connect: fn(SimulatedLink<Hung<D>>) -> Box<dyn Stage>,
    questions: fn(u64) -> Vec<Vec<u8>>,
) {
    let device = Arc::new(Mutex::new(device));
    let mut random = ChaCha8Rng::seed_from_u64(17);
    let (mut leftovers, mut truth_mm) = (Vec::new(), None);
    for session in 0..1000 {
        let hung = Hung {
            device: Arc::clone(&device),
            leftovers,
            goes_on_in: Duration::from_millis(random.random_range(0..200)),
            held: Vec::new(),
        };
        let number = random.random_range(0..u64::MAX);
        let mut stage = connect(SimulatedLink::new(hung).in_session(number));
        match truth_mm {
            None => stage.home().unwrap(),
            Some(truth_mm) => assert_eq!(stage.position_mm(), Ok(truth_mm), "session {session}"),
        }
        // The former process may have had any number, and many of its questions may be unanswered.
        leftovers = answers(&device, &questions(random.random_range(0..u64::MAX)));
        let target_mm = random.random_range(0..2000_u32) as f64 * step_mm;
        stage.move_to(target_mm).unwrap();
        truth_mm = Some(stage.position_mm().unwrap());
        assert!((truth_mm.unwrap() - target_mm).abs() < 1e-6, "session {session}");
    }
}

#[test]
fn answers_to_a_former_process_are_not_believed_by_zaber() {
    let connect = |link: SimulatedLink<Hung<ZaberDevice>>| -> Box<dyn Stage> {
        let options = ZaberOptions { device: 1, microstep_um: ZaberDevice::MICROSTEP_UM };
        Box::new(ZaberStage::connect(Box::new(link), options).unwrap())
    };
    sessions(ZaberDevice::default(), ZaberDevice::MICROSTEP_UM / 1000.0, connect, |number| {
        let words = ["set comm.checksum 1", "get pos", "get limit.max", "get pos", ""];
        let question = |index: u64| {
            let id = (number % 99 + index) % 99 + 1;
            format!("/1 1 {id} {}\n", words[(index % 5) as usize]).into_bytes()
        };
        // Enough for each id, twice.
        (0..200).map(question).collect()
    });
}

#[test]
fn answers_to_a_former_process_are_not_believed_by_native() {
    let connect = |link: SimulatedLink<Hung<NativeDevice>>| -> Box<dyn Stage> {
        Box::new(NativeStage::connect(Box::new(link), NativeOptions::default()).unwrap())
    };
    sessions(NativeDevice::default(), NativeDevice::STEP_MM, connect, |number| {
        let requests = [
            Request::Hello { version: PROTOCOL_VERSION },
            Request::Status,
            Request::ReadSettings,
            Request::Status,
        ];
        let question = |index: u64| {
            let sequence = ((number % 128 + index) % 128) as u8;
            encode(Direction::Request, sequence, &requests[(index % 4) as usize]).unwrap().bytes().to_vec()
        };
        (0..24).map(question).collect()
    });
}

//! Every exchange can be recorded, and a recording is a stage again.

use std::io::Write;
use std::sync::{Arc, Mutex};

use epirig_devices::link::{Link, LinkError, Recorder, Replay, SimulatedDevice, SimulatedLink, Transcript};
use epirig_devices::stage::grbl::GrblOptions;
use epirig_devices::stage::native::NativeOptions;
use epirig_devices::stage::simulator::{GrblDevice, NativeDevice, ZaberDevice};
use epirig_devices::stage::zaber::ZaberOptions;
use epirig_devices::stage::{GrblStage, NativeStage, Stage, StageError, ZaberStage};

/// Recorded from the Uno firmware, running in a simulated processor, with `epirig stage move 1.5 --home --transcript FILE`.
const UNO_SESSION: &str = include_str!("data/native-uno-session.txt");

#[derive(Clone, Default)]
struct Paper(Arc<Mutex<Vec<u8>>>);

impl Write for Paper {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

type Connect = fn(Box<dyn Link>) -> Result<Box<dyn Stage>, StageError>;

fn native(link: Box<dyn Link>) -> Result<Box<dyn Stage>, StageError> {
    Ok(Box::new(NativeStage::connect(link, NativeOptions::default())?))
}

fn grbl(link: Box<dyn Link>) -> Result<Box<dyn Stage>, StageError> {
    Ok(Box::new(GrblStage::connect(link, GrblOptions::default())?))
}

fn zaber(link: Box<dyn Link>) -> Result<Box<dyn Stage>, StageError> {
    let microstep_um = ZaberDevice::MICROSTEP_UM;
    let options = ZaberOptions { device: 1, microstep_um };
    Ok(Box::new(ZaberStage::connect(link, options)?))
}

fn session(stage: &mut dyn Stage) -> Vec<f64> {
    stage.home().unwrap();
    [1.5, 3.0, 0.75]
        .map(|position_mm| {
            stage.move_to(position_mm).unwrap();
            stage.position_mm().unwrap()
        })
        .to_vec()
}

fn record_and_replay(device: impl SimulatedDevice + 'static, dialect: &str, connect: Connect) {
    let paper = Paper::default();
    let recorder = Recorder::new(Box::new(SimulatedLink::new(device)), paper.clone(), dialect).unwrap();
    let recorded = session(&mut *connect(Box::new(recorder)).unwrap());
    let text = String::from_utf8(paper.0.lock().unwrap().clone()).unwrap();
    let transcript = Transcript::parse(&text).unwrap();
    assert_eq!(transcript.heading.dialect, dialect);
    let replayed = session(&mut *connect(Box::new(Replay::new(transcript.clone()))).unwrap());
    assert_eq!(recorded, replayed);

    // Who asks for something else is told so, and gets no made-up answer.
    let mut stage = connect(Box::new(Replay::new(transcript))).unwrap();
    stage.home().unwrap();
    let error = stage.move_to(9.0).unwrap_err();
    assert!(matches!(error, StageError::Link(LinkError::Diverged { .. })), "{error}");
}

#[test]
fn a_recording_of_each_dialect_is_a_stage_again() {
    record_and_replay(NativeDevice::default(), "native", native);
    record_and_replay(GrblDevice::default(), "grbl", grbl);
    record_and_replay(ZaberDevice::default(), "zaber", zaber);
}

#[test]
fn a_recording_of_the_firmware_is_a_stage_again() {
    let mut stage = native(Box::new(Replay::new(Transcript::parse(UNO_SESSION).unwrap()))).unwrap();
    assert!(
        stage.identity().to_string().starts_with("epirig stage, protocol 1, build 1, 250 steps/mm, 200 mm")
    );
    stage.home().unwrap();
    stage.move_to(1.5).unwrap();
    assert_eq!(stage.position_mm(), Ok(1.5));
}

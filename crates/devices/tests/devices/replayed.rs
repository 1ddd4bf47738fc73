//! What a replayed sequence shows to a person and to an onlooker.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use crate::onlooking::Window;
use epirig_core::frame::Frame;
use epirig_data::sequence::{ExitStatus, FrameFacts, Origin, SequenceRecord, SequenceWriter, StopFacts};
use epirig_devices::camera::{Camera, CameraError, ReplayCamera};
use epirig_simulator::{Simulator, SimulatorConfig};

/// A small sequence, and its frames.
fn write_sequence(folder: &Path) -> Vec<Frame> {
    let simulator = Simulator::new(SimulatorConfig::textured_plane(64, 48, 4)).unwrap();
    let positions_mm = simulator.config().scan.positions_mm();
    let frames: Vec<Frame> = positions_mm.iter().map(|at_mm| simulator.expose(*at_mm, 0)).collect();
    let origin = Origin::Captured {
        stage_settings: Default::default(),
        stage: "simulator".to_owned(),
        camera: "simulator".to_owned(),
        configuration: None,
        limits: None,
        rig: None,
        simulator: None,
    };
    let bit_depth = simulator.config().sensor.bit_depth;
    let record = SequenceRecord {
        positions_mm: Some(positions_mm.clone()),
        ..SequenceRecord::new(origin, (48, 64), bit_depth, frames.len())
    };
    let mut writer = SequenceWriter::create(folder, &record).unwrap();
    for (frame, at_mm) in frames.iter().zip(positions_mm) {
        let at = Some(at_mm);
        let facts = FrameFacts { commanded_mm: at, reported_mm: at, ..FrameFacts::default() };
        writer.add(frame, facts).unwrap();
    }
    writer.finish(ExitStatus::Complete, StopFacts::default()).unwrap();
    frames
}

#[test]
fn a_replay_shows_the_frame_of_the_present_stop() {
    let folder = tempfile::tempdir().unwrap();
    let frames = write_sequence(&folder.path().join("seq"));
    let mut camera: Box<dyn Camera> = Box::new(ReplayCamera::open(&folder.path().join("seq")).unwrap());
    let look = |camera: &mut Box<dyn Camera>| camera.look(Duration::ZERO).unwrap().unwrap();
    assert!(look(&mut camera) == frames[0]);
    camera.start().unwrap();
    for (stop, truth) in frames.iter().enumerate().skip(1) {
        camera.at_stop(stop);
        assert!(look(&mut camera) == *truth && look(&mut camera) == *truth);
        let moment = camera.now();
        assert!(matches!(camera.grab_after(moment), Err(CameraError::NotStarted { .. })));
        camera.start().unwrap();
        assert!(camera.grab_after(moment).unwrap().frame == *truth);
        assert!(look(&mut camera) == *truth);
    }
}

#[test]
fn a_replay_shows_what_it_gives() {
    let folder = tempfile::tempdir().unwrap();
    let frames = write_sequence(&folder.path().join("seq"));
    let mut camera: Box<dyn Camera> = Box::new(ReplayCamera::open(&folder.path().join("seq")).unwrap());
    let window = Arc::new(Window::default());
    camera.show_to(Some(window.clone()));
    camera.start().unwrap();
    for (stop, wanted) in [(0, true), (1, false), (2, true)] {
        window.want(wanted);
        camera.at_stop(stop);
        let moment = camera.now();
        camera.grab_after(moment).unwrap();
    }
    assert!(window.seen() == [frames[0].clone(), frames[2].clone()]);
    camera.show_to(None);
    let moment = camera.now();
    camera.grab_after(moment).unwrap();
    assert_eq!(window.seen().len(), 2);
}

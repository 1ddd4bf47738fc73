//! Whatever goes wrong with a camera ends with the right frame or with an error that says what it was: never with a wrong frame, and
//! never late. Here with the simulated camera; tests/virtual_rig.rs does the same with a real driver.

use std::sync::Arc;
use std::time::Duration;

use crate::faults::{FAULTS, Fault, outcome};
use crate::sim_bench::SimBench;
use epirig_devices::camera::{
    Camera, CameraError, CameraSettings, FrameFacts, SimCamera, SimFault, TimingRule,
};
use epirig_devices::stage::{SimStage, SimStageConfig, Stage, StagePosition};
use epirig_simulator::{Simulator, SimulatorConfig};

/// The counts of a grab after a fault and a move.
fn facts_after(fault: SimFault) -> FrameFacts {
    let simulator = Arc::new(Simulator::new(SimulatorConfig::textured_plane(160, 120, 2)).unwrap());
    let mut stage = SimStage::new(SimStageConfig::ideal(100.0));
    stage.home().unwrap();
    let mut camera = SimCamera::before_simulator(Arc::clone(&simulator), stage.watch());
    camera.configure(&CameraSettings::default()).unwrap();
    camera.start().unwrap();
    stage.move_to(12.0).unwrap();
    let moment = camera.now();
    let first = camera.grab_after(moment).unwrap();
    assert!(first.facts.stale >= 4, "all buffers were filled while the stage moved");
    camera.device().inject(fault);
    let taken = camera.grab_after(moment).unwrap();
    assert!(taken.frame == simulator.expose(12.0, 0), "{fault:?}: A WRONG FRAME");
    taken.facts
}

#[test]
fn each_fault_is_noticed_for_what_it_is() {
    assert_eq!(facts_after(SimFault::BufferError).damaged, 1);
    assert_eq!(facts_after(SimFault::ShortBuffer).damaged, 1);
    assert!(facts_after(SimFault::TornFrame).unsteady >= 1);
    assert!(facts_after(SimFault::LateContents).unsteady >= 1);
    assert_eq!(facts_after(SimFault::QueueError).restarts, 1);
    assert_eq!(facts_after(SimFault::FatalError).restarts, 1);
    assert_eq!(facts_after(SimFault::GainDrifts).restarts, 1);
    assert!(facts_after(SimFault::Gap(3)).missed >= 3);
    // Buffers that were given back empty tell nothing about time and count.
    let halted = facts_after(SimFault::Halt);
    assert_eq!((halted.timing, halted.missed, halted.restarts), (TimingRule::StartOfExposure, 0, 0));
    assert!(halted.damaged >= 1);
    assert_eq!(facts_after(SimFault::Unheard).restarts, 1);
    let quiet = facts_after(SimFault::NoSignal(false));
    assert_eq!((quiet.damaged, quiet.unsteady, quiet.restarts), (0, 0, 0));
}

#[test]
fn a_control_set_by_hand_counts_from_the_next_frame_on() {
    let simulator = Arc::new(Simulator::new(SimulatorConfig::textured_plane(160, 120, 2)).unwrap());
    let mut camera = SimCamera::before_simulator(Arc::clone(&simulator), StagePosition::default());
    camera.device().inject(SimFault::LateControls(6));
    camera.configure(&CameraSettings::default()).unwrap();
    camera.start().unwrap();
    let mean = |camera: &mut SimCamera| {
        let moment = camera.now();
        let taken = camera.grab_after(moment).unwrap();
        (taken.frame.samples().mean(), taken.facts)
    };
    let (before, _) = mean(&mut camera);
    camera.set_control("gain", "40").unwrap();
    let (after, facts) = mean(&mut camera);
    assert!((after / before - 1.4).abs() < 0.02, "{before} {after}");
    assert!(facts.controls.contains(&("gain".to_owned(), 40)));
}

#[test]
fn a_camera_that_comes_back_is_set_as_it_was_or_not_used() {
    let simulator = Arc::new(Simulator::new(SimulatorConfig::textured_plane(160, 120, 2)).unwrap());
    let mut camera = SimCamera::before_simulator(Arc::clone(&simulator), StagePosition::default());
    camera.configure(&CameraSettings::default()).unwrap();
    camera.start().unwrap();
    // Set after it was configured: nothing but the camera's own memory knows it, and it loses that with its power.
    camera.set_control("gain", "40").unwrap();
    camera.device().inject(SimFault::Disconnect { failing: 2 });
    let moment = camera.now();
    assert!(matches!(camera.grab_after(moment), Err(CameraError::Gone { .. })));
    camera.reconnect(Duration::from_secs(5)).unwrap();
    let moment = camera.now();
    let taken = camera.grab_after(moment).unwrap();
    assert!(taken.facts.controls.contains(&("gain".to_owned(), 40)), "{:?}", taken.facts.controls);
    camera.device().inject(SimFault::Disconnect { failing: 1000 });
    let moment = camera.now();
    assert!(matches!(camera.grab_after(moment), Err(CameraError::Gone { .. })));
    assert!(matches!(camera.reconnect(Duration::from_secs(5)), Err(CameraError::ReconnectTimeout { .. })));
}

#[test]
fn every_fault_ends_with_the_right_frame_or_a_typed_error() {
    let errors = [
        (Fault::LongSilence, "error `Timeout`"),
        (Fault::NoSignal, "error `NoSignal`"),
        (Fault::AnotherCamera, "gone is noticed, and after reconnecting: error `AnotherCamera`"),
        (Fault::Disconnect, "gone is noticed, and after reconnecting: the right frame"),
    ];
    let mut bench = SimBench::new();
    let mut seen = 0;
    for (step, (fault, _)) in FAULTS.iter().enumerate() {
        let Some(found) = outcome(&mut bench, *fault, step) else { continue };
        let expected =
            errors.iter().find(|(error, _)| error == fault).map_or("the right frame", |(_, words)| words);
        assert_eq!(found, expected, "{fault:?}");
        seen += 1;
    }
    assert!(seen >= 25, "only {seen} faults were tried");
}

//! Scripted faults of a simulated rig: the program with the drivers of real stages, without a second program.

use std::path::Path;

use crate::support::{epirig, fails, succeeds};
use epirig_data::sequence::{Event, Sequence};

const RIG: [&str; 5] = ["capture", "--rig=sim", "--out=seq", "--step-mm=2", "--frames=9"];

/// A scan with a simulated stage and faults: its exit code, and what it said.
fn scan(folder: &Path, driver: &str, faults: Option<&str>) -> (Option<i32>, String) {
    let driver = format!("--driver={driver}");
    let faults = faults.map(|faults| format!("--set=sim.faults={faults}"));
    let mut arguments = [&RIG[..], &["--size=256x192", "--set=limits.wait=1 s", &driver]].concat();
    arguments.extend((driver != "--driver=sim").then_some("--port=sim"));
    arguments.extend(faults.as_deref());
    let output = epirig(folder, &arguments);
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

/// The indices of frames that were taken again, and the bytes of all frames.
fn frames(folder: &Path) -> (Vec<usize>, Vec<Vec<u8>>) {
    let sequence = Sequence::open(&folder.join("seq")).unwrap();
    let again = |event: &Event| if let Event::Retake(retake) = event { Some(retake.index) } else { None };
    let bytes = |index| std::fs::read(folder.join(format!("seq/frames/{index:04}.png"))).unwrap();
    (sequence.events().iter().filter_map(again).collect(), (0..sequence.frames().len()).map(bytes).collect())
}

#[test]
fn every_driver_with_a_line_scans_without_hardware_and_repeats_what_a_script_damages() {
    for driver in ["native", "grbl", "zaber"] {
        let script = "camera-torn@3,reset@5+0.2s,noise@6/5s,camera-silent@7/2s";
        let [sound, faulty] = [None, Some(script)].map(|faults| {
            let folder = tempfile::tempdir().unwrap();
            let (code, said) = scan(folder.path(), driver, faults);
            assert_eq!(code, Some(0), "{driver}: {said}");
            succeeds(folder.path(), &["verify", "seq"]);
            frames(folder.path())
        });
        // The simulated camera has no noise: equal places give equal frames.
        assert!(sound.1 == faulty.1, "{driver}");
        assert!(sound.0.is_empty() && faulty.0.contains(&5), "{driver}: {:?}", faulty.0);
    }
}

#[test]
fn lost_steps_are_found_at_the_end() {
    for driver in ["sim", "native", "grbl"] {
        let folder = tempfile::tempdir().unwrap();
        // A third of a pixel; the limit is 0.1 px.
        let (code, said) = scan(folder.path(), driver, Some("lost-steps@4/0.4mm"));
        assert!(code == Some(4) && said.contains("frame 0 taken again differs"), "{driver}: {code:?} {said}");
    }
    let folder = tempfile::tempdir().unwrap();
    // Less than the limit of the picture, but not of the steps, which this stage counts.
    let (code, said) = scan(folder.path(), "native", Some("lost-steps@4/0.1mm"));
    assert!(code == Some(4) && said.contains("home was found +0.1000 mm"), "{code:?} {said}");
}

#[test]
fn a_scan_that_ended_by_a_script_resumes_without_it() {
    for (driver, fault) in [("native", "hang-up@4+0.1s/100000s"), ("sim", "camera-gone@4")] {
        let folder = tempfile::tempdir().unwrap();
        let (code, said) = scan(folder.path(), driver, Some(fault));
        assert_eq!(code, Some(7), "{driver}: {said}");
        let begun = Sequence::open(&folder.path().join("seq")).unwrap();
        let recorded = &begun.record().origin.rig().unwrap()["sim"]["faults"];
        assert_eq!((begun.frames().len(), recorded), (4, &fault.into()));
        succeeds(folder.path(), &["resume", "seq"]);
        assert_eq!(Sequence::open(&folder.path().join("seq")).unwrap().frames().len(), 9);
    }
}

#[test]
fn what_cannot_happen_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |faults: &str, words: &[&str]| {
        let set = format!("--set=sim.faults={faults}");
        fails(folder.path(), &[&RIG[..], &[&set]].concat(), 2, words);
    };
    refused("fire@4", &["sim.faults", "lost-steps@40/0.1mm"]);
    refused("lost-steps@9/0.1mm", &["sim.faults: there is no frame 9", "0 to 8"]);
    refused("reset@4+0.1s", &["reset@4+0.1s cannot happen to a stage in memory", "stage.port = \"sim\""]);
    assert!(!folder.path().join("seq").exists());
}

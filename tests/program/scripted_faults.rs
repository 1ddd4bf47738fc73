//! Scripted faults of a simulated rig: the program with the drivers of real stages, without a second program.
//!
//! Not among the tests of scans: a process that is being started holds the locks of the one that starts it.

use std::path::Path;

use crate::support::{epirig, fails, succeeds};
use epirig_data::sequence::{Event, Sequence};
use epirig_devices::faults::RigFaults;

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

/// What comes of each fault at frame 4: the exit code, and words of stderr or of the journal.
const OUTCOMES: [(&str, i32, &str); 18] = [
    // A third of a pixel; the limit is 0.1 px.
    ("lost-steps@4/0.4mm", 4, "frame 0 taken again differs"),
    ("no-motion@4", 4, "frame 4 shows what the frame before shows"),
    ("mute@4/2s", 0, "does not answer"),
    // A line that is asked again and again; nothing else tells of it.
    ("noise@4/10s", 0, ""),
    ("reset@4+0.2s", 0, "has restarted"),
    ("settings@4+0.2s", 4, "steps_per_mm was 250 and is 251"),
    ("hang-up@4+0.2s/1s", 0, "simulated port has gone"),
    ("limit@4+0.2s", 0, "a limit switch closed"),
    ("camera-silent@4/20s", 0, "gave no good frame within 10.00 s"),
    ("camera-torn@4", 0, "\"unsteady\":2"),
    ("camera-late@4", 0, "\"unsteady\":2"),
    ("camera-damaged@4", 0, "\"damaged\":1"),
    ("camera-short@4", 0, "\"damaged\":1"),
    ("camera-error@4", 0, "\"restarts\":1"),
    ("camera-unplugged@4", 0, "has gone: cable or power is off"),
    ("camera-gone@4", 7, "did not reconnect within 1 s"),
    ("camera-gain@4", 0, "\"restarts\":1"),
    ("camera-no-signal@4", 7, "has no signal"),
];

#[test]
fn every_fault_of_the_table_happens_and_is_noticed() {
    let names: Vec<String> = RigFaults::forms().into_iter().map(|(form, _)| name(&form).to_owned()).collect();
    assert_eq!(OUTCOMES.map(|(fault, ..)| name(fault).to_owned()).to_vec(), names);
    for (fault, expected, words) in OUTCOMES {
        let folder = tempfile::tempdir().unwrap();
        let (code, said) = scan(folder.path(), "native", Some(fault));
        let journal = std::fs::read_to_string(folder.path().join("seq/journal.jsonl")).unwrap();
        // Without a stage or camera that comes back, the scan can be resumed.
        let codes = if fault == "no-motion@4" || fault == "settings@4+0.2s" { [4, 7] } else { [expected; 2] };
        assert!(code.is_some_and(|code| codes.contains(&code)), "{fault}: {code:?} {said}");
        assert!(said.contains(words) || journal.contains(words), "{fault}: {said}\n{journal}");
    }
}

/// The name of a fault in its text.
fn name(fault: &str) -> &str {
    fault.split('@').next().unwrap_or(fault)
}

#[test]
fn the_table_of_the_book_has_every_fault_in_the_words_of_the_program() {
    let page = include_str!("../../docs/src/stage.md");
    for (form, what) in RigFaults::forms() {
        let row = page.lines().find(|line| line.starts_with(&format!("| `{}@", name(&form))));
        assert!(row.is_some_and(|row| row.contains(what)), "stage.md does not say: `{form}` | {what}");
    }
}

#[test]
fn lost_steps_are_found_at_the_end_by_the_picture_or_by_homing() {
    for driver in ["sim", "native", "grbl", "zaber"] {
        let folder = tempfile::tempdir().unwrap();
        let (code, said) = scan(folder.path(), driver, Some("lost-steps@4/0.4mm"));
        assert!(code == Some(4) && said.contains("frame 0 taken again differs"), "{driver}: {code:?} {said}");
        // 0.08 px: within the limit of the picture. Only stages that report where homing finds home tell.
        let folder = tempfile::tempdir().unwrap();
        let (code, said) = scan(folder.path(), driver, Some("lost-steps@4/0.1mm"));
        let told = code == Some(4) && said.contains("home was found +0.1000 mm");
        assert_eq!(told, matches!(driver, "sim" | "native"), "{driver}: {code:?} {said}");
    }
}

#[test]
fn a_fault_happens_in_the_last_motion_to_its_frame() {
    // Short steps that are approached from below, and a fault that comes after the move has ended.
    for (fault, code) in [("lost-steps@4/0.1mm", Some(4)), ("reset@4+1s", Some(0))] {
        let folder = tempfile::tempdir().unwrap();
        let arguments = ["--set=plan.step=0.2 mm", "--set=stage.approach=0.5 mm"];
        let faults = format!("--set=sim.faults={fault}");
        let rig = [
            "capture",
            "--rig=sim",
            "--out=seq",
            "--frames=9",
            "--driver=native",
            "--port=sim",
            "--size=64x48",
        ];
        let output = epirig(folder.path(), &[&rig[..], &arguments, &[&faults]].concat());
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), code, "{fault}: {said}");
        let words = if code == Some(0) { "has restarted" } else { "home was found +0.1000 mm" };
        assert!(said.contains(words), "{fault}: {said}");
    }
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
    refused(
        "reset@4+0.1s",
        &["reset@4+0.1s needs a stage at the end of a simulated line", "stage.port = \"sim\""],
    );
    let other = |changes: &[&str], words: &[&str]| {
        fails(folder.path(), &[&RIG[..], changes].concat(), 2, words);
    };
    let camera = "--set=sim.faults=camera-gone@1";
    other(&[camera, "--camera=/dev/video0"], &["the camera is not simulated"]);
    other(
        &["--driver=native", "--port=/dev/none", "--set=sim.faults=lost-steps@1/1mm"],
        &["needs a simulated stage"],
    );
    let unknown = ["capture", "--rig=sim", "--out=seq", "--set=plan.frames=", camera];
    assert_eq!(epirig(folder.path(), &unknown).status.code(), Some(2));
    assert!(!folder.path().join("seq").exists());
}

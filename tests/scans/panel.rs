//! The rig and a scan as the page of `epirig ui` has them: orders in, states out.

use std::fs;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use serde_json::{Value, json};

use crate::bench::{Bench, mm};
use crate::faulty_rig::{Cable, Mischief, Tampered, When};
use epirig::profile::{Profile, REAL, SIM};
use epirig_core::progress::Silent;
use epirig_data::sequence::{FrameKind, Sequence, verify};
use epirig_devices::camera::{
    CameraDriver, CameraError, OpenCamera, SimCamera, SimFault, Surroundings, add_camera_drivers,
};
use epirig_server::RefusalKind;

/// A small rig that moves and takes frames as fast as the machine can.
const FAST: [&str; 2] = ["camera.size=160x120", "plan.frames=9"];
/// The same in real time: a velocity of 5 mm/s, an acceleration of 20 mm/s2.
const REAL_TIME: [&str; 3] = ["camera.size=160x120", "plan.frames=9", "sim.real_time=true"];

#[test]
fn a_person_moves_the_stage() {
    let bench = Bench::new(SIM, &FAST);
    let state = bench.state();
    assert_eq!((&state["stage"]["homed"], &state["stage"]["travel_mm"]), (&json!(false), &json!(200.0)));
    bench.post("rig/go", json!({ "mm": 3.0 }));
    let state = bench.until_idle();
    let last = &state["log"].as_array().unwrap().last().unwrap()["words"];
    assert!(last.as_str().unwrap().contains("home"), "a stage that is not homed says so: {last}");
    bench.home();
    bench.post("rig/go", json!({ "mm": 40.0 }));
    assert_eq!(mm(&bench.until_idle()), 40.0);
    bench.post("rig/step", json!({ "mm": -0.1 }));
    assert!((mm(&bench.until_idle()) - 39.9).abs() < 1e-9);
    bench.post("rig/go", json!({ "mm": 201.0 }));
    assert!((mm(&bench.until_idle()) - 39.9).abs() < 1e-9, "outside of the travel");
}

#[test]
fn stop_ends_a_move_and_the_next_one_works() {
    let bench = Bench::new(SIM, &REAL_TIME);
    bench.home();
    bench.post("rig/go", json!({ "mm": 100.0 }));
    let moving = bench.until("it has gone a bit", |state| {
        state["stage"]["position_mm"].as_f64().is_some_and(|mm| mm > 1.0)
    });
    assert_eq!(moving["task"]["kind"], "moving");
    let (kind, _) = bench.try_post("rig/step", json!({ "mm": 1.0 })).unwrap_err();
    assert_eq!(kind, RefusalKind::Busy, "one order at a time");
    bench.post("rig/stop", json!({}));
    let state = bench.until_idle();
    assert!(mm(&state) < 99.0 && state["stage"]["homed"] == true, "{state:#}");
    bench.post("rig/go", json!({ "mm": mm(&state) + 0.5 }));
    assert!((mm(&bench.until_idle()) - mm(&state) - 0.5).abs() < 1e-6);
}

#[test]
fn a_jog_lasts_as_long_as_the_page_holds_it() {
    let bench = Bench::new(SIM, &REAL_TIME);
    bench.home();
    bench.post("rig/jog", json!({ "id": 1, "direction": 1, "fast": true }));
    bench.until("it moves", |state| {
        // It may have just ended.
        let _ = bench.try_post("rig/keep", json!({ "id": 1 }));
        state["stage"]["position_mm"].as_f64().is_some_and(|mm| mm > 2.0)
    });
    let heard = Instant::now();
    // No word of the page any more.
    let state = bench.until_idle();
    // Words count for 0.3 s, the check takes 0.02 s, and 5 mm/s are braked within 0.25 s and 0.63 mm. The state
    // was some ms old. A machine that is slow lets it run on for no longer than it sleeps itself.
    let most_mm = 2.1 + 5.0 * heard.elapsed().as_secs_f64() + 0.7;
    assert!(mm(&state) <= most_mm, "{} of {most_mm}", mm(&state));
    assert_eq!(state["stage"]["homed"], true, "the position stays known");
    // A word that comes late does not bring it back.
    let (kind, _) = bench.try_post("rig/keep", json!({ "id": 1 })).unwrap_err();
    assert_eq!(kind, RefusalKind::NotFound);
    assert_eq!(mm(&bench.until_idle()), mm(&state));
    // At the end of the travel a jog ends by itself.
    bench.post("rig/go", json!({ "mm": 0.3 }));
    bench.until_idle();
    bench.post("rig/jog", json!({ "id": 2, "direction": -1, "fast": false }));
    let end = bench.until("the end is reached", |state| {
        let _ = bench.try_post("rig/keep", json!({ "id": 2 }));
        state["task"].is_null()
    });
    assert!((0.0..0.3).contains(&mm(&end)), "{end:#}");
}

#[test]
fn only_one_page_controls_and_every_page_stops() {
    let bench = Bench::new(SIM, &FAST);
    bench.home();
    let other = |path: &str| bench.try_post(path, json!({ "client": "other", "mm": 1.0 }));
    assert_eq!(other("rig/step").unwrap_err().0, RefusalKind::Forbidden);
    assert!(other("rig/stop").is_ok());
    bench.until_idle();
    assert!(other("rig/take").is_ok() && other("rig/step").is_ok());
    assert_eq!(bench.until_idle()["controller"], "other");
    assert_eq!(bench.try_post("rig/home", json!({})).unwrap_err().0, RefusalKind::Forbidden);
    for (path, asked) in [
        ("rig/go", json!({})),
        ("rig/go", json!({ "mm": "far" })),
        ("rig/jog", json!({ "id": -1 })),
        ("rig/show", json!({ "what": "cat" })),
        ("rig/profile/check", json!({ "values": 3 })),
        ("scan/start", json!({ "name": ["a"] })),
    ] {
        let mut asked = asked;
        asked["client"] = json!("other");
        assert_eq!(bench.try_post(path, asked).unwrap_err().0, RefusalKind::Wrong, "{path}");
    }
    assert_eq!(
        bench.try_post("rig/explode", json!({ "client": "other" })).unwrap_err().0,
        RefusalKind::NotFound
    );
}

#[test]
fn no_name_leaves_the_folder() {
    let bench = Bench::new(SIM, &FAST);
    let outside = tempfile::tempdir().unwrap();
    fs::create_dir(outside.path().join("seq")).unwrap();
    fs::write(outside.path().join("seq/sequence.json"), "{}").unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(outside.path().join("seq"), bench.path().join("link")).unwrap();
    let absolute = outside.path().join("seq").display().to_string();
    for name in ["../seq", "..", ".", "", "link", "a/b", "a\\b", "-x", "a\0b", &absolute] {
        for path in ["scan/resume", "scan/measure", "results/open"] {
            let (kind, _) = bench.try_post(path, json!({ "name": name })).unwrap_err();
            assert_eq!(kind, RefusalKind::NotFound, "{path} {name:?}");
        }
        if name != "link" {
            let (kind, _) = bench.try_post("scan/start", json!({ "name": name })).unwrap_err();
            assert_eq!(kind, RefusalKind::Wrong, "{name:?}");
        }
    }
    assert_eq!(bench.get("sequences"), json!([]));
}

#[test]
fn a_profile_is_checked_used_and_saved() {
    let bench = Bench::new(SIM, &FAST);
    let values = |step: &str| json!({ "values": { "plan.step": step, "plan.frames": "12" } });
    let mistakes = bench.post("rig/profile/check", values("2"));
    assert_eq!(mistakes[0]["key"], "plan.step");
    assert_eq!(bench.post("rig/profile/check", values("2 mm")), json!([]));
    assert_eq!(bench.try_post("rig/profile/use", values("2")).unwrap_err().0, RefusalKind::Wrong);
    bench.post("rig/profile/use", values("2 mm"));
    bench.until("the rig is connected anew", |state| {
        state["stage"]["plan_mm"] == json!([10.0, 32.0]) && state["task"].is_null()
    });
    let plan = bench.get("scan/plan");
    assert_eq!(
        (&plan["frames"], &plan["step_mm"], &plan["name"]),
        (&json!(12), &json!(2.0), &json!("scan-001"))
    );
    bench.post("rig/profile/save", json!({ "values": {} }));
    let file = bench.path().join("rig.toml");
    let saved = Profile::read(&fs::read_to_string(&file).unwrap(), "rig.toml", &[]).unwrap();
    assert_eq!((saved.plan.step_mm, saved.plan.frames), (Some(2.0), Some(12)));
    let again = json!({ "values": { "plan.frames": "13" } });
    assert_eq!(bench.try_post("rig/profile/save", again.clone()).unwrap_err().0, RefusalKind::Wrong);
    let mut replaced = again;
    replaced["overwrite"] = json!(true);
    bench.post("rig/profile/save", replaced);
    assert!(fs::read_to_string(&file).unwrap().contains("\nframes = 13\n"));
}

#[test]
fn a_control_that_is_set_is_that_of_the_scan() {
    let bench = Bench::new(SIM, &FAST);
    let controls = bench.get("rig/controls");
    let gain = controls.as_array().unwrap().iter().find(|control| control["name"] == "gain").unwrap();
    let wanted = gain["value"].as_i64().unwrap() + 1;
    let now = bench.post("rig/control", json!({ "name": "gain", "value": wanted.to_string() }));
    assert!(
        now.as_array().unwrap().iter().any(|control| control["name"] == "gain" && control["value"] == wanted)
    );
    assert_eq!(
        bench.try_post("rig/control", json!({ "name": "gain", "value": "a lot" })).unwrap_err().0,
        RefusalKind::Wrong
    );
    bench.post("scan/start", json!({ "name": "seq" }));
    bench.until("the scan is done", |state| state["scan"]["state"] == "done");
    let record = fs::read_to_string(bench.path().join("seq/sequence.json")).unwrap();
    let record: Value = serde_json::from_str(&record).unwrap();
    assert_eq!(record["origin"]["configuration"]["controls"]["gain"], wanted);
}

#[test]
fn a_scan_is_paused_resumed_and_measured() {
    add_camera_drivers(&[&WAITING]);
    let set = ["camera.size=256x192", "plan.frames=41", "plan.step=3.7 mm", "camera.device=waiting"];
    let bench = Bench::new(SIM, &set);
    bench.post("scan/start", json!({ "name": "seq" }));
    bench.until("some frames are there", |state| state["scan"]["done"].as_u64() >= Some(5));
    bench.post("scan/pause", json!({}));
    assert_eq!(bench.state()["scan"]["state"], "pausing");
    OPEN.store(true, Ordering::SeqCst);
    let paused = bench.until("it is paused", |state| state["scan"]["state"] == "paused");
    assert_eq!(paused["scan"]["held_by"], json!(["operator"]));
    let done = paused["scan"]["done"].as_u64().unwrap();
    assert!((5..41).contains(&done), "{done}");
    bench.until_idle();
    assert_eq!(bench.get("sequences")[0]["can_be_resumed"], true);
    bench.post("scan/resume", json!({ "name": "seq" }));
    let state = bench.until("it is done", |state| state["scan"]["state"] == "done");
    assert_eq!((&state["scan"]["done"], &state["scan"]["planned"]), (&json!(41), &json!(41)));
    let sequence = Sequence::open(&bench.path().join("seq")).unwrap();
    assert_eq!(verify(&sequence, &Silent).unwrap().findings, []);
    // The live map is of frames of both runs, and it grows sharper.
    let last = bench.until("the last map is made", |state| state["scan"]["map"]["frames"] == 41);
    let course = last["scan"]["course"].as_array().unwrap();
    assert!(course[0][1].as_f64() > course.last().unwrap()[1].as_f64(), "{course:?}");
    bench.until_idle();
    bench.post("scan/measure", json!({ "name": "seq" }));
    bench.until("it is measured", |state| state["scan"]["measured"] == true);
    assert!(bench.path().join("seq/results/surface/report.html").is_file());
    bench.post("results/open", json!({ "name": "seq" }));
    assert_eq!(bench.get("about")["sequence"], "seq");
    assert_eq!(bench.get("results")["results"]["name"], "results");
}

#[test]
#[cfg(target_os = "linux")]
fn a_scan_whose_folder_is_renamed_is_told_by_its_present_name() {
    add_camera_drivers(&[&HELD]);
    let set = ["camera.size=160x120", "plan.frames=21", "camera.device=held"];
    let renamed = |pauses: bool| {
        LET_GO.store(false, Ordering::SeqCst);
        let bench = Bench::new(SIM, &set);
        bench.post("scan/start", json!({ "name": "seq" }));
        bench.until("some frames are there", |state| state["scan"]["done"].as_u64() >= Some(5));
        fs::rename(bench.path().join("seq"), bench.path().join("other")).unwrap();
        if pauses {
            bench.post("scan/pause", json!({}));
        }
        LET_GO.store(true, Ordering::SeqCst);
        let ended = bench.until("it ends", |state| {
            !["running", "pausing"].contains(&state["scan"]["state"].as_str().unwrap())
        });
        assert_eq!(ended["scan"]["name"], "other", "{ended:#}");
        (bench, ended)
    };
    let (bench, paused) = renamed(true);
    assert_eq!((&paused["scan"]["state"], &paused["scan"]["reason"]), (&json!("paused"), &Value::Null));
    bench.until_idle();
    bench.post("scan/resume", json!({ "name": "other" }));
    bench.until("it is done", |state| state["scan"]["state"] == "done");
    let (bench, done) = renamed(false);
    assert_eq!(done["scan"]["state"], "done", "{done:#}");
    let told = done["log"].as_array().unwrap().last().unwrap()["words"].as_str().unwrap().to_owned();
    assert!(told.contains("complete") && told.contains("renamed"), "{told}");
    let sequence = Sequence::open(&bench.path().join("other")).unwrap();
    assert_eq!(verify(&sequence, &Silent).unwrap().findings, []);
}

#[test]
fn boards_held_by_hand_are_photographed_by_themselves() {
    let set = ["camera.size=320x240", "plan.frames=5", "plan.board=3", "plan.dark=1", "plan.flat=1"];
    let bench = Bench::new(REAL, &set);
    bench.post("scan/start", json!({ "name": "seq" }));
    let asked = bench.until("a board is asked for", |state| state["scan"]["asked"]["kind"] == "board");
    assert_eq!(
        (&asked["scan"]["asked"]["by_itself"], &asked["scan"]["asked"]["poses"]),
        (&json!(true), &json!(3))
    );
    let state = bench.until("it is done", |state| state["scan"]["state"] == "done");
    let covered = state["target"]["coverage"].as_array().unwrap();
    assert!(covered.iter().any(|seen| seen == true), "{state:#}");
    let sequence = Sequence::open(&bench.path().join("seq")).unwrap();
    assert_eq!(sequence.calibration_frames(FrameKind::Board).len(), 3);
    assert_eq!(verify(&sequence, &Silent).unwrap().findings, []);
}

/// A simulated camera to which something is done before one of its frames.
struct Odd {
    name: &'static str,
    when: When,
    mischief: Mischief,
}

/// Goes away, and comes back at the third attempt.
static LEAVING: Odd = Odd {
    name: "leaving",
    when: When::Grab(12),
    mischief: Mischief::Fault(SimFault::Disconnect { failing: 3 }),
};
/// Waits.
static WAITING: Odd = Odd { name: "waiting", when: When::Grab(8), mischief: Mischief::Wait(&OPEN) };
static OPEN: AtomicBool = AtomicBool::new(false);
/// Waits in a test of its own.
static HELD: Odd = Odd { name: "held", when: When::Grab(8), mischief: Mischief::Wait(&LET_GO) };
static LET_GO: AtomicBool = AtomicBool::new(false);
/// Its cable is pulled while a person arranges something.
static PULLED: Odd = Odd { name: "pulled", when: When::Look, mischief: Mischief::Cable(&CABLE) };
static CABLE: Cable = Cable::new();

impl CameraDriver for Odd {
    fn name(&self) -> &'static str {
        self.name
    }

    fn claims(&self, device: &str) -> bool {
        device == self.name
    }

    fn is_simulated(&self) -> bool {
        true
    }

    fn open(&self, _device: Option<&str>, around: &Surroundings) -> Result<OpenCamera, CameraError> {
        let camera = SimCamera::before_simulator(around.simulator.clone().unwrap(), around.stage.clone());
        let plan = vec![(self.when, self.mischief.clone())];
        Ok(OpenCamera { camera: Box::new(Tampered::new(camera, plan)), view: None })
    }
}

#[test]
fn a_camera_that_is_lost_in_a_scan_is_said_and_waited_for() {
    add_camera_drivers(&[&LEAVING]);
    let bench = Bench::new(SIM, &["camera.size=160x120", "plan.frames=21", "camera.device=leaving"]);
    bench.post("scan/start", json!({ "name": "seq" }));
    let state = bench.until("it is done", |state| state["scan"]["state"] == "done");
    let retakes = state["scan"]["retakes"].as_array().unwrap();
    assert_eq!(retakes.len(), 1, "{state:#}");
    let log: Vec<&str> =
        state["log"].as_array().unwrap().iter().map(|line| line["words"].as_str().unwrap()).collect();
    assert!(log.iter().any(|line| line.contains("waiting up to 300 s for the camera")), "{log:?}");
    assert!(log.iter().any(|line| line.contains("the scan continues")), "{log:?}");
    let sequence = Sequence::open(&bench.path().join("seq")).unwrap();
    assert_eq!(verify(&sequence, &Silent).unwrap().findings, []);
}

#[test]
fn a_camera_that_is_lost_while_a_person_arranges_something_confirms_nothing() {
    add_camera_drivers(&[&PULLED]);
    let set = ["camera.size=160x120", "plan.frames=5", "plan.dark=1", "camera.device=pulled"];
    let bench = Bench::new(SIM, &set);
    bench.post("scan/start", json!({ "name": "seq" }));
    bench.until("dark is asked for", |state| state["scan"]["asked"]["kind"] == "dark");
    CABLE.pull();
    let state = bench.until("several looks have failed", |_| CABLE.looks() > 3);
    assert_eq!(state["scan"]["asked"]["kind"], "dark", "{state:#}");
    // A person who confirms is told that there is no camera, and can go on when there is.
    bench.post("scan/arranged", json!({ "done": true }));
    let state = bench.until("it is paused", |state| state["scan"]["state"] == "paused");
    assert_eq!(state["scan"]["held_by"], json!(["camera"]), "{state:#}");
    bench.until("the camera is back", |state| {
        state["task"].is_null() && state["camera"]["state"] == "live" && state["camera"]["error"].is_null()
    });
    bench.post("scan/resume", json!({ "name": "seq" }));
    for kind in ["dark", "object"] {
        bench.until(kind, |state| state["scan"]["asked"]["kind"] == kind);
        bench.post("scan/arranged", json!({ "done": true }));
    }
    bench.until("it is done", |state| state["scan"]["state"] == "done");
    let sequence = Sequence::open(&bench.path().join("seq")).unwrap();
    assert_eq!(sequence.calibration_frames(FrameKind::Dark).len(), 1);
    assert_eq!(verify(&sequence, &Silent).unwrap().findings, []);
}

#[test]
fn the_rig_is_examined_and_a_scan_ends_with_the_program() {
    let mut bench = Bench::new(SIM, &["camera.size=160x120", "plan.frames=401", "plan.step=0.3 mm"]);
    bench.post("rig/doctor", json!({ "short": true }));
    let state = bench.until("it is examined", |state| !state["doctor"].is_null());
    let checks = state["doctor"]["checks"].as_array().unwrap();
    assert!(checks.iter().any(|check| check["name"] == "travel" && check["verdict"] == "good"), "{state:#}");
    assert!(state["doctor"]["predicted_mm"].as_f64().is_some_and(|mm| mm > 0.0), "{state:#}");
    bench.until_idle();
    bench.post("scan/start", json!({ "name": "seq" }));
    bench.until("it has begun", |state| state["scan"]["done"].as_u64() >= Some(2));
    bench.closer.take().unwrap().wait();
    let sequence = Sequence::open(&bench.path().join("seq")).unwrap();
    let there = sequence.frames().len();
    assert!((2..401).contains(&there) && sequence.ended() == "aborted", "{there} {}", sequence.ended());
}

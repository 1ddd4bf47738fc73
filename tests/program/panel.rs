//! The panel of a rig, asked as its page asks it: orders, STOP, and who has control.

use std::path::Path;
use std::time::{Duration, Instant};

use epirig::panel::{Panel, PanelCloser, PanelHooks, PanelOptions};
use epirig::profile::Draft;
use epirig_server::{Message, Query, Refusal, RefusalKind, Reply, Site};
use serde_json::{Value, json};

struct NoHooks;

impl PanelHooks for NoHooks {}

/// A small simulated rig.
const PROFILE: &str = "[stage]
driver = \"sim\"
[camera]
device = \"sim\"
size = \"192x128\"
[plan]
step = \"0.5 mm\"
frames = 9
";

/// The panel of a small simulated rig, closed at the end.
pub(crate) struct Rig {
    pub(crate) panel: Panel,
    closer: Option<PanelCloser>,
}

impl Rig {
    pub(crate) fn new(folder: &Path) -> Self {
        let (panel, closer) = Panel::open(PanelOptions {
            draft: Draft::read(PROFILE, "rig.toml", &[]).unwrap(),
            source: "rig.toml".to_owned(),
            file: folder.join("rig.toml"),
            folder: folder.to_owned(),
            hooks: Box::new(NoHooks),
        })
        .unwrap();
        let rig = Self { panel, closer: Some(closer) };
        rig.until("it is connected", |state| {
            (state["stage"]["state"] == "ready" && state["camera"]["state"] == "live").then_some(())
        });
        rig
    }

    fn state(&self) -> Value {
        parsed(&self.panel.get(&["rig", "state"], &Query::default()).unwrap())
    }

    /// Waits until the state is as told, far longer than it takes.
    fn until<T>(&self, what: &str, found: impl Fn(&Value) -> Option<T>) -> T {
        let began = Instant::now();
        loop {
            let state = self.state();
            if let Some(found) = found(&state) {
                return found;
            }
            assert!(began.elapsed() < Duration::from_secs(120), "not in time: {what}: {state}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    fn rests(&self) {
        self.until("it rests", |state| (state["task"].is_null() && state["stopping"] == false).then_some(()));
    }

    pub(crate) fn post(&self, path: &str, mut asked: Value) -> Result<Reply, Refusal> {
        asked["client"] = json!("page");
        self.panel.post(&path.split('/').collect::<Vec<_>>(), &asked)
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        self.closer.take().unwrap().wait();
    }
}

pub(crate) fn parsed(reply: &Reply) -> Value {
    serde_json::from_slice(&reply.bytes).unwrap()
}

/// The last lines of the log.
fn log(state: &Value) -> String {
    let lines = state["log"].as_array().unwrap().iter();
    lines.map(|line| line["words"].as_str().unwrap().to_owned() + "\n").collect()
}

#[test]
fn stage_plan_and_form_have_the_same_profile() {
    let folder = tempfile::tempdir().unwrap();
    let rig = Rig::new(folder.path());
    for round in 0..40 {
        rig.rests();
        let frames = 5 + round;
        let values = json!({ "values": { "plan.frames": frames.to_string(), "stage.travel": "90 mm" } });
        // Every third time STOP comes at once: the profile is used or is not, and all agree on it.
        let used = std::thread::scope(|scope| {
            let stops = (round % 3 == 0).then(|| scope.spawn(|| rig.post("rig/stop", json!({})).unwrap()));
            let used = rig.post("rig/profile/use", values);
            stops.map(|stops| stops.join().unwrap());
            used
        });
        rig.rests();
        let state = rig
            .until("the stage is ready", |state| (state["stage"]["state"] == "ready").then(|| state.clone()));
        let plan = parsed(&rig.panel.get(&["scan", "plan"], &Query::default()).unwrap());
        let end_mm = state["stage"]["plan_mm"][1].as_f64().unwrap();
        assert_eq!(plan["end_mm"].as_f64(), Some(end_mm), "round {round}: {used:?}");
        match used {
            Ok(_) => assert_eq!(plan["frames"], frames, "round {round}"),
            Err(refusal) => assert_eq!(refusal.kind, RefusalKind::Busy, "{refusal:?}"),
        }
    }
}

#[test]
fn a_measurement_is_stopped_and_can_be_made_again() {
    let folder = tempfile::tempdir().unwrap();
    let rig = Rig::new(folder.path());
    rig.post("scan/start", json!({ "name": "plate" })).unwrap();
    rig.until("the scan is done", |state| (state["scan"]["state"] == "done").then_some(()));
    // The simulated stage was homed by the scan, and is so still.
    rig.rests();
    let state = rig.state();
    assert_eq!(state["stage"]["homed"], true, "{state}");
    let names = || {
        let entries = std::fs::read_dir(folder.path().join("plate")).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        names
    };
    let before = names();
    rig.post("scan/measure", json!({ "name": "plate" })).unwrap();
    rig.until("a step is counted", |state| (state["task"]["step"].is_string()).then_some(()));
    rig.post("rig/stop", json!({})).unwrap();
    rig.rests();
    let words = log(&rig.state());
    assert!(words.contains("the measurement of plate was stopped"), "{words}");
    assert_eq!(rig.state()["scan"]["measured"], false);
    assert_eq!(names(), before, "nothing is left over");
    rig.post("scan/measure", json!({ "name": "plate" })).unwrap();
    rig.until("it is measured", |state| (state["scan"]["measured"] == true).then_some(()));
    rig.rests();
}

#[test]
fn control_is_free_when_its_page_has_gone() {
    let folder = tempfile::tempdir().unwrap();
    let rig = Rig::new(folder.path());
    let mut page = rig.panel.feed(&["rig", "state", "page"]).unwrap();
    let told = |feed: &mut dyn epirig_server::Feed| match feed.next() {
        Some(Message::Text(text)) => serde_json::from_str::<Value>(&text).unwrap(),
        other => panic!("{other:?}"),
    };
    rig.post("rig/reset-peak", json!({})).unwrap();
    assert_eq!(told(&mut *page)["controller"], "page");
    let other = json!({ "client": "other" });
    assert_eq!(rig.panel.post(&["rig", "home"], &other).expect_err("refused").kind, RefusalKind::Forbidden);
    drop(page);
    rig.until("control is free", |state| state["controller"].is_null().then_some(()));
    rig.panel.post(&["rig", "reset-peak"], &other).unwrap();
    assert_eq!(rig.state()["controller"], "other");
}

#[test]
fn who_looks_may_stop_and_ask_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let rig = Rig::new(folder.path());
    for open in [&["rig", "stop"][..], &["surface"]] {
        assert!(rig.panel.rules(open).open_to_all, "{open:?}");
    }
    for order in [
        &["rig", "home"][..],
        &["rig", "take"],
        &["rig", "hello"],
        &["rig", "profile", "use"],
        &["rig", "show"],
        &["scan", "start"],
        &["scan", "pause"],
        &["results", "open"],
    ] {
        assert!(!rig.panel.rules(order).open_to_all, "{order:?}");
    }
    assert!(rig.panel.rules(&["rig", "stop"]).urgent);
}

#[test]
fn what_cannot_be_done_is_told_before_anything_begins() {
    let folder = tempfile::tempdir().unwrap();
    let rig = Rig::new(folder.path());
    let plan = parsed(&rig.panel.get(&["scan", "plan"], &Query::default()).unwrap());
    for name in ["", "ok name", "con: <script>", &"x".repeat(300), "../up"] {
        let refusal = rig.post("scan/start", json!({ "name": name })).expect_err(name);
        assert_eq!(json!(refusal.message), plan["names"]["words"], "{name}");
    }
    // This profile has no board: black frames would come without a word.
    let refusal = rig.post("rig/show", json!({ "what": "board", "pose": 0 })).expect_err("no board");
    assert!(refusal.message.contains("section board"), "{}", refusal.message);
    assert!(log(&rig.state()).is_empty() || !log(&rig.state()).contains("scan"));
}

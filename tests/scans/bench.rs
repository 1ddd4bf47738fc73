//! A panel with a simulated rig, as tests have it: orders in, states out.

#![allow(unreachable_pub, reason = "a module of test programs has no outside")]

use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use epirig::panel::{Panel, PanelCloser, PanelHooks, PanelOptions};
use epirig::profile::{Draft, Override};
use epirig_server::{Query, RefusalKind, Site};

/// Longest wait for anything: only a test that fails waits for it.
const PATIENCE: Duration = Duration::from_secs(120);

/// No program stands beside the panel.
struct Alone;

impl PanelHooks for Alone {}

/// A panel with a simulated rig, and its folder.
pub struct Bench {
    panel: Panel,
    pub closer: Option<PanelCloser>,
    folder: tempfile::TempDir,
}

impl Bench {
    pub fn new(text: &str, set: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let set: Vec<Override> = set.iter().map(|text| Override::parse(text, "--set").unwrap()).collect();
        let (panel, closer) = Panel::open(PanelOptions {
            draft: Draft::read(text, "rig.toml", &set).unwrap(),
            source: "the simulated rig".to_owned(),
            file: folder.path().join("rig.toml"),
            folder: folder.path().to_owned(),
            hooks: Box::new(Alone),
        })
        .unwrap();
        let bench = Self { panel, closer: Some(closer), folder };
        bench.until("the rig is there", |state| state["stage"]["state"] == "ready");
        bench
    }

    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    pub fn get(&self, path: &str) -> Value {
        let parts: Vec<&str> = path.split('/').collect();
        let reply =
            self.panel.get(&parts, &Query::default()).unwrap_or_else(|error| panic!("{path}: {error:?}"));
        serde_json::from_slice(&reply.bytes).unwrap()
    }

    pub fn state(&self) -> Value {
        self.get("rig/state")
    }

    pub fn try_post(&self, path: &str, mut asked: Value) -> Result<Value, (RefusalKind, String)> {
        let parts: Vec<&str> = path.split('/').collect();
        if asked.get("client").is_none() {
            asked["client"] = json!("bench");
        }
        match self.panel.post(&parts, &asked) {
            Ok(reply) => Ok(serde_json::from_slice(&reply.bytes).unwrap()),
            Err(refusal) => Err((refusal.kind, refusal.message)),
        }
    }

    pub fn post(&self, path: &str, asked: Value) -> Value {
        self.try_post(path, asked).unwrap_or_else(|(_, words)| panic!("{path}: {words}"))
    }

    /// The first state that is as it is waited for.
    pub fn until(&self, what: &str, is: impl Fn(&Value) -> bool) -> Value {
        let began = Instant::now();
        loop {
            let state = self.state();
            if is(&state) {
                return state;
            }
            assert!(began.elapsed() < PATIENCE, "{what}: {state:#}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    pub fn until_idle(&self) -> Value {
        self.until("the rig has nothing to do", |state| state["task"].is_null() && state["stopping"] == false)
    }

    pub fn home(&self) {
        self.post("rig/home", json!({}));
        let state = self.until_idle();
        assert_eq!(state["stage"]["position_mm"], 0.0, "{state:#}");
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        if let Some(closer) = self.closer.take() {
            closer.wait();
        }
    }
}

pub fn mm(state: &Value) -> f64 {
    state["stage"]["position_mm"].as_f64().unwrap_or_else(|| panic!("no position: {state:#}"))
}

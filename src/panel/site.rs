//! The panel as a site: rig, scan and results under one roof.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Arc, PoisonError, RwLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde::Serialize;
use serde_json::Value;

use super::asked::{Done, Id, Jogged, Mm, Named, On, Setting, Short, Show, Signed, Values, taken};
use super::error::PanelError;
use super::rig::{change_profile, controls, profile_form, save_profile, start};
use super::scan::{
    begin_measurement, folder_of, has_target, live_map, plan, sequences, shows_board, why_no_name,
};
use super::shared::{Order, PanelHooks, PictureFeed, Reply as Answered, Shared, StateFeed};
use super::state::{RigState, TaskKind};
use crate::panel::results::{CurrentResults, largest_question};
use crate::profile::Draft;
use epirig_data::sequence::Sequence;
use epirig_devices::camera::SimView;
use epirig_server::{Feed, Query, Refusal, RefusalKind, Reply, Site};

/// What a panel is made of.
pub struct PanelOptions {
    /// The profile of the rig.
    pub draft: Draft,
    /// What a person calls the rig.
    pub source: String,
    /// The file that the profile is saved to.
    pub file: PathBuf,
    /// The folder of the sequences.
    pub folder: PathBuf,
    /// What the program does beside it.
    pub hooks: Box<dyn PanelHooks>,
}

/// The panel of a rig: it owns stage and camera until it is [closed](PanelCloser).
pub struct Panel {
    shared: Arc<Shared>,
    /// The sequence that the results view shows.
    results: RwLock<Option<Arc<CurrentResults>>>,
}

/// Ends a panel.
pub struct PanelCloser {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

/// Asks a panel to end, from any thread.
#[derive(Clone)]
pub struct PanelEnd(Arc<Shared>);

impl PanelEnd {
    /// A scan ends after the frame in hand; the second time the stage is stopped.
    pub fn press(&self) {
        self.0.end();
    }
}

impl PanelCloser {
    /// What asks the panel to end.
    pub fn end(&self) -> PanelEnd {
        PanelEnd(Arc::clone(&self.shared))
    }

    /// Waits until the rig is given up. A scan ends after the frame in hand, and can be resumed.
    pub fn wait(self) {
        if !self.shared.is_ending() {
            self.shared.end();
        }
        for thread in self.threads {
            // A thread that has panicked has told so.
            let _ = thread.join();
        }
    }
}

impl Panel {
    /// Opens the rig in a thread of its own.
    ///
    /// # Errors
    /// [`PanelError::Threads`].
    pub fn open(options: PanelOptions) -> Result<(Self, PanelCloser), PanelError> {
        let PanelOptions { draft, source, file, folder, hooks } = options;
        let shared = Arc::new(Shared::new(draft, source, file, folder, hooks));
        let threads = start(&shared).map_err(PanelError::Threads)?;
        Ok((
            Self { shared: Arc::clone(&shared), results: RwLock::default() },
            PanelCloser { shared, threads },
        ))
    }

    /// Makes the sequence in `folder` the one that the results view shows.
    ///
    /// # Errors
    /// [`PanelError`] if it cannot be read.
    pub fn show_results(&self, folder: &Path) -> Result<(), PanelError> {
        let view = Arc::new(CurrentResults::open(folder, None)?);
        view.read_ahead();
        *self.results.write().unwrap_or_else(PoisonError::into_inner) = Some(view);
        Ok(())
    }

    fn results(&self) -> Result<Arc<CurrentResults>, PanelError> {
        let results = self.results.read().unwrap_or_else(PoisonError::into_inner).clone();
        results.ok_or_else(|| PanelError::NotThere("no sequence is open; choose one in the list".to_owned()))
    }

    /// Begins a task and gives its order to the owner of the rig.
    fn order(&self, kind: TaskKind, words: &str, order: Order) -> Result<Reply, Refusal> {
        if self.shared.begin(kind, words, Some(order)) {
            return done();
        }
        let busy = self.shared.look(|state| state.task.as_ref().map(|task| task.words.clone()));
        let why = match busy {
            Some(words) => format!("the rig is busy ({words}); stop it first"),
            None => "the rig is being stopped; try again when it stands".to_owned(),
        };
        Err(Refusal::new(RefusalKind::Busy, why))
    }

    fn set_control(&self, name: String, value: String) -> Result<Reply, Refusal> {
        if self.shared.look(|state| state.task.is_some()) {
            return Err(Refusal::new(RefusalKind::Busy, "the rig is busy; controls can be set afterwards"));
        }
        let (reply, answer) = Answered::new();
        self.shared.mailbox.put(Order::SetControl { name, value, reply });
        self.wait_for(&answer, "STOP was pressed; the control was not set")?;
        controls(&self.shared)
    }

    /// Uses another profile from now on, once the owner of the rig has taken it.
    fn use_profile(&self, draft: Draft) -> Result<Reply, Refusal> {
        let (reply, answer) = Answered::new();
        let order = Order::Use { draft: Box::new(draft), reply };
        self.order(TaskKind::Connecting, "connecting", order)?;
        self.wait_for(&answer, "STOP was pressed; the profile was not changed")
    }

    /// Waits until the owner of the rig has answered; `forgotten` is said of an order that STOP has taken away.
    fn wait_for(&self, answer: &Receiver<Result<(), String>>, forgotten: &str) -> Result<Reply, Refusal> {
        const PATIENCE: Duration = Duration::from_secs(10);
        match answer.recv_timeout(PATIENCE) {
            Ok(Ok(())) => done(),
            Ok(Err(why)) => Err(Refusal::new(RefusalKind::Wrong, why)),
            Err(RecvTimeoutError::Disconnected) => Err(Refusal::new(RefusalKind::Busy, forgotten)),
            Err(RecvTimeoutError::Timeout) => {
                let why = "the rig is still being connected, and does this afterwards; look again";
                Err(Refusal::new(RefusalKind::Busy, why))
            }
        }
    }

    fn scan(&self, name: String, resumed: bool) -> Result<Reply, Refusal> {
        if resumed {
            Sequence::open(&folder_of(&self.shared, &name)?).map_err(PanelError::from)?;
        } else if let Some(why) = why_no_name(&name) {
            return Err(PanelError::Wrong(why.to_owned()).into());
        }
        // What is missing is said before anything moves.
        plan(&self.shared)?;
        if let Some((what, why)) = self.shared.look(RigState::lost) {
            return Err(Refusal::new(RefusalKind::Busy, format!("the {what} is lost: {why}")));
        }
        let words = format!("scan {name}");
        if self.shared.look(|state| state.task.is_none()) {
            self.shared.renew_pause();
        }
        self.order(TaskKind::Scan, &words, Order::Scan { name, resumed })
    }
}

/// An answer without contents.
fn done() -> Result<Reply, Refusal> {
    Reply::json(&())
}

#[derive(Serialize)]
struct About<'a> {
    program: &'static str,
    version: &'static str,
    mode: &'static str,
    rig: bool,
    sequence: Option<&'a str>,
    results: Option<&'a str>,
}

#[derive(Serialize)]
struct Saved {
    file: String,
}

impl Site for Panel {
    fn get(&self, path: &[&str], query: &Query) -> Result<Reply, Refusal> {
        match path {
            ["about"] => {
                let results = self.results().ok();
                let sequence = results.as_ref().map(|results| results.name());
                let id = results.as_ref().and_then(|results| results.id().ok());
                let version = env!("CARGO_PKG_VERSION");
                let about = About {
                    program: "epirig",
                    version,
                    mode: "ui",
                    rig: true,
                    sequence: sequence.as_deref(),
                    results: id.as_deref(),
                };
                Reply::json(&about)
            }
            ["rig", "state"] => self.shared.look(Reply::json),
            ["rig", "controls"] => controls(&self.shared),
            ["rig", "profile"] => Reply::json(&profile_form(&self.shared)),
            ["scan", "plan"] => Reply::json(&plan(&self.shared)?),
            ["scan", "map"] => {
                let map = self.shared.live_map();
                let map = map.ok_or_else(|| PanelError::NotThere("there is no live map yet".to_owned()))?;
                live_map(&map, query.text("kind").unwrap_or("disparity"))
            }
            ["sequences"] => Reply::json(&sequences(&self.shared)),
            _ => self.results()?.get(path, query),
        }
    }

    fn post(&self, path: &[&str], asked: &Value) -> Result<Reply, Refusal> {
        let shared = &self.shared;
        let client = taken::<Signed>(asked).map(|signed| signed.client);
        match path {
            ["rig", "hello"] => return done(),
            // Whoever has the token may stop the rig.
            ["rig", "stop"] => {
                shared.stop();
                return done();
            }
            ["rig", "take"] => {
                let client = client?;
                shared.control(|controller| controller.takes(&client, Instant::now()));
                return done();
            }
            ["surface"] | ["results", "open"] | ["rig", "profile", "check"] => {}
            _ if shared.may(&client?) => {}
            _ => {
                let why = "another page has control; take control first";
                return Err(Refusal::new(RefusalKind::Forbidden, why));
            }
        }
        match path {
            ["rig", "home"] => self.order(TaskKind::Homing, "homing", Order::Home),
            ["rig", "go"] => {
                let Mm { mm } = taken(asked)?;
                self.order(TaskKind::Moving, "moving", Order::Go { mm })
            }
            ["rig", "step"] => {
                let Mm { mm } = taken(asked)?;
                self.order(TaskKind::Moving, "moving", Order::Step { mm })
            }
            ["rig", "jog"] => {
                let Jogged { id, direction, fast } = taken(asked)?;
                let order = Order::Jog { id, up: direction > 0, fast };
                shared.jog.press(id, Instant::now());
                self.order(TaskKind::Jogging, "moving while held", order)
            }
            ["rig", "keep"] => {
                if shared.jog.keep(taken::<Id>(asked)?.id, Instant::now()) {
                    return done();
                }
                Err(PanelError::NotThere("this motion has ended; press the button again".to_owned()).into())
            }
            ["rig", "release"] => {
                shared.jog.release(taken::<Id>(asked)?.id);
                done()
            }
            ["rig", "control"] => {
                let Setting { name, value } = taken(asked)?;
                self.set_control(name, value)
            }
            ["rig", "reset-peak"] => {
                shared.resets_peak.store(true, Ordering::SeqCst);
                done()
            }
            ["rig", "target"] => {
                let On { on } = taken(asked)?;
                if on && !has_target(shared) {
                    let why = "the profile describes no chess-board: set square, columns and rows in its section \
                               board, or in target";
                    return Err(PanelError::Wrong(why.to_owned()).into());
                }
                shared.cover(|coverage| coverage.clear());
                shared.finds_target.store(on, Ordering::SeqCst);
                done()
            }
            ["rig", "show"] => {
                let Show { what, pose } = taken(asked)?;
                let view = match what.as_str() {
                    "object" => SimView::Scene,
                    "dark" => SimView::Dark,
                    "flat" => SimView::Flat,
                    "board" if !shows_board(shared) => {
                        let why = "the profile describes no chess-board that is held by hand: set square, columns \
                                   and rows in its section board";
                        return Err(PanelError::Wrong(why.to_owned()).into());
                    }
                    "board" => SimView::Board(pose),
                    other => return Err(PanelError::Wrong(format!("\"{other}\" cannot be shown")).into()),
                };
                shared.mailbox.put(Order::Show(view));
                done()
            }
            ["rig", "doctor"] => {
                let Short { short } = taken(asked)?;
                self.order(TaskKind::Doctor, "examining the rig", Order::Examine { short })
            }
            ["rig", "reconnect"] => self.order(TaskKind::Connecting, "connecting", Order::Connect),
            ["rig", "profile", "check"] => {
                let Values { values, .. } = taken(asked)?;
                Reply::json(&change_profile(shared, &values).err().unwrap_or_default())
            }
            ["rig", "profile", "use"] => {
                let Values { values, .. } = taken(asked)?;
                let draft = change_profile(shared, &values).map_err(mistaken)?;
                self.use_profile(draft)
            }
            ["rig", "profile", "save"] => {
                let Values { values, overwrite } = taken(asked)?;
                let draft = change_profile(shared, &values).map_err(mistaken)?;
                save_profile(shared, &draft, overwrite)?;
                Reply::json(&Saved { file: shared.file.display().to_string() })
            }
            ["scan", "start"] => self.scan(taken::<Named>(asked)?.name, false),
            ["scan", "resume"] => self.scan(taken::<Named>(asked)?.name, true),
            ["scan", "pause"] => {
                shared.pause();
                done()
            }
            ["scan", "arranged"] => {
                shared.answer(taken::<Done>(asked)?.done);
                done()
            }
            ["scan", "measure"] => {
                let Named { name } = taken(asked)?;
                begin_measurement(shared, &name, folder_of(shared, &name)?)?;
                done()
            }
            ["results", "open"] => {
                self.show_results(&folder_of(shared, &taken::<Named>(asked)?.name)?)?;
                done()
            }
            _ => self.results()?.post(path, asked),
        }
    }

    fn feed(&self, path: &[&str]) -> Result<Box<dyn Feed>, Refusal> {
        match path {
            ["rig", "state"] => Ok(Box::new(StateFeed::new(Arc::clone(&self.shared), None))),
            // A page that tells its name is there as long as the feed is open.
            ["rig", "state", client] => Ok(Box::new(StateFeed::new(Arc::clone(&self.shared), Some(client)))),
            ["rig", "picture"] => Ok(Box::new(PictureFeed::new(Arc::clone(&self.shared)))),
            _ => Err(Refusal::unknown(path)),
        }
    }

    fn largest_body(&self, path: &[&str]) -> usize {
        largest_question(path)
    }

    fn is_urgent(&self, path: &[&str]) -> bool {
        matches!(path, ["rig", "stop" | "keep" | "release"])
    }

    fn is_open_to_all(&self, path: &[&str]) -> bool {
        // Stopping is nobody's privilege, and a question about results changes nothing.
        matches!(path, ["rig", "stop"] | ["surface"])
    }
}

/// Mistakes in a profile that was to be used.
fn mistaken(mistakes: Vec<super::rig::FormMistake>) -> Refusal {
    let words: Vec<String> = mistakes.into_iter().map(|mistake| mistake.words).collect();
    PanelError::Wrong(words.join("; ")).into()
}

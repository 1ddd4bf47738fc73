//! What the page of a rig may ask and order: a row for each, and its handler.

use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::error::PanelError;
use super::questions::{Answer, Json, Method, OnPage, Question, Questions};
use super::requests::{
    Arranged, ControlValue, Examination, JogButton, JogId, Length, LiveMapQuery, Nothing, ProfileValues,
    SavedValues, SequenceName, Signature, Switched, View,
};
use super::results::{About, ScansQuestion, results_questions};
use super::rig::{Controls, ProfileMistake, change_profile, controls, profile_form, save_profile};
use super::scan::{begin_measurement, has_target, live_map, plan, shows_board, why_no_name};
use super::sequences::{PictureName, folder_of, sequences, trend};
use super::shared::{Order, OrderReply, PictureFeed, StateFeed};
use super::site::Panel;
use super::state::TaskKind;
use epirig_data::sequence::Sequence;
use epirig_devices::camera::SimView;
use epirig_server::{Feed, PostRules, Query, Refusal, RefusalKind, Reply, Site};

/// Bytes of the largest list of names: ten thousand of a hundred letters.
const LARGEST_LIST: usize = 1 << 20;

/// The table.
pub(super) static QUESTIONS: LazyLock<Questions<Panel>> = LazyLock::new(|| {
    let of_rig = vec![
        Question::get("about", |panel, Nothing {}| Ok(Json(about(panel)))),
        Question::get("rig/state", |panel: &Panel, Nothing {}| {
            Ok(Json(panel.shared.look(|state| state.rig.clone())))
        }),
        Question::get("rig/controls", |panel: &Panel, Nothing {}| Ok(Json(controls(&panel.shared)))),
        Question::get("rig/profile", |panel: &Panel, Nothing {}| Ok(Json(profile_form(&panel.shared)))),
        Question::get("scan/plan", |panel: &Panel, Nothing {}| Ok(Json(plan(&panel.shared)?))),
        Question::get("scan/map", |panel: &Panel, LiveMapQuery { kind }| {
            let map = panel.shared.look(|state| state.live_map.clone());
            let map = map.ok_or_else(|| PanelError::NotThere("there is no live map yet".to_owned()))?;
            Ok(live_map(&map, kind.as_deref().unwrap_or("disparity"))?)
        }),
        Question::get("sequences", |panel: &Panel, Nothing {}| {
            Ok(Json(sequences(&panel.shared.folder, &panel.pictures)?))
        }),
        Question::get("sequences/{picture}", |panel: &Panel, PictureName { picture }| {
            Ok(panel.pictures.picture(&picture)?)
        }),
        // They change nothing, and name sequences, which an address cannot.
        Question::post("sequences/trend", |panel: &Panel, asked| {
            Ok(Json(trend(&panel.shared.folder, asked)?))
        })
        .open()
        .up_to(LARGEST_LIST),
        Question::post("sequences/compare", |panel: &Panel, ScansQuestion { of, sequence }| {
            let folder = folder_of(&panel.shared.folder, &sequence)?;
            panel.results()?.compared_with(of.as_deref(), &folder)
        })
        .open(),
        // Whoever has the token may do these; and stopping, whatever it says, is nobody's privilege.
        Question::new(Method::Post, "rig/hello", |_, _| ().reply()),
        Question::new(Method::Post, "rig/stop", |panel: &Panel, _| {
            panel.shared.stop();
            ().reply()
        })
        .open()
        .urgent(),
        Question::post("rig/take", |panel: &Panel, Signature { client }| {
            panel.shared.control(|controller| controller.takes(&client, Instant::now()));
            Ok(())
        }),
        Question::post("rig/profile/check", |panel: &Panel, ProfileValues { values }| {
            Ok(Json(change_profile(&panel.shared, &values).err().unwrap_or_default()))
        }),
        Question::post("results/open", |panel: &Panel, SequenceName { name }| {
            panel.show_results(&folder_of(&panel.shared.folder, &name)?)?;
            Ok(())
        }),
        // All others are for the page that has control.
        order("rig/home", |panel, Nothing {}| panel.begin(TaskKind::Homing, "homing", Order::Home)),
        order("rig/go", |panel, Length { mm }| panel.begin(TaskKind::Moving, "moving", Order::Go { mm })),
        order("rig/step", |panel, Length { mm }| panel.begin(TaskKind::Moving, "moving", Order::Step { mm })),
        order("rig/jog", |panel, JogButton { id, direction, fast }| {
            panel.shared.change(|state| state.jog.press(id, Instant::now()));
            let jog = Order::Jog { id, up: direction > 0, fast };
            panel.begin(TaskKind::Jogging, "moving while held", jog)
        }),
        order("rig/keep", |panel, JogId { id }| {
            if panel.shared.change(|state| state.jog.keep(id, Instant::now())) {
                return Ok(());
            }
            Err(PanelError::NotThere("this motion has ended; press the button again".to_owned()).into())
        })
        .urgent(),
        order("rig/release", |panel, JogId { id }| {
            panel.shared.change(|state| state.jog.release(id));
            Ok(())
        })
        .urgent(),
        order("rig/control", set_control),
        order("rig/reset-peak", |panel, Nothing {}| {
            panel.shared.change(|state| state.rig.light.as_mut().map(|light| light.focus_peak = 0.0));
            Ok(())
        }),
        order("rig/target", find_target),
        order("rig/show", show),
        order("rig/doctor", |panel, Examination { short }| {
            panel.begin(TaskKind::Doctor, "examining the rig", Order::Examine { short })
        }),
        order("rig/reconnect", |panel, Nothing {}| {
            panel.begin(TaskKind::Connecting, "connecting", Order::Connect)
        }),
        order("rig/profile/use", use_profile),
        order("rig/profile/save", |panel, SavedValues { values, overwrite }| {
            let draft = change_profile(&panel.shared, &values).map_err(mistaken)?;
            save_profile(&panel.shared, &draft, overwrite)?;
            Ok(Json(Saved { file: panel.shared.file.display().to_string() }))
        }),
        order("scan/start", |panel, SequenceName { name }| {
            if let Some(why) = why_no_name(&name) {
                return Err(PanelError::Wrong(why.to_owned()).into());
            }
            scan(panel, name, false)
        }),
        order("scan/resume", |panel, SequenceName { name }| {
            Sequence::open(&folder_of(&panel.shared.folder, &name)?).map_err(PanelError::from)?;
            scan(panel, name, true)
        }),
        order("scan/pause", |panel, Nothing {}| {
            panel.shared.pause();
            Ok(())
        }),
        order("scan/arranged", |panel, Arranged { done }| {
            panel.shared.change(|state| state.answer = Some(done));
            Ok(())
        }),
        order("scan/measure", |panel, SequenceName { name }| {
            begin_measurement(&panel.shared, &name, folder_of(&panel.shared.folder, &name)?)?;
            Ok(())
        }),
    ];
    let of_results = results_questions().map(|row| row.of(|panel: &Panel, _| Ok(panel.results()?)));
    Questions(of_rig.into_iter().chain(of_results).collect())
});

impl Site for Panel {
    fn get(&self, path: &[&str], query: &Query) -> Result<Reply, Refusal> {
        QUESTIONS.get(self, path, query)
    }

    fn post(&self, path: &[&str], asked: &Value) -> Result<Reply, Refusal> {
        QUESTIONS.post(self, path, asked)
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

    fn rules(&self, path: &[&str]) -> PostRules {
        QUESTIONS.rules(path)
    }
}

/// Something that only the page with control may do.
fn order<Q: DeserializeOwned + OnPage, A: Answer>(
    path: &'static str,
    handler: impl Fn(&Panel, Q) -> Result<A, Refusal> + Send + Sync + 'static,
) -> Question<Panel> {
    Question::new(Method::Post, path, move |panel: &Panel, asked| {
        const UNFIT: &str = "this order is not complete";
        let Signature { client } = asked.taken(UNFIT)?;
        if !panel.shared.may(&client) {
            let why = "another page has control; take control first";
            return Err(Refusal::new(RefusalKind::Forbidden, why));
        }
        handler(panel, asked.taken(UNFIT)?)?.reply()
    })
    .typed::<Q, A>()
}

/// Where a profile was saved.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct Saved {
    file: String,
}

fn about(panel: &Panel) -> About {
    let results = panel.results().ok().and_then(|results| results.id().ok());
    About::of("ui", true, panel.shown(), results)
}

impl Panel {
    /// Begins a task and gives its order to the owner of the rig.
    fn begin(&self, kind: TaskKind, words: &str, order: Order) -> Result<(), Refusal> {
        self.shared.begin(kind, words, Some(order)).map_err(|why| Refusal::new(RefusalKind::Busy, why))
    }
}

/// Waits until the owner of the rig has answered; `forgotten` is said of an order that STOP has taken away.
fn wait_for(answer: &Receiver<Result<(), String>>, forgotten: &str) -> Result<(), Refusal> {
    const PATIENCE: Duration = Duration::from_secs(10);
    match answer.recv_timeout(PATIENCE) {
        Ok(done) => done.map_err(|why| Refusal::new(RefusalKind::Wrong, why)),
        Err(RecvTimeoutError::Disconnected) => Err(Refusal::new(RefusalKind::Busy, forgotten)),
        Err(RecvTimeoutError::Timeout) => {
            let why = "the rig is still being connected, and does this afterwards; look again";
            Err(Refusal::new(RefusalKind::Busy, why))
        }
    }
}

fn set_control(panel: &Panel, ControlValue { name, value }: ControlValue) -> Result<Json<Controls>, Refusal> {
    let (reply, answer) = OrderReply::new();
    if !panel.shared.order_if_idle(Order::SetControl { name, value, reply }) {
        return Err(Refusal::new(RefusalKind::Busy, "the rig is busy; controls can be set afterwards"));
    }
    wait_for(&answer, "STOP was pressed; the control was not set")?;
    Ok(Json(controls(&panel.shared)))
}

/// Uses the profile with other values from now on, once the owner of the rig has taken it.
fn use_profile(panel: &Panel, ProfileValues { values }: ProfileValues) -> Result<(), Refusal> {
    change_profile(&panel.shared, &values).map_err(mistaken)?;
    let (reply, answer) = OrderReply::new();
    panel.begin(TaskKind::Connecting, "connecting", Order::Use { values, reply })?;
    wait_for(&answer, "STOP was pressed; the profile was not changed")
}

/// Mistakes in a profile that was to be used.
fn mistaken(mistakes: Vec<ProfileMistake>) -> Refusal {
    let words: Vec<String> = mistakes.into_iter().map(|mistake| mistake.words).collect();
    PanelError::Wrong(words.join("; ")).into()
}

fn find_target(panel: &Panel, Switched { on }: Switched) -> Result<(), Refusal> {
    if on && !has_target(&panel.shared) {
        let why = "the profile describes no chess-board: set square, columns and rows in its section board, or in \
                   target";
        return Err(PanelError::Wrong(why.to_owned()).into());
    }
    panel.shared.change(|state| {
        state.coverage.clear();
        state.finds_target = on;
    });
    Ok(())
}

fn show(panel: &Panel, View { what, pose }: View) -> Result<(), Refusal> {
    let view = match what.as_str() {
        "object" => SimView::Scene,
        "dark" => SimView::Dark,
        "flat" => SimView::Flat,
        "board" if !shows_board(&panel.shared) => {
            let why = "the profile describes no chess-board that is held by hand: set square, columns and rows in \
                       its section board";
            return Err(PanelError::Wrong(why.to_owned()).into());
        }
        "board" => SimView::Board(pose),
        other => return Err(PanelError::Wrong(format!("\"{other}\" cannot be shown")).into()),
    };
    panel.shared.order(Order::Show(view));
    Ok(())
}

fn scan(panel: &Panel, name: String, resumed: bool) -> Result<(), Refusal> {
    // What is missing is said before anything moves.
    plan(&panel.shared)?;
    if let Some((what, why)) = panel.shared.look(|state| state.rig.lost()) {
        return Err(Refusal::new(RefusalKind::Busy, format!("the {what} is lost: {why}")));
    }
    let words = format!("scan {name}");
    panel.begin(TaskKind::Scan, &words, Order::Scan { name, resumed })
}

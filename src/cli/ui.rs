//! `epirig ui`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;

use super::rig::RigArguments;
use super::view::{ListenArgument, tell_links};
use super::{CliError, Talk, interrupt, log};
use crate::panel::{Panel, PanelHooks, PanelOptions};
use crate::profile::Draft;
use epirig_data::sequence::Sequence;
use epirig_devices::stage::StopSwitch;

/// See and control the rig, scan and measure in a browser
///
/// Prints a link. Its page shows the live picture, the stage, a scan with its growing map, and the results.
/// Only who has this link may move or set anything; a second link is for those who only watch. Ctrl-C ends it;
/// a scan ends after the frame in hand.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig ui --rig sim                            no hardware needed
  epirig ui measurements                         the rig of rig.toml; sequences go to this folder
  epirig ui --listen 0.0.0.0:7400                from another machine, with the printed link")]
pub(super) struct Ui {
    /// Folder of the sequences; or a sequence, which is opened
    #[arg(default_value = ".")]
    folder: PathBuf,
    #[command(flatten)]
    listen: ListenArgument,
    #[command(flatten)]
    rig: RigArguments,
}

/// A signal of another epirig stops the stage, and a scan is logged beside its journal.
struct Hooks;

impl PanelHooks for Hooks {
    fn stage_connected(&self, switch: StopSwitch) {
        interrupt::SWITCHES.stops(switch);
    }

    fn scan_begins(&self, folder: &Path, resumed: bool) {
        log::beside(folder, resumed);
    }
}

impl Ui {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        if !self.folder.is_dir() {
            let folder = self.folder.display();
            return Err(CliError::usage(format!("{folder} is no folder; create it first")));
        }
        let (draft, source, file) = self.rig.draft()?;
        let is_sequence = Sequence::open(&self.folder).is_ok();
        let folder = if is_sequence { beside(&self.folder) } else { self.folder.clone() };
        let server = self.listen.server()?;
        let (panel, closer) = Panel::open(PanelOptions {
            draft: in_real_time(draft)?,
            source,
            file: std::path::absolute(&file).unwrap_or(file),
            folder,
            hooks: Box::new(Hooks),
        })?;
        if is_sequence {
            panel.show_results(&self.folder)?;
        }
        let (stop, end) = (server.stop_switch(), closer.end());
        interrupt::calls(move || {
            end.press();
            stop.press();
        });
        tell_links(server.link(), Some(server.watch_link()), talk)?;
        let served = server.run(panel);
        closer.wait();
        served.map_err(CliError::server)
    }
}

/// The folder that holds a sequence.
fn beside(sequence: &Path) -> PathBuf {
    let absolute = std::path::absolute(sequence).unwrap_or_else(|_| sequence.to_owned());
    absolute.parent().map_or(absolute.clone(), Path::to_owned)
}

/// A simulated rig that a person looks at moves as a real one does, unless its profile says otherwise.
fn in_real_time(draft: Draft) -> Result<Draft, CliError> {
    const KEY: &str = "sim.real_time";
    let profile = draft.profile()?;
    let simulated = profile.stage.is_simulated() || profile.camera.is_simulated();
    if !simulated || draft.value_of(KEY).is_some() {
        return Ok(draft);
    }
    Ok(draft.changed(&BTreeMap::from([(KEY.to_owned(), "true".to_owned())])))
}

//! `epirig stage console`: lines to a stage by hand.

use std::io::BufRead as _;
use std::time::Duration;

use clap::Args;
use serde::Serialize;

use super::rig::{Stages, WhichStage};
use super::{CliError, Talk};
use epirig_devices::link::Link;
use epirig_devices::stage::Console as Dialect;

/// The first answer comes within this time; after a reset a board is silent for as long.
const FIRST_ANSWER: Duration = Duration::from_secs(2);
/// After the last answer the line is silent for this time.
const QUIET: Duration = Duration::from_millis(300);
/// A device that never ceases is listened to for no longer.
const LONGEST: Duration = Duration::from_secs(10);

/// Send lines to the stage by hand, such as settings; the answers are printed
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig stage console --driver grbl '$10=1' '$$'       sends two lines, and ends
  epirig stage console --driver grbl                    sends each line that you type; Ctrl-D ends it
  epirig stage console --driver grbl --transcript sent.txt < settings.txt

What is sent by hand may move the stage or change its settings. So the position of a GRBL stage is
not trusted afterwards: home it again. A Zaber stage follows its position itself; home it after
lines that change how it counts, such as set pos. A line that is only ?, ! or ~ acts at once (GRBL).")]
pub(super) struct Console {
    /// Lines to send; without any, those of the standard input
    #[arg(value_name = "LINE")]
    lines: Vec<String>,
    #[command(flatten)]
    stage: WhichStage,
}

impl Console {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let profile = self.stage.profile()?;
        let driver = profile.stage.driver;
        let dialect = driver.console().ok_or_else(|| {
            CliError::usage(format!("the driver {driver} has no lines that can be sent by hand"))
        })?;
        let mut line = Stages::new(&profile, self.stage.transcript(), talk)?.stage.line(dialect.baud)?;
        if let Some(distrust) = dialect.distrust {
            line = distrust(line)?;
            talk.say("the position of the stage is not trusted any more: home it afterwards");
        } else {
            talk.say("the stage follows its position itself; home it after lines that change how it counts");
        }
        let mut exchanges = Vec::new();
        let mut send = |typed: String| exchange(&mut *line, &dialect, typed, talk);
        for typed in &self.lines {
            exchanges.push(send(typed.clone())?);
        }
        if self.lines.is_empty() {
            for typed in std::io::stdin().lock().lines() {
                exchanges.push(send(typed.map_err(CliError::output)?)?);
            }
        }
        // As text, it was printed as it came.
        talk.result(&exchanges, String::new)
    }
}

/// Sends a line, and prints what comes until the line is quiet.
fn exchange(line: &mut dyn Link, dialect: &Dialect, sent: String, talk: &Talk) -> Result<Exchange, CliError> {
    match sent.as_bytes() {
        [byte] if dialect.real_time.contains(byte) => line.send(&[*byte])?,
        bytes => line.send(&[bytes, b"\n"].concat())?,
    }
    let (mut heard, mut buffer, mut patience) = (Vec::new(), [0; 256], FIRST_ANSWER);
    let until = line.now() + LONGEST;
    loop {
        let count = line.receive(&mut buffer, patience)?;
        if count == 0 || line.now() > until {
            break;
        }
        heard.extend_from_slice(&buffer[..count]);
        patience = QUIET;
    }
    let text = String::from_utf8_lossy(&heard);
    let answers: Vec<String> = text.lines().filter(|line| !line.is_empty()).map(str::to_owned).collect();
    talk.text(|| {
        let nothing = if answers.is_empty() { "(no answer)\n" } else { "" };
        let lines: String = answers.iter().map(|answer| format!("{answer}\n")).collect();
        format!("> {sent}\n{lines}{nothing}")
    })?;
    Ok(Exchange { sent, answers })
}

#[derive(Serialize)]
struct Exchange {
    sent: String,
    answers: Vec<String>,
}

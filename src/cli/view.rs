//! `epirig view`.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::{CliError, Talk, interrupt};
use crate::panel::CurrentResults;
use epirig_server::{Server, ServerOptions};

/// Look at a sequence and its results in a browser
///
/// Prints a link. Its page shows maps, frames, and for every pixel the line in its epipolar plane image that
/// its number comes from. Nothing is changed. Ctrl-C ends it.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig view seq
  epirig view seq --results look
  epirig view seq --listen 0.0.0.0:7400          from another machine, with the printed token")]
pub(super) struct View {
    /// Folder of the sequence
    seq: PathBuf,
    /// Folder of the matcher's results [default: SEQ/results]
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    #[command(flatten)]
    listen: ListenArgument,
}

#[derive(Debug, Args)]
pub(super) struct ListenArgument {
    /// Address and port to listen on; port 0 takes a free one
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:0")]
    listen: SocketAddr,
}

impl ListenArgument {
    pub(super) fn server(&self) -> Result<Server, CliError> {
        let options = ServerOptions { listen: self.listen, ..ServerOptions::default() };
        Server::bind(&options).map_err(CliError::server)
    }
}

/// Where the page is.
#[derive(Serialize)]
struct Serving {
    link: String,
    /// For somebody who only watches, if there is something to control.
    #[serde(skip_serializing_if = "Option::is_none")]
    watch_link: Option<String>,
}

/// Prints the links of a page.
pub(super) fn tell_links(link: String, watch_link: Option<String>, talk: &Talk) -> Result<(), CliError> {
    let serving = Serving { link, watch_link };
    talk.result(&serving, || format!("{}\n", serving.link))?;
    talk.say("open this link in a browser; Ctrl-C ends it");
    if let Some(link) = &serving.watch_link {
        talk.say(&format!("for somebody who only watches: {link}"));
    }
    Ok(())
}

impl View {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let view = CurrentResults::open(&self.seq, self.results.as_deref())?;
        if let Some(reason) = view.unfit() {
            talk.say(&format!("note: {reason}"));
        }
        let server = self.listen.server()?;
        let stop = server.stop_switch();
        interrupt::calls(move || stop.press());
        view.read_ahead();
        tell_links(server.link(), None, talk)?;
        server.run(view).map_err(CliError::server)
    }
}

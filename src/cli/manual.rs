//! `epirig manual`: manual pages, made of the same table as `--help`.

use std::fs;
use std::path::PathBuf;

use clap::builder::Resettable;
use clap::{Args, Command, CommandFactory};
use clap_mangen::Man;
use roff::{Roff, bold, roman};
use serde::Serialize;

use super::files::write_new;
use super::{Cli, CliError, Talk};

/// Write manual pages, one for each verb
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig manual --out ~/.cargo/share/man/man1
  epirig manual --out pages && man -l pages/epirig-match.1

A folder that is missing is made. The Debian package brings the pages along.")]
pub(super) struct Manual {
    /// The folder to write to; a page that exists already is refused
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

#[derive(Serialize)]
struct Written {
    folder: String,
    pages: Vec<String>,
}

impl Manual {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        // Nobody wants a page for each `help` that clap adds.
        let mut program = Cli::command().disable_help_subcommand(true);
        program.build();
        let pages = pages(&program, None);
        let taken = pages.iter().map(|page| self.out.join(&page.name)).find(|path| path.exists());
        if let Some(path) = taken {
            let message = format!("{} exists already; remove it, or give another folder", path.display());
            return Err(CliError::usage(message));
        }
        fs::create_dir_all(&self.out).map_err(CliError::file("make", &self.out))?;
        for page in &pages {
            write_new(&self.out.join(&page.name), page.text.as_bytes())?;
        }
        let folder = self.out.display().to_string();
        let written = Written { folder, pages: pages.into_iter().map(|page| page.name).collect() };
        talk.result(&written, || format!("{}: {} pages\n", written.folder, written.pages.len()))
    }
}

#[derive(Clone)]
struct Page {
    name: String,
    text: String,
}

/// The page of a command, and those of all verbs below it.
fn pages(command: &Command, above: Option<&Command>) -> Vec<Page> {
    let verbs = command.get_subcommands().filter(|verb| !verb.is_hide_set());
    let below = verbs.flat_map(|verb| pages(verb, Some(command)));
    std::iter::once(page(command, above)).chain(below).collect()
}

/// The page of one command. `above` is the command that it is a verb of.
fn page(command: &Command, above: Option<&Command>) -> Page {
    let version = concat!("epirig ", env!("CARGO_PKG_VERSION"));
    // clap_mangen would fill the lines of the examples into one paragraph. The version stands where others have a date,
    // as an empty date would let the words behind it move up.
    let man = Man::new(command.clone().after_help(Resettable::Reset));
    let man = man.date(version).source("epirig").manual("User Commands");
    let mut text = Vec::new();
    man.render(&mut text).expect("a vector takes all that is written to it");
    let mut text = String::from_utf8_lossy(&text).into_owned();
    if let Some(help) = command.get_after_help() {
        text += &after_options(&help.to_string()).render();
    }
    if let Some(above) = above {
        let name = above.get_display_name().unwrap_or_else(|| above.get_name());
        let mut see = Roff::new();
        see.control("SH", ["SEE ALSO"]).text([bold(name), roman("(1)")]);
        text += &see.to_roff();
    }
    Page { name: man.get_filename(), text }
}

/// What `--help` shows below the options: examples, whose lines stay as they are, and paragraphs, which are filled.
fn after_options(help: &str) -> Roff {
    let mut roff = Roff::new();
    let mut noted = false;
    for paragraph in help.split("\n\n") {
        let mut lines = paragraph.lines().peekable();
        if lines.next_if(|line| matches!(*line, "Example:" | "Examples:")).is_some() {
            roff.control("SH", ["EXAMPLES"]).control("nf", []);
            noted = false;
        } else if noted {
            roff.control("PP", []);
        } else {
            roff.control("SH", ["NOTES"]);
            noted = true;
        }
        for line in lines {
            roff.text([roman(line)]);
        }
        roff.control("fi", []);
    }
    roff
}

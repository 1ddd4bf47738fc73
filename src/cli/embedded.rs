//! Verbs that another program calls, such as a Python interpreter: the same options, records and errors, and
//! nothing is printed. No signal handler and no log is set up; both are the caller's.

use std::any::TypeId;
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::Arc;

use clap::builder::PossibleValue;
use clap::{Arg, ArgAction, Args as _, Command, CommandFactory as _, FromArgMatches};
use serde_json::{Value, json};

use super::failure::code;
use super::match_arguments::MatchArguments;
use super::need::check_match_of;
use super::rig::RigArguments;
use super::{Cli, CliError, Talk, numbers};
use crate::pipeline::{Frames, Held};
use crate::profile::Profile;
use epirig_core::fault::{Blame, Fault};
use epirig_core::progress::Silent;
use epirig_matcher::{DisparityRange, MatchOptions};

pub use super::caller::{CalledFrom, Caller};
pub use super::interrupt::Switches;

/// Why a verb failed.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal {
    /// What happened, where, and what to do: the line that the command line prints.
    pub message: String,
    /// The exit code of the command line.
    pub exit_code: u8,
    /// What the exit code means, as `--json` has it: `usage`, `data`, `device` and so on.
    pub kind: &'static str,
    /// What was measured, or what was found, before the failure.
    pub report: Option<Value>,
}

impl From<CliError> for Refusal {
    fn from(CliError { message, blame, report }: CliError) -> Self {
        let (exit_code, kind) = code(blame);
        Self { message, exit_code, kind, report }
    }
}

impl Refusal {
    /// A failure of which `message` tells.
    pub fn new(blame: Blame, message: impl ToString) -> Self {
        CliError::new(blame, message).into()
    }

    /// Of an error of the library.
    pub fn of(fault: impl Fault) -> Self {
        CliError::from(fault).into()
    }

    fn of_options(error: clap::Error, program: &Command) -> Self {
        let text = numbers::in_words(error, program).render().to_string();
        // What follows, usage and help of a command line, says nothing to a caller.
        let ends = ["\n\nUsage", "\n\nFor more information"].iter().filter_map(|end| text.find(end)).min();
        let message = text[..ends.unwrap_or(text.len())].trim_start_matches("error: ");
        let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
        CliError { message, blame: Blame::Request, report: None }.into()
    }
}

/// What `words` say to `program`, whose name is not among them.
fn parsed<A: FromArgMatches>(
    program: Command,
    words: impl IntoIterator<Item = OsString>,
) -> Result<A, Refusal> {
    let program = program.no_binary_name(true);
    let found = program.clone().try_get_matches_from(words);
    found
        .and_then(|mut found| A::from_arg_matches_mut(&mut found))
        .map_err(|error| Refusal::of_options(error, &program))
}

/// Runs a verb with its options, without the name of the program: `["match", "seq", "--quick"]`. Gives what
/// `--json` prints; null for a verb that prints nothing.
///
/// # Errors
/// [`Refusal`], with the texts of the command line.
pub fn call(words: impl IntoIterator<Item = OsString>, caller: Caller) -> Result<Value, Refusal> {
    let cli = parsed::<Cli>(Cli::command(), words)?;
    let talk = Talk::to_caller(caller);
    let ended = cli.verb.run_logged(&talk).map_err(Refusal::from);
    let told = talk.into_result();
    match ended {
        Ok(()) => Ok(told.unwrap_or(Value::Null)),
        // A verb such as `verify` tells its findings, and fails then.
        Err(refusal) => Err(Refusal { report: refusal.report.or(told), ..refusal }),
    }
}

/// The profile of a rig from the options of `capture`: `["--rig", "sim", "--set", "plan.frames=21"]`.
///
/// # Errors
/// [`Refusal`], with the texts of the command line.
pub fn profile(words: impl IntoIterator<Item = OsString>) -> Result<Profile, Refusal> {
    let program = RigArguments::augment_args(Command::new("rig"));
    Ok(parsed::<RigArguments>(program, words)?.profile()?)
}

/// The matcher's options from those of `match`: `["--method", "normalised"]`.
///
/// # Errors
/// [`Refusal`], with the texts of the command line.
pub fn match_options(words: impl IntoIterator<Item = OsString>) -> Result<MatchOptions, Refusal> {
    let program = MatchArguments::augment_args(Command::new("match"));
    Ok(parsed::<MatchArguments>(program, words)?.options())
}

/// Refuses a match of frames that does not fit into memory, and suggests one that does.
///
/// # Errors
/// [`Refusal`], with the text of the command line.
pub fn refuse_large_match(frames: Frames, options: &MatchOptions) -> Result<(), Refusal> {
    check_match_of(frames, options, Held::InMemory, &Talk::to_caller(Arc::new(Silent))).map_err(Refusal::from)
}

/// All verbs with their options, for those who write them down in another language:
///
/// ```json
/// [{"verb": "match", "help": "...", "options": [
///   {"name": "min_visible", "long": "min-visible", "kind": "number", "default": "0.5", "choices": [],
///    "value": "SHARE", "heading": "Matching", "required": false, "hidden": false, "many": false,
///    "conflicts": [], "help": "..."}]}]
/// ```
///
/// `choices` are objects of `name` and `help`; `long` is null for an argument without a name; `kind` is
/// one of `flag`, `number`, `whole`, `path`, `range` and `text`. `conflicts` are names of options that cannot be given
/// with this one; each pair is named by one of the two, at least.
pub fn verbs() -> Value {
    let program = Cli::command();
    let verb = |verb: &Command| {
        let options = verb.get_arguments().filter(|option| option.get_id() != "help");
        json!({
            "verb": verb.get_name(),
            "help": verb.get_about().map(ToString::to_string),
            "options": options.map(|option| described(verb, option)).collect::<Vec<_>>(),
        })
    };
    program.get_subcommands().map(verb).collect()
}

fn described(verb: &Command, option: &Arg) -> Value {
    let takes_values = option.get_action().takes_values();
    let default = option.get_default_values().first().map(|value| value.to_string_lossy().into_owned());
    let choice = |value: &PossibleValue| {
        let help = value.get_help().map(ToString::to_string);
        json!({ "name": value.get_name(), "help": help })
    };
    let choices = if takes_values { option.get_possible_values() } else { Vec::new() };
    let many = matches!(option.get_action(), ArgAction::Append)
        || option.get_num_args().is_some_and(|range| range.max_values() > 1);
    let conflicts = verb.get_arg_conflicts_with(option);
    let conflicts: Vec<&str> = conflicts.iter().map(|other| other.get_id().as_str()).collect();
    json!({
        "name": option.get_id().as_str(),
        "long": option.get_long(),
        "kind": if takes_values { kind(option) } else { "flag" },
        "default": default.filter(|_| takes_values),
        "choices": choices.iter().map(choice).collect::<Vec<_>>(),
        "value": option.get_value_names().and_then(|names| names.first()).map(|name| name.as_str()),
        "heading": option.get_help_heading(),
        "required": option.is_required_set(),
        "hidden": option.is_hide_set(),
        "many": many,
        "conflicts": conflicts,
        "help": option.get_long_help().or_else(|| option.get_help()).map(ToString::to_string),
    })
}

fn kind(option: &Arg) -> &'static str {
    let value = option.get_value_parser().type_id();
    let is = |types: &[TypeId]| types.iter().any(|of| value == *of);
    match () {
        () if is(&[TypeId::of::<f64>(), TypeId::of::<f32>()]) => "number",
        () if is(&[TypeId::of::<usize>(), TypeId::of::<u64>(), TypeId::of::<u32>(), TypeId::of::<u8>()]) => {
            "whole"
        }
        () if is(&[TypeId::of::<PathBuf>(), TypeId::of::<OsString>()]) => "path",
        () if is(&[TypeId::of::<DisparityRange>()]) => "range",
        () => "text",
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;
    use epirig_core::progress::Progress;

    #[derive(Default)]
    struct Told(Mutex<Vec<String>>);

    impl CalledFrom for Told {}

    impl Progress for Told {
        fn begin(&self, what: &str, _total: u64) {
            self.0.lock().unwrap().push(what.to_owned());
        }
        fn advance(&self, _count: u64) {}
        fn end(&self) {}
        fn note(&self, words: &str) {
            self.0.lock().unwrap().push(words.to_owned());
        }
    }

    fn words(words: &[&str]) -> Vec<OsString> {
        words.iter().map(Into::into).collect()
    }

    #[test]
    fn a_verb_gives_its_record_and_tells_its_caller() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("seq");
        let seq = path.to_str().unwrap();
        let told = Arc::new(Told::default());
        let small = ["--rig", "sim", "--set", "camera.size=128x96", "--frames", "9", "--step-mm", "15"];
        call(words(&[&["capture", "--out", seq][..], &small[..]].concat()), told.clone()).unwrap();
        let found = call(words(&["match", seq]), told.clone()).unwrap();
        assert_eq!(found["settings"]["method"], "variance");
        assert!(path.join("results/disparity.tiff").exists());
        let told = told.0.lock().unwrap();
        assert!(told.iter().any(|line| line == "matching"), "{told:?}");
        let again = call(words(&["match", seq]), Arc::new(Told::default())).unwrap_err();
        assert_eq!((again.exit_code, again.kind), (2, "usage"), "{}", again.message);
    }

    #[test]
    fn options_that_cannot_be_read_are_refused_in_words() {
        let refused = |given: &[&str]| match_options(words(given)).unwrap_err();
        let unknown = refused(&["--methd", "variance"]);
        assert_eq!(unknown.exit_code, 2);
        assert!(unknown.message.starts_with("unexpected argument '--methd' found"), "{}", unknown.message);
        assert!(refused(&["--max-sigma", "x"]).message.contains("write it with a decimal point"));
        let values = "[possible values: variance, normalised, ncc-first, ncc-mean]";
        assert!(refused(&["--method", "x"]).message.ends_with(values));
        assert_eq!(match_options([]).unwrap(), MatchOptions::default());
    }

    #[test]
    fn every_option_of_the_matcher_is_described_with_its_default() {
        let verbs = verbs();
        let of_match = verbs.as_array().unwrap().iter().find(|verb| verb["verb"] == "match").unwrap();
        let options = of_match["options"].as_array().unwrap();
        let find = |name: &str| options.iter().find(|option| option["name"] == name).unwrap();
        assert_eq!(find("quick")["kind"], "flag");
        assert_eq!(
            (&find("min_visible")["kind"], &find("min_visible")["default"]),
            (&json!("number"), &json!("0.5"))
        );
        assert_eq!(find("range")["kind"], "range");
        assert_eq!(find("seq")["required"], true);
        assert_eq!(find("method")["choices"][0]["name"], "variance");
        assert_eq!(find("quick")["conflicts"], json!(["wanted_sigma"]));
    }
}

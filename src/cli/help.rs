//! The help of all verbs: `-h` is a screen, `--help` is all of it.
//!
//! clap prints one text for both unless some part has a long form, and then puts a blank line after each option. So
//! the command is arranged for the one form that is asked for.

use std::ffi::OsString;

use clap::builder::{Resettable, StyledStr};
use clap::{Arg, Command};

/// How much help is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Extent {
    Screen,
    Whole,
}

impl Extent {
    /// What the arguments of the program ask for.
    pub(super) fn asked_for(arguments: impl Iterator<Item = OsString>) -> Self {
        let mut arguments = arguments.skip(1).enumerate();
        let is_whole = arguments.any(|(place, word)| word == "--help" || (place == 0 && word == "help"));
        if is_whole { Self::Whole } else { Self::Screen }
    }
}

/// Most examples on a screen.
const EXAMPLES: usize = 3;
/// The group of options that the screen has, too.
const SHOWN_GROUP: &str = "The rig";

/// `program` and its verbs with the help of this extent. The options that all verbs share are listed by the program
/// alone; the help of a verb names them in one line.
pub(super) fn arranged(program: Command, extent: Extent) -> Command {
    let shared: Vec<Arg> = program.get_arguments().filter(|option| option.is_global_set()).cloned().collect();
    let hidden = || shared.iter().cloned().map(|option| option.hide(true));
    let remark = format!("Every verb also has {}: see `epirig --help`.", names(&shared));
    let program = program.mut_subcommands(|verb| of_verb(verb.args(hidden()), "epirig", extent, &remark));
    let after = after(&program);
    match extent {
        Extent::Whole => program.after_help(after),
        Extent::Screen => FOR_INSTALLERS
            .into_iter()
            .fold(program, |program, verb| program.mut_subcommand(verb, |verb| verb.hide(true)))
            .help_template(OVERVIEW)
            .after_help(
                "`epirig VERB -h` explains a verb. `epirig --help` has all verbs, exit codes, examples.",
            ),
    }
}

/// The verbs for who installs or packages the program, which the screen does not have.
const FOR_INSTALLERS: [&str; 3] = ["licences", "completions", "manual"];

/// The verbs, without the options of the program.
const OVERVIEW: &str = "{about-with-newline}\n{usage-heading} {usage}\n\n{subcommands}{after-help}";

/// Words that are short, or their first clause.
fn shortened(words: &str) -> String {
    const SHORT: usize = 64;
    const ENDS: [&str; 5] = [". ", ": ", "; ", " [default", " ("];
    let end = ENDS.iter().filter_map(|end| words.find(end)).min().filter(|_| words.len() > SHORT);
    words[..end.unwrap_or(words.len())].to_owned()
}

/// The names of options: `-q, --json`.
fn names(options: &[Arg]) -> String {
    let name = |option: &Arg| {
        let short = option.get_short().map(|letter| format!("-{letter}"));
        let long = option.get_long().map(|word| format!("--{word}"));
        short.into_iter().chain(long).collect::<Vec<_>>().join("/")
    };
    options.iter().map(name).collect::<Vec<_>>().join(", ")
}

fn of_verb(verb: Command, above: &str, extent: Extent, remark: &str) -> Command {
    let name = format!("{above} {}", verb.get_name());
    let verb = verb.mut_subcommands(|verb| of_verb(verb, &name, extent, remark));
    let after = after(&verb);
    match extent {
        Extent::Whole => {
            let about = verb.get_long_about().or_else(|| verb.get_about()).cloned().unwrap_or_default();
            let verb = verb.about(about).long_about(Resettable::Reset).mut_args(whole);
            verb.after_help(format!("{after}\n\n{remark}").trim_start().to_owned())
        }
        Extent::Screen => {
            let groups = left_out(&verb);
            let more = if groups.is_empty() { String::new() } else { format!(" ({groups})") };
            let verb = verb.mut_args(screen);
            let examples = examples(&after);
            let last = format!("All options{more}, and more words: `{name} --help`");
            verb.after_help(format!("{examples}\n\n{last}").trim_start().to_owned())
        }
    }
}

/// An option with all of its words, and those of its values.
fn whole(option: Arg) -> Arg {
    let words =
        option.get_long_help().or_else(|| option.get_help()).map(ToString::to_string).unwrap_or_default();
    let values: Vec<_> =
        option.get_possible_values().into_iter().filter(|value| !value.is_hide_set()).collect();
    let option = option.long_help(Resettable::Reset).hide_short_help(false);
    if values.iter().all(|value| value.get_help().is_none()) {
        return if words.is_empty() { option } else { option.help(words) };
    }
    // clap would put the default behind the last value, and a list of the same names.
    let default = option
        .get_default_values()
        .first()
        .map_or(String::new(), |default| format!(" [default: {}]", default.display()));
    let explained: String = values
        .iter()
        .map(|value| match value.get_help() {
            Some(meaning) => format!("\n- {}: {meaning}", value.get_name()),
            None => format!("\n- {}", value.get_name()),
        })
        .collect();
    option.hide_default_value(true).hide_possible_values(true).help(format!("{words}{default}{explained}"))
}

/// An option on a screen: in one sentence, if it is not left out.
fn screen(option: Arg) -> Arg {
    let is_hidden = is_left_out(&option) || option.is_hide_set();
    let words = option.get_help().map(ToString::to_string).unwrap_or_default();
    let words = shortened(&words);
    let option = option.long_help(Resettable::Reset).hide(is_hidden);
    if words.is_empty() { option } else { option.help(words) }
}

fn is_left_out(option: &Arg) -> bool {
    option.is_hide_short_help_set() || option.get_help_heading().is_some_and(|group| group != SHOWN_GROUP)
}

/// The groups whose options are left out of the screen, in their order.
fn left_out(verb: &Command) -> String {
    let mut groups: Vec<&str> = Vec::new();
    for group in verb.get_arguments().filter(|option| is_left_out(option)).filter_map(Arg::get_help_heading) {
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    groups.join(", ").to_lowercase()
}

/// The text behind the options, filled.
fn after(command: &Command) -> String {
    filled(&command.get_after_help().map(StyledStr::to_string).unwrap_or_default())
}

/// Text whose paragraphs are one line each, for clap to wrap. Lines that are indented, as those of examples, stay.
pub(super) fn filled(text: &str) -> String {
    let mut filled = String::new();
    let mut may_continue = false;
    for line in text.lines() {
        let is_prose = !line.is_empty() && !line.starts_with(' ');
        if !filled.is_empty() {
            filled.push(if may_continue && is_prose { ' ' } else { '\n' });
        }
        filled.push_str(line);
        may_continue = is_prose;
    }
    filled
}

/// The first examples of a text, with their heading. A remark that does not fit behind its command is left out.
fn examples(text: &str) -> String {
    const COLUMNS: usize = 80;
    let mut lines =
        text.split("\n\n").find(|paragraph| paragraph.starts_with("Example")).unwrap_or_default().lines();
    let heading = lines.next().unwrap_or_default();
    let shown: Vec<(&str, &str)> = lines
        .take(EXAMPLES)
        .map(|line| {
            let end = line.trim_start().find("  ").map(|gap| gap + line.len() - line.trim_start().len());
            let (command, remark) = line.split_at(end.unwrap_or(line.len()));
            (command, remark.trim())
        })
        .collect();
    let longest = shown.iter().map(|(command, _)| command.len()).max().unwrap_or_default();
    let line =
        |(command, remark): &(&str, &str)| match remark.is_empty() || longest + 3 + remark.len() > COLUMNS {
            true => format!("\n{command}"),
            false => format!("\n{command:longest$}   {remark}"),
        };
    heading.to_owned() + &shown.iter().map(line).collect::<String>()
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::super::Cli;
    use super::*;

    /// The help of the program and of each verb, with its name, in a terminal of `width` columns.
    fn pages(extent: Extent, width: usize) -> Vec<(String, String)> {
        let mut program = arranged(Cli::command(), extent).term_width(width).disable_help_subcommand(true);
        program.build();
        let mut pages = Vec::new();
        collect(&program, "", &mut pages);
        pages
    }

    fn collect(command: &Command, above: &str, pages: &mut Vec<(String, String)>) {
        let name = format!("{above}{}", command.get_name());
        pages.push((name.clone(), command.clone().render_help().to_string()));
        command.get_subcommands().for_each(|verb| collect(verb, &format!("{name} "), pages));
    }

    /// Column at which the words of a line begin, behind the name of an option or a verb.
    fn columns_of_words(line: &str) -> Vec<usize> {
        let indent = line.len() - line.trim_start().len();
        let behind = line[indent..].match_indices("  ").map(|(gap, _)| {
            let rest = &line[indent + gap..];
            indent + gap + rest.len() - rest.trim_start().len()
        });
        std::iter::once(indent).chain(behind).collect()
    }

    #[test]
    fn lines_are_filled_at_every_width() {
        for width in [60, 80, 100, 140] {
            for extent in [Extent::Screen, Extent::Whole] {
                for (name, page) in pages(extent, width) {
                    let width = width.min(100);
                    let mut behind_options = false;
                    let lines: Vec<&str> = page.lines().collect();
                    for pair in lines.windows(2) {
                        let (line, next) = (pair[0], pair[1]);
                        behind_options |= line.starts_with("Example");
                        let indent = next.len() - next.trim_start().len();
                        let is_list =
                            next.trim_start().starts_with('-') || (behind_options && next.starts_with(' '));
                        let continues = !line.trim().is_empty()
                            && !next.trim().is_empty()
                            && !is_list
                            && !line.ends_with(':')
                            && columns_of_words(line).contains(&indent)
                            // A list of verbs or arguments has names, with words behind them.
                            && !next.trim_start().contains("  ");
                        if continues {
                            let word = next.split_whitespace().next().unwrap_or_default();
                            let fits = line.chars().count() + 1 + word.chars().count() <= width;
                            assert!(!fits, "{name}, {width} columns: {line:?} / {next:?}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn the_short_help_of_every_verb_is_a_screen() {
        let pages = pages(Extent::Screen, 80).into_iter();
        let long: Vec<String> = pages
            .filter(|(_, page)| page.lines().count() > 40)
            .map(|(name, page)| format!("{name}: {} lines\n{page}", page.lines().count()))
            .collect();
        assert!(long.is_empty(), "{}", long.join("\n"));
    }

    #[test]
    fn the_whole_help_has_every_option_and_the_shared_ones_once() {
        let program = Cli::command();
        let shared = ["--json", "--log-file", "--quiet"];
        for (name, page) in pages(Extent::Whole, 80) {
            let is_program = name == program.get_name();
            for option in shared {
                let counts = page.matches(option).count();
                let described = page.lines().any(|line| {
                    line.trim_start().starts_with(option)
                        || line.contains(&format!(", {option}")) && line.starts_with("  ")
                });
                assert_eq!(described, is_program, "{name}: {option}\n{page}");
                assert!(counts > 0, "{name} does not name {option}");
            }
        }
        let page =
            |wanted: &str| pages(Extent::Whole, 80).into_iter().find(|(name, _)| name == wanted).unwrap().1;
        for option in ["--transcript", "--control", "--ordering-constraint", "--anyway", "- ncc-mean:"] {
            assert!(page("epirig run").contains(option), "{option}");
        }
        // What a screen leaves out, too.
        let words: Vec<String> = page("epirig capture").split_whitespace().map(str::to_owned).collect();
        assert!(words.join(" ").contains("A frame counts only with its certificate"));
    }

    #[test]
    fn remarks_of_examples_fit_into_their_line() {
        let text = "Examples:\n  epirig run --out tile                                                  as rig.toml says\n  epirig run --rig sim       no hardware";
        assert_eq!(
            examples(text),
            "Examples:\n  epirig run --out tile   as rig.toml says\n  epirig run --rig sim    no hardware"
        );
        assert_eq!(
            examples(&format!("{text} at all, and nothing else that would have to be bought")).lines().nth(2),
            Some("  epirig run --rig sim")
        );
        assert_eq!(examples("No example."), "");
    }

    #[test]
    fn paragraphs_are_joined_and_lists_are_not() {
        let text =
            "Examples:\n  epirig match seq\n  epirig match seq --quick\n\nOne line\nand the\nnext.\n\nOther.";
        assert_eq!(
            filled(text),
            "Examples:\n  epirig match seq\n  epirig match seq --quick\n\nOne line and the next.\n\nOther."
        );
    }

    #[test]
    fn the_extent_is_that_of_the_arguments() {
        let asked = |words: &[&str]| Extent::asked_for(words.iter().map(OsString::from));
        assert_eq!(asked(&["epirig", "run", "--help"]), Extent::Whole);
        assert_eq!(asked(&["epirig", "help", "run"]), Extent::Whole);
        assert_eq!(asked(&["epirig", "run", "-h"]), Extent::Screen);
        assert_eq!(asked(&["epirig", "import", "help"]), Extent::Screen);
    }
}

//! Colours of the words that say how something went, alike in all verbs and in the errors of the arguments.

use anstream::{AutoStream, ColorChoice, stream::RawStream};
use anstyle::{AnsiColor, Style};

const GOOD: Style = AnsiColor::Green.on_default().bold();
const DOUBTFUL: Style = AnsiColor::Yellow.on_default().bold();
const BAD: Style = AnsiColor::Red.on_default().bold();

/// The words that begin a line, each with its colour.
const WORDS: [(&str, Style); 8] = [
    ("ok ", GOOD),
    ("ready:", GOOD),
    ("WARNING ", DOUBTFUL),
    ("warning:", DOUBTFUL),
    ("? ", DOUBTFUL),
    ("BAD ", BAD),
    ("BAD:", BAD),
    ("error:", BAD),
];

/// Whether `stream` shows colours: a terminal, unless `NO_COLOR` is set.
pub(super) fn shown_by(stream: &impl RawStream) -> bool {
    !matches!(AutoStream::choice(stream), ColorChoice::Never)
}

/// `text` with the first words of its lines coloured.
pub(super) fn coloured(text: &str) -> String {
    let line = |line: &str| match WORDS.iter().find(|(word, _)| line.starts_with(word)) {
        Some((word, style)) => {
            let word = word.trim_end();
            format!("{style}{word}{style:#}{}", &line[word.len()..])
        }
        None => line.to_owned(),
    };
    text.split('\n').map(line).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_words_are_coloured_and_nothing_else() {
        let plain = "ok       stage          answers\nBAD      light          too dark\nokay\n  error: x";
        let shown = coloured(plain);
        assert!(shown.starts_with("\u{1b}[1m\u{1b}[32mok\u{1b}[0m       stage"), "{shown:?}");
        assert!(shown.contains("\u{1b}[1m\u{1b}[31mBAD\u{1b}[0m      light"), "{shown:?}");
        assert!(shown.ends_with("\nokay\n  error: x"));
    }
}

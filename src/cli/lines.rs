//! Text in the width of a terminal: lines break between words, a number stays with its unit, and a command stays
//! whole.

/// Lines of `text` that are longer than `width` columns are broken. What follows is indented to the column
/// where the values of a list begin, if the line has one.
pub(super) fn wrapped(text: &str, width: usize) -> String {
    let mut lines: Vec<String> = Vec::new();
    for line in text.split('\n') {
        if line.chars().count() <= width {
            lines.push(line.to_owned());
        } else {
            lines.extend(broken(line, width));
        }
    }
    lines.join("\n")
}

fn broken(line: &str, width: usize) -> Vec<String> {
    let hanging = hanging(line, width);
    let start: String = line.chars().take_while(|letter| *letter == ' ').collect();
    let mut lines = Vec::new();
    let mut current = start.clone();
    let mut empty = true;
    for (gap, piece) in pieces(line) {
        let needed = current.chars().count() + if empty { 0 } else { gap } + piece.chars().count();
        if !empty && needed > width {
            lines.push(std::mem::replace(&mut current, " ".repeat(hanging)));
        } else if !empty {
            current.push_str(&" ".repeat(gap));
        }
        current.push_str(&piece);
        empty = false;
    }
    lines.push(current);
    lines
}

/// Indent of the lines that follow: where the value of "name      value" begins, if that leaves room; else two
/// columns more than the line.
fn hanging(line: &str, width: usize) -> usize {
    let indent = line.len() - line.trim_start_matches(' ').len();
    let value = line[indent..].find("  ").map(|gap| {
        let behind = &line[indent + gap..];
        indent + gap + behind.len() - behind.trim_start_matches(' ').len()
    });
    value.filter(|&column| 2 * column <= width).unwrap_or(indent + 2)
}

/// What is not broken, each with the number of spaces before it.
fn pieces(line: &str) -> Vec<(usize, String)> {
    let mut pieces: Vec<(usize, String)> = Vec::new();
    let (mut gap, mut in_command) = (0, false);
    for word in line.split(' ') {
        if word.is_empty() {
            gap += 1;
            continue;
        }
        match pieces.last_mut() {
            Some((_, before)) if in_command || belong_together(before, word) => {
                before.push_str(&" ".repeat(gap));
                before.push_str(word);
            }
            _ => pieces.push((gap, word.to_owned())),
        }
        in_command ^= word.matches('`').count() % 2 == 1;
        gap = 1;
    }
    pieces
}

/// Whether two words are one number with its unit, its interval or its other end.
fn belong_together(before: &str, word: &str) -> bool {
    let last = before.rsplit(' ').next().unwrap_or(before);
    let is_number = |text: &str| {
        let number = text.trim_start_matches(['(', '+', '-']);
        number.starts_with(|letter: char| letter.is_ascii_digit())
            && number.ends_with(|letter: char| letter.is_ascii_digit())
    };
    let joins = |text: &str| matches!(text, "+-" | ".." | "x" | "=");
    joins(last) || joins(word) || is_number(last)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn numbers_stay_with_their_units_and_commands_whole() {
        let line = "median disparity   474.0243 px, median sigma 0.0039 px";
        assert_eq!(wrapped(line, 54), line);
        assert_eq!(
            wrapped(line, 50),
            "median disparity   474.0243 px, median sigma\n                   0.0039 px"
        );
        let line = "depth 0.2003 mm +- 0.0012 mm (k = 2.02)";
        assert_eq!(wrapped(line, 26), "depth\n  0.2003 mm +- 0.0012 mm\n  (k = 2.02)");
        let line = "note: run `epirig calibrate tile --overwrite` again";
        assert_eq!(wrapped(line, 40), "note: run\n  `epirig calibrate tile --overwrite`\n  again");
    }

    #[test]
    fn a_long_word_is_not_broken_and_short_lines_stay() {
        assert_eq!(
            wrapped("a/very/long/path/without/spaces to it", 10),
            "a/very/long/path/without/spaces\n  to it"
        );
        assert_eq!(wrapped("short\n\n  also short\n", 12), "short\n\n  also short\n");
    }

    proptest! {
        #[test]
        fn no_word_is_lost_or_changed(text in "[a-z0-9.%` +-]{0,200}", width in 20_usize..100) {
            let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
            prop_assert_eq!(words(&wrapped(&text, width)), words(&text));
        }
    }
}

//! The parts that the sections of a report repeat: tables, and numbers for programs.

use maud::{Markup, Render, html};

/// Something wide, which scrolls by itself on a narrow screen; so it must be reachable by keyboard.
pub(super) fn scroll(label: &str, inside: Markup) -> Markup {
    html! { div.scroll tabindex="0" role="region" aria-label=(label) { (inside) } }
}

/// A table of several columns, whose rows are [`cells`].
pub(super) fn table(caption: &str, head: &[&str], rows: Markup) -> Markup {
    scroll(
        caption,
        html! {
            table.many {
                caption { (caption) }
                thead { tr { @for name in head { th scope="col" { (name) } } } }
                tbody { (rows) }
            }
        },
    )
}

/// A row: its heading, and the other cells.
pub(super) fn cells<const N: usize>(heading: impl Render, others: [&dyn Render; N]) -> Markup {
    html! { tr { th scope="row" { (heading) } @for cell in others { td { (cell) } } } }
}

/// A table of names and values, whose rows are [`pair`]s.
pub(super) fn pairs(caption: &str, rows: Markup) -> Markup {
    html! { table.pairs { caption { (caption) } tbody { (rows) } } }
}

/// A name and its value.
pub(super) fn pair(name: &str, value: impl Render) -> Markup {
    cells(name, [&value])
}

/// A number with its full precision for programs, shown as `shown`.
pub(super) fn data(value: f64, shown: String) -> Markup {
    html! { @if value.is_finite() { data value=(value) { (shown) } } @else { (shown) } }
}

/// `text` as it may stand in a string of a style sheet: letters that mean something there or in HTML stand
/// as their numbers.
pub(super) fn in_style(text: &str) -> String {
    let escaped = |letter: char| match letter {
        ' ' => letter.to_string(),
        letter if letter.is_alphanumeric() => letter.to_string(),
        letter => format!("\\{:x} ", u32::from(letter)),
    };
    text.chars().map(escaped).collect()
}

/// The page without letters that nobody sees, and without those that change the order of others: they could
/// make a name look like another one.
pub(super) fn visible(page: &str) -> String {
    let seen = |letter| match letter {
        '\n' | '\t' => letter,
        '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => char::REPLACEMENT_CHARACTER,
        letter if letter.is_control() => char::REPLACEMENT_CHARACTER,
        letter => letter,
    };
    page.chars().map(seen).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_from_outside_stays_text() {
        let hostile = "<script>alert('x')</script> & \"q\" \u{202e}gpj\u{0}\u{1b}[31m\nend";
        assert_eq!(
            visible(&html! { (hostile) }.into_string()),
            "&lt;script&gt;alert('x')&lt;/script&gt; &amp; &quot;q&quot; \u{fffd}gpj\u{fffd}\u{fffd}[31m\nend"
        );
        let attribute = scroll("\" onerror=\"x", html! {}).into_string();
        assert!(attribute.contains("aria-label=\"&quot; onerror=&quot;x\">"), "{attribute}");
    }

    #[test]
    fn a_string_cannot_end_its_style() {
        let escaped = in_style("a\"; } </style><script> \\");
        assert_eq!(escaped, "a\\22 \\3b  \\7d  \\3c \\2f style\\3e \\3c script\\3e  \\5c ");
    }

    #[test]
    fn tables_name_their_rows_and_columns() {
        let made = table("<Depths>", &["part", "depth"], cells("1", [&"0.2 mm"])).into_string();
        for wanted in [
            "<caption>&lt;Depths&gt;</caption>",
            "<th scope=\"col\">depth</th>",
            "<th scope=\"row\">1</th>",
            "<td>0.2 mm</td>",
        ] {
            assert!(made.contains(wanted), "{wanted} in {made}");
        }
    }

    #[test]
    fn numbers_keep_their_precision_for_programs() {
        assert_eq!(data(0.2, "0.20 mm".to_owned()).into_string(), "<data value=\"0.2\">0.20 mm</data>");
        assert_eq!(data(f64::NAN, "unknown".to_owned()).into_string(), "unknown");
    }
}

//! Markup that text from outside cannot break: it gets in through one door only, escaped.

/// Finished markup. Text becomes markup by [`From`], which escapes it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Markup(String);

impl From<&str> for Markup {
    fn from(text: &str) -> Self {
        let mut escaped = String::with_capacity(text.len());
        for letter in text.chars() {
            match letter {
                '&' => escaped.push_str("&amp;"),
                '<' => escaped.push_str("&lt;"),
                '>' => escaped.push_str("&gt;"),
                '"' => escaped.push_str("&quot;"),
                '\'' => escaped.push_str("&#39;"),
                '\n' | '\t' => escaped.push(' '),
                // Letters that change the order of others could make a name look like another one.
                '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => {
                    escaped.push(char::REPLACEMENT_CHARACTER)
                }
                letter if letter.is_control() => escaped.push(char::REPLACEMENT_CHARACTER),
                letter => escaped.push(letter),
            }
        }
        Self(escaped)
    }
}

impl From<String> for Markup {
    fn from(text: String) -> Self {
        text.as_str().into()
    }
}

impl FromIterator<Markup> for Markup {
    fn from_iter<I: IntoIterator<Item = Self>>(parts: I) -> Self {
        Self(parts.into_iter().map(|part| part.0).collect())
    }
}

impl Markup {
    pub(super) fn into_string(self) -> String {
        self.0
    }

    /// A style sheet of our own, which is not escaped.
    pub(super) fn style(sheet: &'static str) -> Self {
        Self(format!("<style>\n{sheet}</style>\n"))
    }

    /// A style sheet that prints `text` at the head of each page. Letters that mean something in a style sheet or in HTML
    /// stand as their numbers.
    pub(super) fn running_head(text: &str) -> Self {
        let escaped: String = text
            .chars()
            .map(|letter| match letter {
                ' ' => letter.to_string(),
                letter if letter.is_alphanumeric() => letter.to_string(),
                letter => format!("\\{:x} ", u32::from(letter)),
            })
            .collect();
        Self(format!("<style>\n@page {{ @top-left {{ content: \"{escaped}\"; }} }}\n</style>\n"))
    }

    /// The whole document.
    pub(super) fn document(head: Self, body: Self) -> Self {
        Self(format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n{}</head>\n<body>\n{}</body>\n</html>\n",
            head.0, body.0
        ))
    }
}

/// Parts one after the other.
pub(super) fn joined(parts: impl IntoIterator<Item = Markup>) -> Markup {
    parts.into_iter().collect()
}

/// An element with attributes, whose values are escaped.
pub(super) fn with(
    tag: &'static str,
    attributes: &[(&'static str, &str)],
    inside: impl Into<Markup>,
) -> Markup {
    Markup(format!("{}{}</{tag}>\n", opening(tag, attributes), inside.into().0))
}

/// An element within a line of text.
pub(super) fn inline(
    tag: &'static str,
    attributes: &[(&'static str, &str)],
    inside: impl Into<Markup>,
) -> Markup {
    Markup(format!("{}{}</{tag}>", opening(tag, attributes), inside.into().0))
}

/// An element without attributes.
pub(super) fn element(tag: &'static str, inside: impl Into<Markup>) -> Markup {
    with(tag, &[], inside)
}

/// An element that holds nothing and is not closed, such as `meta`.
pub(super) fn void(tag: &'static str, attributes: &[(&'static str, &str)]) -> Markup {
    Markup(opening(tag, attributes) + "\n")
}

fn opening(tag: &str, attributes: &[(&str, &str)]) -> String {
    let mut text = format!("<{tag}");
    for (name, value) in attributes {
        text.push_str(&format!(" {name}=\"{}\"", Markup::from(*value).0));
    }
    text + ">"
}

/// A paragraph.
pub(super) fn paragraph(inside: impl Into<Markup>) -> Markup {
    element("p", inside)
}

/// A section with its heading, which a link can lead to.
pub(super) fn section(id: &str, title: &str, inside: Markup) -> Markup {
    let heading = format!("{id}-heading");
    let attributes = [("id", id), ("aria-labelledby", heading.as_str())];
    with("section", &attributes, joined([with("h2", &[("id", &heading)], title), inside]))
}

/// A list; nothing without items.
pub(super) fn list(items: impl IntoIterator<Item = Markup>) -> Markup {
    let items: Vec<Markup> = items.into_iter().map(|item| element("li", item)).collect();
    match items.is_empty() {
        true => Markup::default(),
        false => element("ul", joined(items)),
    }
}

/// A table of several columns; the first cell of each row is its heading. On a narrow screen it scrolls by
/// itself.
pub(super) fn table(caption: &str, head: &[&str], rows: impl IntoIterator<Item = Vec<Markup>>) -> Markup {
    let heads: Markup = head.iter().map(|name| with("th", &[("scope", "col")], *name)).collect();
    let body: Markup = rows
        .into_iter()
        .map(|cells| {
            let cells = cells.into_iter().enumerate().map(|(index, cell)| match index {
                0 => with("th", &[("scope", "row")], cell),
                _ => element("td", cell),
            });
            element("tr", cells.collect::<Markup>())
        })
        .collect();
    let parts = [element("caption", caption), element("thead", element("tr", heads)), element("tbody", body)];
    let table = with("table", &[("class", "many")], joined(parts));
    // A part that scrolls must be reachable by keyboard.
    with("div", &[("class", "scroll"), ("tabindex", "0"), ("role", "region"), ("aria-label", caption)], table)
}

/// A table of names and values.
pub(super) fn pairs<'a>(caption: &str, rows: impl IntoIterator<Item = (&'a str, Markup)>) -> Markup {
    let body: Markup = rows
        .into_iter()
        .map(|(name, value)| {
            element("tr", joined([with("th", &[("scope", "row")], name), element("td", value)]))
        })
        .collect();
    let parts = [element("caption", caption), element("tbody", body)];
    with("table", &[("class", "pairs")], joined(parts))
}

/// A number with its full precision for programs, shown as `shown`.
pub(super) fn data(value: f64, shown: String) -> Markup {
    match value.is_finite() {
        true => inline("data", &[("value", &value.to_string())], shown),
        false => shown.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_from_outside_stays_text() {
        let hostile = "<script>alert('x')</script> & \"q\" \u{202e}gpj\u{0}\u{1b}[31m\nend";
        let escaped = Markup::from(hostile).into_string();
        assert_eq!(
            escaped,
            "&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt; &amp; &quot;q&quot; \u{fffd}gpj\u{fffd}\u{fffd}[31m end"
        );
        let attribute = inline("img", &[("alt", "\" onerror=\"x")], "").into_string();
        assert_eq!(attribute, "<img alt=\"&quot; onerror=&quot;x\"></img>");
        assert_eq!(element("p", Markup::from("a<b")).into_string(), "<p>a&lt;b</p>\n");
    }

    #[test]
    fn a_running_head_cannot_end_its_style() {
        let head = Markup::running_head("a\"; } </style><script> \\").into_string();
        let wanted = "content: \"a\\22 \\3b  \\7d  \\3c \\2f style\\3e \\3c script\\3e  \\5c \"; }";
        assert!(head.contains(wanted), "{head}");
    }

    #[test]
    fn tables_name_their_rows_and_columns() {
        let made = table("<Depths>", &["part", "depth"], [vec!["1".into(), "0.2 mm".into()]]).into_string();
        for wanted in [
            "<caption>&lt;Depths&gt;</caption>",
            "<th scope=\"col\">depth</th>",
            "<th scope=\"row\">1</th>",
            "<td>0.2 mm</td>",
        ] {
            assert!(made.contains(wanted), "{wanted} in {made}");
        }
        assert_eq!(list([]), Markup::default());
    }

    #[test]
    fn numbers_keep_their_precision_for_programs() {
        assert_eq!(data(0.2, "0.20 mm".to_owned()).into_string(), "<data value=\"0.2\">0.20 mm</data>");
        assert_eq!(data(f64::NAN, "unknown".to_owned()).into_string(), "unknown");
    }
}

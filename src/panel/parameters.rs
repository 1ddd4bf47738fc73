//! What the address of a question says, as a type.

use csv::{ErrorKind, StringRecord};
use serde::de::DeserializeOwned;

use epirig_server::{Query, Refusal, RefusalKind};

/// The parts of the path and of the query, by their names: a record of a table with one line.
///
/// # Errors
/// [`Refusal`] if one is missing, is none, or comes twice.
pub(super) fn read<T: DeserializeOwned>(
    named: &[(&'static str, String)],
    query: &Query,
) -> Result<T, Refusal> {
    let of_path = named.iter().map(|(name, text)| (*name, text.as_str()));
    let (names, texts): (StringRecord, StringRecord) = of_path.chain(query.pairs()).unzip();
    texts.deserialize(Some(&names)).map_err(|error| {
        let words = match error.kind() {
            ErrorKind::Deserialize { err, .. } => match err.field().map(|place| place as usize) {
                Some(place) => format!("{}=\"{}\" cannot be used", &names[place], &texts[place]),
                None => err.kind().to_string(),
            },
            _ => error.to_string(),
        };
        Refusal::new(RefusalKind::Wrong, words)
    })
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::*;

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(rename_all = "lowercase")]
    enum Kind {
        Raw,
        Rectified,
    }

    #[derive(Debug, PartialEq, Deserialize)]
    struct Asked {
        level: u32,
        kind: Kind,
        frame: Option<usize>,
    }

    #[test]
    fn what_cannot_be_used_is_named() {
        let ask = |text: &str| read::<Asked>(&[("level", "3".to_owned())], &Query::parse(text));
        let whole = Asked { level: 3, kind: Kind::Rectified, frame: Some(7) };
        assert_eq!(ask("frame=7&kind=rectified"), Ok(whole));
        assert_eq!(ask("kind=raw&frame=").unwrap().frame, None);
        for (text, words) in [
            ("kind=raw&frame=x", "frame=\"x\" cannot be used"),
            ("kind=blue", "unknown variant `blue`, expected `raw` or `rectified`"),
            ("frame=7", "missing field `kind`"),
        ] {
            assert_eq!(ask(text).unwrap_err().message, words);
        }
    }
}

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

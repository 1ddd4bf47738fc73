//! Which images differ from most.

use std::collections::BTreeMap;

use super::super::pixels::{LARGEST_IMAGE, header};
use super::selection::{Chosen, spans_of};
use crate::storage::read_file;

/// Numbers of the images that do not have the size and the depth of most, as `--exclude` takes them. Those that
/// cannot be read are among them.
pub(super) fn unlike_most(images: &[Chosen]) -> String {
    let facts = |image: &Chosen| {
        let bytes = read_file(&image.path, LARGEST_IMAGE).ok()?;
        let header = header(&bytes).ok()?;
        Some((header.rows, header.columns, header.bits))
    };
    let mut kinds: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for image in images {
        kinds.entry(facts(image)).or_default().push(image.number);
    }
    // Of two kinds of which there are as many, the later is meant.
    let most = kinds.values().max_by_key(|numbers| (numbers.len(), std::cmp::Reverse(numbers[0]))).cloned();
    let most = most.unwrap_or_default();
    let others = images.iter().map(|image| image.number).filter(|number| !most.contains(number));
    spans_of(&others.collect::<Vec<_>>())
}

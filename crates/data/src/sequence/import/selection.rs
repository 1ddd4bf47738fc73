//! Which of the images are used.

use std::path::PathBuf;

use super::super::error::SequenceError;
use super::listing::Listing;

/// Numbers of images, from the first to the last, both included.
pub type Span = (usize, usize);

/// An image that becomes a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Chosen {
    /// Its number among all images, from 0.
    pub number: usize,
    /// The file.
    pub path: PathBuf,
}

/// The images `frames` of all that are listed, without `exclude`, in their order.
///
/// # Errors
/// [`SequenceError::NoSuchFrames`] if an image of either is not there, [`SequenceError::BackwardsSpan`] if a span ends
/// before it begins.
pub fn choose(
    listing: &Listing,
    frames: Option<Span>,
    exclude: &[Span],
) -> Result<Vec<Chosen>, SequenceError> {
    let all = &listing.images;
    let check = |(first, last): Span, option| match (first <= last, last < all.len()) {
        (true, true) => Ok(()),
        (false, _) => Err(SequenceError::BackwardsSpan { first, last, option }),
        (true, false) => {
            let (path, count) = (listing.place.clone(), all.len());
            Err(SequenceError::NoSuchFrames { path, first, last, count, option })
        }
    };
    let span = frames.unwrap_or((0, all.len().saturating_sub(1)));
    check(span, "--frames")?;
    exclude.iter().try_for_each(|&span| check(span, "--exclude"))?;
    let is_excluded = |number| exclude.iter().any(|&(first, last)| (first..=last).contains(&number));
    let numbers = (span.0..=span.1).filter(|&number| !is_excluded(number));
    Ok(numbers.map(|number| Chosen { number, path: all[number].clone() }).collect())
}

/// Rising numbers as `--exclude` takes them: `3,7..9`.
pub fn spans_of(numbers: &[usize]) -> String {
    let runs = numbers.chunk_by(|a, b| a + 1 == *b);
    let texts = runs.map(|run| match run {
        [first, .., last] => format!("{first}..{last}"),
        _ => run[0].to_string(),
    });
    texts.collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_counted_before_any_is_left_out() {
        let images = (0..10).map(|index| PathBuf::from(format!("{index}.png"))).collect();
        let all = Listing {
            images,
            hidden: Vec::new(),
            place: PathBuf::from("photos"),
            untimed: 0,
            whole: Vec::new(),
        };
        let chosen = |frames, exclude: &[Span]| {
            choose(&all, frames, exclude)
                .map(|images| images.iter().map(|image| image.number).collect::<Vec<_>>())
        };
        assert_eq!(chosen(None, &[(0, 0), (3, 5)]).unwrap(), [1, 2, 6, 7, 8, 9]);
        assert_eq!(chosen(Some((2, 6)), &[(3, 3), (9, 9)]).unwrap(), [2, 4, 5, 6]);
        for (frames, exclude) in [(Some((2, 10)), vec![]), (None, vec![(10, 10)])] {
            assert!(matches!(chosen(frames, &exclude), Err(SequenceError::NoSuchFrames { .. })));
        }
        for (frames, exclude) in [(Some((6, 2)), vec![]), (None, vec![(5, 4)])] {
            assert!(matches!(chosen(frames, &exclude), Err(SequenceError::BackwardsSpan { .. })));
        }
        assert_eq!(spans_of(&[0, 2, 3, 4, 9, 10]), "0,2..4,9..10");
        assert_eq!(spans_of(&[]), "");
    }
}

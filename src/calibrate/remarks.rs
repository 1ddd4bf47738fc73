//! Notes of a calibration for the user.

use epirig_calibration::photometry::{Outcome, Photometry};

/// Notes, and what would improve the calibration.
#[derive(Debug, Default)]
pub(super) struct Remarks {
    pub(super) notes: Vec<String>,
    pub(super) needs: Vec<String>,
}

impl Remarks {
    pub(super) fn of_photometry(&mut self, photometry: &Photometry) {
        for (what, reason) in [
            ("dark level", not_applied(&photometry.dark)),
            ("vignetting", not_applied(&photometry.flat_field)),
            ("defective pixels", not_applied(&photometry.defective_pixels)),
        ] {
            if let Some(reason) = reason {
                self.needs.push(format!("{what} not corrected: {reason}"));
            }
        }
    }
}

/// The first of many things in words, and how many more there are.
pub(crate) fn some_of<T>(list: &[T], words: impl FnMut(&T) -> String) -> String {
    const MOST: usize = 3;
    let some: Vec<String> = list.iter().take(MOST).map(words).collect();
    let more = list.len() - some.len();
    some.join(", ") + &if more > 0 { format!(" and {more} more") } else { String::new() }
}

fn not_applied<T>(outcome: &Outcome<T>) -> Option<&str> {
    match outcome {
        Outcome::NotApplied(reason) => Some(reason),
        Outcome::Applied(_) | Outcome::SwitchedOff => None,
    }
}

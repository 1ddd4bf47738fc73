//! The order of the images, as an option names it.

use epirig_calibration::motion::MotionCheck;
use epirig_data::sequence::import::{Listing, SortOrder};
use epirig_data::sequence::{LARGEST_IMAGE, decode_grey};
use epirig_data::storage::read_file;

use super::super::CliError;

epirig_core::choices! {
    /// What images are sorted by.
    pub enum Sorting {
        /// File names, as people count: frame_9 before frame_10.
        Name = "name",
        /// Times at which they were taken by EXIF; unless all tell it, when the files were last changed.
        Time = "time",
        /// As given; those of one folder or pattern by file names.
        Given = "given",
        /// What they show: each is like the next. Numbers of other options are then those by name.
        Motion = "motion",
    }
}

impl Sorting {
    /// The order in which images are listed.
    pub(super) fn of_files(self) -> SortOrder {
        match self {
            Self::Name | Self::Motion => SortOrder::Name,
            Self::Time => SortOrder::Time,
            Self::Given => SortOrder::Given,
        }
    }
}

/// Puts images in the order of the motion that they show. Those that cannot be read keep the place of the one
/// before: the import tells why.
pub(super) fn sort_by_motion(listing: &mut Listing) -> Result<(), CliError> {
    let mut check = MotionCheck::new(listing.images.len());
    for image in &listing.images {
        let Ok(decoded) = decode_grey(&read_file(image, LARGEST_IMAGE)?) else { return Ok(()) };
        check.look(&decoded.frame);
    }
    let order = check.order();
    if order.len() < listing.images.len() {
        let most = order.len();
        return Err(CliError::usage(format!(
            "--sort motion orders {most} images at most; select some with --frames"
        )));
    }
    listing.images = order.into_iter().map(|place| listing.images[place].clone()).collect();
    Ok(())
}

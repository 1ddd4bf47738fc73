//! The options that choose a part of the picture, shared by the verbs that evaluate maps.

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;

use super::{CliError, Talk};
use crate::results::{Region, read_mask};
use epirig_surface::Rectangle;

/// The part of the picture that counts.
#[derive(Debug, Clone, Args)]
pub(super) struct RegionArguments {
    /// Region of the picture, by two corners in px [default: all of it]
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = four::<usize>, allow_hyphen_values = true)]
    region: Option<[usize; 4]>,
    /// Picture of the same size as the frames, whose pixels above half of full white are used [default: all
    /// of them]. With --region, pixels must lie in both
    #[arg(long, value_name = "FILE")]
    mask: Option<PathBuf>,
}

impl RegionArguments {
    /// The region of frames of `rows` x `columns`.
    pub(super) fn region(&self, rows: usize, columns: usize, talk: &Talk) -> Result<Region, CliError> {
        let rectangle = self.region.map(|[x0, y0, x1, y1]| Rectangle::between((x0, y0), (x1, y1)));
        if rectangle.is_some_and(|rectangle| !rectangle.fits(rows, columns)) {
            return Err(CliError::usage(format!(
                "--region exceeds the picture, whose last pixel is {},{}",
                columns - 1,
                rows - 1
            )));
        }
        let mask = self.mask.as_ref().map(|path| read_mask(path, rows, columns)).transpose()?;
        let region = Region { rectangle, mask }.checked(rows, columns)?;
        if let (Some(mask), Some(path)) = (&region.mask, &self.mask) {
            let lost = mask.conversion.map_or(String::new(), |words| format!(" ({words})"));
            let share = 100.0 * mask.facts.inside_px as f64 / (rows * columns) as f64;
            talk.say(&format!(
                "note: {share:.1} % of the picture are inside the mask {}{lost}",
                path.display()
            ));
        }
        Ok(region)
    }
}

/// Parses four numbers separated by commas.
pub(super) fn four<T: FromStr>(text: &str) -> Result<[T; 4], String> {
    let numbers: Option<Vec<T>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    numbers
        .and_then(|numbers| numbers.try_into().ok())
        .ok_or_else(|| "give two points as X0,Y0,X1,Y1 from 0 on, such as 100,512,900,512".to_owned())
}

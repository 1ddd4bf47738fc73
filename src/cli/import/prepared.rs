//! Images that are found and not yet imported.

use std::path::PathBuf;

use super::super::need::{close_others, refuse_more_than_there_is};
use super::super::{CliError, Talk};
use super::inspection::Inspection;
use super::sorting::{Sorting, sort_by_motion};
use crate::pipeline::{Frames, import_need};
use crate::profile::Profile;
use epirig_calibration::motion::MotionCheck;
use epirig_core::shell::quoted;
use epirig_data::sequence::import::{Chosen, ImportOptions, Imported, Listing, Rotation, import};
use epirig_data::sequence::{Header, LARGEST_IMAGE, header};
use epirig_data::storage::{Scratch, read_file};

/// What becomes of the frames after the import.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::cli) enum Afterwards {
    /// Their motion is told, with what helps, and a person goes on.
    Told,
    /// They are measured at once. What that cures is not told.
    Measured,
}

/// Images that are found, with what is known of them.
pub(in crate::cli) struct Prepared {
    pub(super) out: PathBuf,
    pub(super) profile: Option<Profile>,
    pub(super) options: ImportOptions,
    pub(super) sorting: Sorting,
    pub(super) listing: Listing,
    /// The images that are used.
    pub(super) chosen: Vec<Chosen>,
    /// Frames of a video or an array, which are there as long as this is.
    pub(super) extracted: Option<Scratch>,
}

impl Prepared {
    /// The head of the first image, with the bytes of its file. `None` if it is unreadable, which the import reports.
    fn head(&self) -> Result<Option<(Header, u64)>, CliError> {
        let first = self.options.frames.map_or(0, |(first, _)| first);
        let Some(image) = self.listing.images.get(first) else { return Ok(None) };
        let bytes = read_file(image, LARGEST_IMAGE)?;
        Ok(header(&bytes).ok().map(|head| (head, bytes.len() as u64)))
    }

    /// Memory for the import. All images have the size of the first, or are refused by their headers.
    pub(super) fn check_memory(&self) -> Result<(), CliError> {
        let Some((head, bytes)) = self.head()? else { return Ok(()) };
        let need = import_need(head.rows, head.columns, 2 * bytes) + MotionCheck::need(self.chosen.len());
        refuse_more_than_there_is("importing", need, close_others)
    }

    /// The frames of the sequence as they will be held for matching, once they are calibrated. `None` if the first image is
    /// unreadable, which the import reports.
    pub(in crate::cli) fn frames(&self) -> Result<Option<Frames>, CliError> {
        let Some((head, _)) = self.head()? else { return Ok(None) };
        let (rows, columns) = match self.options.rotate {
            Rotation::None | Rotation::Half => (head.rows, head.columns),
            Rotation::Right | Rotation::Left => (head.columns, head.rows),
        };
        Ok(Some(Frames { count: self.chosen.len(), rows, columns, sample_bytes: 2 }))
    }

    /// Whether the profile or folders of images give anything to calibrate with besides the texture.
    fn has_rig(&self) -> bool {
        let options = &self.options;
        self.has_target() || options.dark.is_some() || options.flat.is_some() || options.board.is_some()
    }

    fn has_target(&self) -> bool {
        self.profile.as_ref().is_some_and(|profile| profile.target.print().is_some())
    }

    /// The command that measures positions by the texture.
    fn measures(&self) -> String {
        let out = quoted(&self.out);
        match self.has_rig() {
            true => format!("epirig calibrate {out} --positions texture"),
            false => format!("epirig measure {out}"),
        }
    }

    /// Imports the images, and tells what they show: the result, and the next command of epirig.
    pub(in crate::cli) fn import(
        mut self,
        afterwards: Afterwards,
        talk: &Talk,
    ) -> Result<(Imported, String), CliError> {
        let count = self.chosen.len();
        if self.sorting == Sorting::Motion {
            // What is chosen is chosen by name.
            self.listing.images = self.chosen.iter().map(|image| image.path.clone()).collect();
            (self.options.frames, self.options.exclude) = (None, Vec::new());
            sort_by_motion(&mut self.listing)?;
        }
        let is_ordered = self.sorting == Sorting::Motion;
        let mut inspection =
            Inspection::new(count, is_ordered, self.measures(), afterwards, self.profile.clone());
        let imported = import(&self.listing, &self.out, &self.options, &mut inspection, talk)?;
        drop(self.extracted.take());
        self.tell(&imported, afterwards, talk);
        let next = self.next(inspection.is_uneven);
        Ok((imported, next))
    }

    fn tell(&self, imported: &Imported, afterwards: Afterwards, talk: &Talk) {
        let Self { options, listing, profile, sorting, .. } = self;
        for note in imported.conversions.iter().chain(&imported.findings) {
            talk.say(&format!("note: {note}"));
        }
        if let Some(found) = &imported.exif_focal_length {
            talk.say(&format!(
                "note: focal length {:.0} px by EXIF ({}); give --focal-length-px if you know better",
                found.px, found.told
            ));
        }
        if listing.untimed > 0 && listing.untimed < listing.images.len() {
            talk.say(&format!(
                "note: {} of {} images do not tell when they were taken, so they are sorted by the times of their files",
                listing.untimed,
                listing.images.len()
            ));
        }
        // Motion may be found from its end.
        if let Some([first, second]) = imported.out_of_time.as_ref().filter(|_| *sorting != Sorting::Motion) {
            let advice = match sorting {
                Sorting::Time => "the times of the files say otherwise",
                _ => "--sort time takes them in the order of their times",
            };
            talk.say(&format!(
                "note: the images are not in the order in which they were taken: {second} follows {first}, and was taken before it; {advice}"
            ));
        }
        if let Some(first) = imported.hidden.first() {
            let count = imported.hidden.len();
            talk.say(&format!("note: {count} hidden file(s) ignored, such as {first}"));
        }
        let has_positions = options.step_mm.is_some() || options.positions.is_some();
        if afterwards == Afterwards::Told {
            self.tell_gaps(imported, has_positions, talk);
        }
        let planned_mm = profile.as_ref().and_then(|profile| profile.plan.step_mm);
        if let Some(step_mm) = planned_mm.filter(|_| !has_positions) {
            talk.say(&format!(
                "note: plan.step of the profile is not used for the images; if they were taken with it, give --step-mm {step_mm}"
            ));
        }
        if options.board.is_some()
            && profile.as_ref().is_none_or(|profile| profile.board.chess_board().is_none())
        {
            talk.say(
                "note: the chess-board of --board is not described; describe it in [board] of a profile (--rig), or import again with --set \
                 board.square=..., board.columns and board.rows",
            );
        }
        if options.lens.is_some() && !has_positions {
            talk.say("note: heights in mm need positions too; give --step-mm or --positions");
        }
    }

    /// Steps that may not be equal, by numbers and names.
    fn tell_gaps(&self, imported: &Imported, has_positions: bool, talk: &Talk) {
        let measures = self.measures();
        if imported.has_gaps && !has_positions {
            talk.say(&format!(
                "note: the images beside one that was left out now count as one step apart; if they are two, give --step-mm or --positions, \
                 or measure the positions with `{measures}`"
            ));
        }
        if let Some(first) = imported.holes.first() {
            let count = imported.holes.len();
            talk.say(&format!(
                "note: {count} name(s) are missing in the numbering, such as {first}: if a frame is missing there, every later one is off by a step; \
                 give --positions then, or measure them with `{measures}`"
            ));
        }
    }

    /// The next command: calibration if there are frames or a target for it, else all that photographs need.
    fn next(&self, is_uneven: bool) -> String {
        let out = quoted(&self.out);
        match (self.has_rig(), is_uneven && !self.has_target()) {
            (false, _) => format!("epirig measure {out}"),
            // A target tells the positions.
            (true, false) => format!("epirig calibrate {out}"),
            (true, true) => self.measures(),
        }
    }
}

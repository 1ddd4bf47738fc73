//! What the images show of the motion, in words that name the images.

use super::super::motion_words;
use super::super::rig::given;
use super::prepared::Afterwards;
use crate::profile::{Profile, ProfileError};
use crate::rig::nominal_lens;
use epirig_calibration::motion::{Doubt, MotionCheck};
use epirig_core::frame::Frame;
use epirig_data::sequence::import::{Chosen, Inspector, spans_of};
use epirig_data::sequence::{ExifFocalLength, NominalLens};

/// Names of images that are told at most.
const MOST_NAMES: usize = 3;

/// Looks at frames while they are imported.
pub(super) struct Inspection {
    check: MotionCheck,
    images: Vec<Chosen>,
    /// Whether the order was found from the motion, so that none is better.
    is_ordered: bool,
    /// The command that measures positions.
    measures: String,
    afterwards: Afterwards,
    /// What is stated of lens and targets.
    profile: Option<Profile>,
    /// Why the focal length of EXIF cannot be added to it.
    lens_refused: Option<String>,
    /// Where the frames are said to stand; `None` if nothing is said.
    places: Option<Vec<f64>>,
    /// Whether they do not stand where they are taken to stand, and it can be measured where they do.
    pub(super) is_uneven: bool,
}

impl Inspection {
    /// An inspection of this number of frames. `measures` is the command that measures positions.
    pub(super) fn new(
        count: usize,
        is_ordered: bool,
        measures: String,
        afterwards: Afterwards,
        profile: Option<Profile>,
    ) -> Self {
        Self {
            check: MotionCheck::new(count),
            images: Vec::new(),
            is_ordered,
            measures,
            afterwards,
            profile,
            lens_refused: None,
            places: Some(Vec::new()),
            is_uneven: false,
        }
    }

    fn name(&self, frame: usize) -> String {
        let image = &self.images[frame];
        format!("image {} ({})", image.number, file_name(image))
    }

    /// Several images: numbers as `--exclude` takes them, and some names.
    fn names(&self, frames: &[usize]) -> (String, String) {
        let numbers: Vec<usize> = frames.iter().map(|&frame| self.images[frame].number).collect();
        let names: Vec<String> =
            frames.iter().take(MOST_NAMES).map(|&frame| file_name(&self.images[frame])).collect();
        let more = if frames.len() > MOST_NAMES { ", ..." } else { "" };
        (spans_of(&numbers), names.join(", ") + more)
    }

    fn words(&self, doubt: &Doubt) -> Option<String> {
        Some(match doubt {
            cured if self.afterwards == Afterwards::Measured && is_cured(cured) => return None,
            Doubt::Foreign(frames) => {
                let (numbers, names) = self.names(frames);
                format!(
                    "{} image(s) do not show what the others show: {numbers} ({names}); `--exclude {numbers}` leaves them out",
                    frames.len()
                )
            }
            Doubt::Still => "nothing moves from the first image to the last: parts with texture stay within a fifth of a pixel; a match \
                             needs images from places along a line"
                .to_owned(),
            Doubt::Disorder(_) if self.is_ordered => return None,
            Doubt::Disorder(order) => {
                let place = (1..order.len()).find(|&place| order[place].abs_diff(order[place - 1]) != 1)?;
                format!(
                    "the images are not in the order of the motion: {} shows the next place after {}; --sort motion puts them in order, and \
                     --sort time may",
                    self.name(order[place]),
                    self.name(order[place - 1])
                )
            }
            Doubt::TurnsRound(frame) => {
                let numbers = self.images.iter().map(|image| image.number);
                let (first, last) = (numbers.clone().min()?, numbers.max()?);
                let turn = self.images[*frame].number;
                let (from, to) = if 2 * turn >= first + last { (first, turn) } else { (turn, last) };
                format!(
                    "the motion turns round at {}: a match needs one direction; `--frames {from}..{to}` takes a part",
                    self.name(*frame)
                )
            }
            other => return motion_words::words(other, &|frame| self.name(frame), &self.measures),
        })
    }
}

impl Inspector for Inspection {
    fn look(&mut self, image: &Chosen, frame: &Frame, position_mm: Option<f64>) {
        self.check.look(frame);
        self.places = self.places.take().zip(position_mm).map(|(mut places, position_mm)| {
            places.push(position_mm);
            places
        });
        self.images.push(image.clone());
    }

    fn lens(&mut self, told: &ExifFocalLength) -> Option<(NominalLens, serde_json::Value)> {
        match with_focal_length(self.profile.take(), told) {
            Ok(profile) => Some((nominal_lens(&profile.optics)?, profile.record())),
            Err(error) => {
                self.lens_refused = Some(format!(
                    "the focal length by EXIF, {:.0} px ({}), is not taken: {error}",
                    told.px, told.told
                ));
                None
            }
        }
    }

    fn findings(&mut self) -> Vec<String> {
        let motion = self.check.motion(self.places.as_deref());
        let has = |is: fn(&Doubt) -> bool| motion.doubts.iter().any(is);
        // Frames that return are refused there.
        self.is_uneven = has(|doubt| matches!(doubt, Doubt::Uneven { .. }))
            && !has(|doubt| matches!(doubt, Doubt::Returns(_)));
        let of_motion = motion.doubts.iter().filter_map(|doubt| self.words(doubt));
        of_motion.chain(self.lens_refused.clone()).collect()
    }
}

/// Lens and targets as stated, with the focal length that the images tell.
fn with_focal_length(stated: Option<Profile>, told: &ExifFocalLength) -> Result<Profile, ProfileError> {
    let percent = 100.0 * told.relative_sigma;
    let changes = [
        given("optics.focal_length_px", "EXIF", Some(told.px)),
        given("optics.focal_length_sigma_percent", "EXIF", Some(percent)),
    ];
    let changes: Vec<_> = changes.into_iter().flatten().collect();
    match stated {
        Some(profile) => profile.of_lens_and_targets()?.changed(&changes),
        None => Profile::read("", "", &changes),
    }
}

/// Whether the measurement from the texture takes care of it: direction and steps of the motion.
fn is_cured(doubt: &Doubt) -> bool {
    matches!(doubt, Doubt::Vertical | Doubt::Oblique { .. } | Doubt::Uneven { .. } | Doubt::Returns(_))
}

fn file_name(image: &Chosen) -> String {
    image.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

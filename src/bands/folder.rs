//! The folder of a plan and its parts.

use std::ops::Range;
use std::path::{Path, PathBuf};

use super::part::{decode, encode};
use super::{BandError, BandPlan, PartFault};
use crate::results::{MaskFacts, Region, encoded_picture, read_mask};
use epirig_core::grid::Grid;
use epirig_data::storage::{
    Disk as _, LARGEST_RECORD, RealDisk, Scratch, hash, is_own_folder, is_scratch, is_there, put_in_place,
    read_file, record_in, recover, write_whole,
};
use epirig_matcher::{Blocks, DisparityMaps, Overview};
use image::GrayImage;

/// Name of the plan in its folder.
const PLAN: &str = "plan.json";
/// Name of the mask of the match there, if it has one.
const MASK: &str = "mask.png";
/// Ending of the names of parts.
const PART: &str = ".part";
/// A part is no larger: the pixels of the largest picture.
const LARGEST_PART: u64 = 1 << 33;

/// The parts of a match in their folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parts {
    folder: PathBuf,
    /// Hash of the plan that they are of.
    plan: String,
}

impl Parts {
    /// The parts in the existing `folder`, which no other match uses.
    pub fn within(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), plan: String::new() }
    }

    fn path(&self, block: usize) -> PathBuf {
        self.folder.join(format!("{block:05}{PART}"))
    }

    /// Writes the `maps` of a block of rows, whose match took `seconds`.
    ///
    /// # Errors
    /// [`BandError::Io`]; there is no part then, or the one that was there.
    pub fn put(
        &self,
        block: usize,
        rows: Range<usize>,
        maps: &DisparityMaps,
        seconds: f64,
    ) -> Result<(), BandError> {
        let path = self.path(block);
        let bytes = encode(&self.plan, rows, maps, seconds);
        // Another process may write the same part: each has a name of its own until it is whole.
        let mut disk = RealDisk;
        let scratch =
            Scratch::inside(&self.folder).map_err(BandError::io("make a folder in", &self.folder))?;
        let new = scratch.path().join("part");
        let written = write_whole(&mut disk, &new, &bytes).and_then(|()| disk.rename(&new, &path));
        written.and_then(|()| disk.sync(&self.folder)).map_err(BandError::io("write", path))
    }

    /// The maps of `block` of `blocks`, and the seconds that their match took.
    ///
    /// # Errors
    /// Why the part is not used.
    pub fn take(
        &self,
        block: usize,
        blocks: &Blocks,
        overview: Option<Overview>,
    ) -> Result<(DisparityMaps, f64), PartFault> {
        let bytes = match read_file(&self.path(block), LARGEST_PART) {
            Ok(bytes) => bytes,
            Err(error) if error.is_missing() => return Err(PartFault::Missing),
            Err(error) => return Err(PartFault::Unreadable(error.to_string())),
        };
        let (maps, seconds) = decode(&bytes, &self.plan, &blocks.answered_rows(block), blocks.columns())?;
        let as_found = overview
            .is_none_or(|overview| (maps.range, maps.ordering) == (overview.range, overview.ordering));
        match maps.reference == blocks.reference() && blocks.suits(maps.range) && as_found {
            true => Ok((maps, seconds)),
            false => Err(PartFault::OtherMatch),
        }
    }
}

/// The plan of a match in bands, in the folder where its parts come to.
#[derive(Debug, Clone, PartialEq)]
pub struct BandFolder {
    plan: BandPlan,
    parts: Parts,
    /// Whether each pixel is inside the mask, if there is one.
    mask: Option<Grid<bool>>,
}

impl BandFolder {
    /// Name of the folder in that of its sequence.
    pub const NAME: &'static str = "bands";

    /// Opens the plan in `folder`.
    ///
    /// # Errors
    /// [`BandError`] if there is none, or it cannot be read.
    pub fn open(folder: &Path) -> Result<Self, BandError> {
        recover(&mut RealDisk, folder).map_err(BandError::io("bring back", folder))?;
        let path = folder.join(PLAN);
        if !is_there(&path).map_err(BandError::io("look at", &path))? {
            return Err(BandError::NoPlan(folder.to_owned()));
        }
        let bytes = read_file(&path, LARGEST_RECORD).map_err(|error| BandError::Record(error.into()))?;
        let parts = Parts { folder: folder.to_owned(), plan: hash(&bytes) };
        let plan: BandPlan = record_in(&path, bytes, BandPlan::FORMAT)?;
        let (rows, columns) = (plan.task.rows, plan.task.columns);
        let read = |_: &MaskFacts| read_mask(&folder.join(MASK), rows, columns);
        let mask = plan.task.mask.as_ref().map(read).transpose()?;
        if mask.as_ref().map(|mask| &mask.facts.blake3) != plan.mask_blake3.as_ref() {
            let reason = "its mask.png is another one than at the survey";
            return Err(BandError::Contradiction { folder: folder.to_owned(), reason });
        }
        Ok(Self { plan, parts, mask: mask.map(|mask| mask.inside) })
    }

    /// Whether a plan of a match may be written into `folder`: nothing is there but what belongs to one, and without
    /// `overwrite` no plan or part.
    ///
    /// # Errors
    /// [`BandError::Taken`] or [`BandError::PartsAlone`].
    pub fn check_free(folder: &Path, overwrite: bool) -> Result<(), BandError> {
        if !is_own_folder(folder).map_err(BandError::io("look at", folder))? {
            return Ok(());
        }
        let look = || BandError::io("look into", folder);
        for entry in std::fs::read_dir(folder).map_err(look())? {
            let name = entry.map_err(look())?.file_name().to_string_lossy().into_owned();
            let is_part = name.ends_with(PART);
            let is_known = is_part
                || name == PLAN
                || name == MASK
                || name.starts_with("slurm-")
                || is_scratch(name.as_ref());
            match () {
                () if !is_known => return Err(BandError::Taken { folder: folder.to_owned(), name }),
                () if is_part && !overwrite => return Err(BandError::PartsAlone(folder.to_owned())),
                () => {}
            }
        }
        Ok(())
    }

    /// Writes a `plan` into `folder`, in place of one that is there with its parts. `mask` tells whether each pixel is
    /// inside, if the plan has a mask.
    ///
    /// # Errors
    /// [`BandError::Io`] if it cannot be written.
    pub fn create(folder: &Path, mut plan: BandPlan, mask: Option<Grid<bool>>) -> Result<Self, BandError> {
        let mut disk = RealDisk;
        let scratch = Scratch::beside(folder)
            .map_err(|(path, source)| BandError::io("make a folder in", path)(source))?;
        let new = scratch.path().join(Self::NAME);
        disk.make_folder(&new).map_err(BandError::io("make the folder", folder))?;
        let mut write = |name: &str, bytes: &[u8]| {
            write_whole(&mut disk, &new.join(name), bytes).map_err(BandError::io("write", folder.join(name)))
        };
        if let Some(mask) = &mask {
            let values = mask.values().iter().map(|&inside| u8::MAX * u8::from(inside)).collect();
            let picture = GrayImage::from_raw(mask.columns() as u32, mask.rows() as u32, values);
            let bytes = encoded_picture(&folder.join(MASK), &picture.unwrap_or_default())?;
            write(MASK, &bytes)?;
            plan.mask_blake3 = Some(hash(&bytes));
        }
        let text = serde_json::to_vec_pretty(&plan).map_err(std::io::Error::other);
        let text = text.map_err(BandError::io("write", folder.join(PLAN)))?;
        write(PLAN, &text)?;
        put_in_place(&mut disk, &new, folder).map_err(BandError::io("put in place", folder))?;
        let parts = Parts { folder: folder.to_owned(), plan: hash(&text) };
        Ok(Self { plan, parts, mask })
    }

    /// The plan.
    pub fn plan(&self) -> &BandPlan {
        &self.plan
    }

    /// Its parts.
    pub fn parts(&self) -> &Parts {
        &self.parts
    }

    /// The part of the picture that is asked for.
    pub fn region(&self) -> Region {
        let task = &self.plan.task;
        let mask = |(facts, inside): (&MaskFacts, &Grid<bool>)| crate::results::Mask {
            inside: inside.clone(),
            facts: facts.clone(),
            conversion: None,
        };
        Region { rectangle: task.region, mask: task.mask.as_ref().zip(self.mask.as_ref()).map(mask) }
    }

    /// The blocks of `band`.
    ///
    /// # Errors
    /// [`BandError::NoSuchBand`].
    pub fn blocks(&self, band: usize) -> Result<Range<usize>, BandError> {
        let bands = &self.plan.task.bands;
        bands.get(band).cloned().ok_or(BandError::NoSuchBand { band, last: bands.len().saturating_sub(1) })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.parts.folder
    }
}

//! The focal length of a photograph, as its EXIF tells.

use exif::{Exif, In, Tag, Value};

/// Relative standard uncertainty of a nominal focal length: it is engraved within some per cent, rounded to 0.1 or
/// 1 mm, and changes with the focus.
const NOMINAL_SIGMA: f64 = 0.03;
/// The same of one that is told for 35 mm film: it is rounded to 1 mm, and cameras differ in which diagonal they take.
const FILM_SIGMA: f64 = 0.05;
/// Diagonal of a frame of 35 mm film, in mm: CIPA DC-004 compares diagonals.
const FILM_DIAGONAL_MM: f64 = 43.27;
/// Pixels are square within this share, and images of one shape have sides in one ratio.
const SAME_SHAPE: f64 = 0.03;
/// A focal length that can be: not less than the first part of the longer side, nor more than the second of the shorter.
const POSSIBLE: (f64, f64) = (0.2, 50.0);
/// Photographs within this share of each other have one focal length.
const SAME: f64 = 0.01;

/// What a camera tells of its focal length.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ToldLength {
    /// Focal length of the lens in mm, with the size of the sensor's pixels.
    LensMm(f64),
    /// Focal length in mm that gives the same view on 35 mm film.
    FilmMm(f64),
}

/// A focal length from EXIF.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ExifFocalLength {
    /// Focal length, in px of the image.
    pub px: f64,
    /// Its relative standard uncertainty.
    pub relative_sigma: f64,
    /// What the camera tells.
    pub told: ToldLength,
}

impl std::fmt::Display for ToldLength {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let rounded = |mm: f64| (100.0 * mm).round() / 100.0;
        match self {
            Self::LensMm(mm) => write!(formatter, "{} mm", rounded(*mm)),
            Self::FilmMm(mm) => write!(formatter, "{} mm on 35 mm film", rounded(*mm)),
        }
    }
}

/// The focal length of an image of `rows` x `columns`, turned or not. `None` if its EXIF does not tell it, or tells
/// what cannot be, or if the image has another shape than the photograph had: then it is a part of it.
pub(in super::super) fn focal_length(
    exif: &Exif,
    (rows, columns): (usize, usize),
) -> Option<ExifFocalLength> {
    let (long, short) = (rows.max(columns) as f64, rows.min(columns) as f64);
    let scale = scale(exif, long, short)?;
    let can_be = |found: &ExifFocalLength| (POSSIBLE.0 * long..=POSSIBLE.1 * short).contains(&found.px);
    let by_pixels = || {
        let mm = rational(exif, Tag::FocalLength)?;
        let px = mm * pixels_per_mm(exif)? * scale;
        Some(ExifFocalLength { px, relative_sigma: NOMINAL_SIGMA, told: ToldLength::LensMm(mm) })
    };
    let by_film = || {
        let mm = f64::from(whole(exif, Tag::FocalLengthIn35mmFilm).filter(|mm| *mm > 0)?);
        let px = mm / FILM_DIAGONAL_MM * long.hypot(short);
        Some(ExifFocalLength { px, relative_sigma: FILM_SIGMA, told: ToldLength::FilmMm(mm) })
    };
    by_pixels().filter(can_be).or_else(|| by_film().filter(can_be))
}

/// Size of the image over that of the photograph it was made of; 1 if that is not told. Programs that turn images
/// leave columns and rows in the tags as they were, so the longer sides are compared.
fn scale(exif: &Exif, long: f64, short: f64) -> Option<f64> {
    let side = |tag| whole(exif, tag).filter(|side| *side > 0).map(f64::from);
    let (Some(columns), Some(rows)) = (side(Tag::PixelXDimension), side(Tag::PixelYDimension)) else {
        return Some(1.0);
    };
    let (by_long, by_short) = (long / columns.max(rows), short / columns.min(rows));
    is_near(by_long, by_short, SAME_SHAPE).then_some(by_long)
}

/// Pixels in a mm of the sensor.
fn pixels_per_mm(exif: &Exif) -> Option<f64> {
    let unit_mm = match whole(exif, Tag::FocalPlaneResolutionUnit) {
        // Inches are the default.
        None | Some(2) => 25.4,
        Some(3) => 10.0,
        Some(4) => 1.0,
        Some(5) => 1e-3,
        Some(_) => return None,
    };
    let resolution = [Tag::FocalPlaneXResolution, Tag::FocalPlaneYResolution].map(|tag| rational(exif, tag));
    let resolution = match resolution {
        [Some(along), Some(across)] if !is_near(along, across, SAME_SHAPE) => return None,
        [along, across] => along.or(across)?,
    };
    Some(resolution / unit_mm)
}

fn is_near(one: f64, other: f64, share: f64) -> bool {
    one.max(other) <= (1.0 + share) * one.min(other)
}

/// A positive number; cameras write 0 or 0/0 where they do not know one.
fn rational(exif: &Exif, tag: Tag) -> Option<f64> {
    let Value::Rational(values) = &exif.get_field(tag, In::PRIMARY)?.value else { return None };
    Some(values.first()?.to_f64()).filter(|value| value.is_finite() && *value > 0.0)
}

fn whole(exif: &Exif, tag: Tag) -> Option<u32> {
    exif.get_field(tag, In::PRIMARY)?.value.get_uint(0)
}

/// The focal lengths of the images of a scan, while they are read.
#[derive(Debug, Default)]
pub(in super::super) struct FocalLengths {
    /// The first that is told ...
    first: Option<(ExifFocalLength, String)>,
    /// ... and the first that is another.
    other: Option<(ExifFocalLength, String)>,
}

impl FocalLengths {
    /// Takes what the image with this name tells.
    pub(in super::super) fn add(&mut self, told: ExifFocalLength, name: String) {
        match &self.first {
            None => self.first = Some((told, name)),
            Some((first, _)) if self.other.is_none() && !is_near(first.px, told.px, SAME) => {
                self.other = Some((told, name));
            }
            Some(_) => {}
        }
    }

    /// The one focal length of all images that tell it; or that there are several, in a sentence. `None` if none is told.
    pub(in super::super) fn agreed(self) -> Option<Result<ExifFocalLength, String>> {
        let (first, first_name) = self.first?;
        let Some((other, other_name)) = self.other else { return Some(Ok(first)) };
        Some(Err(format!(
            "the focal length changes by EXIF, from {} ({first_name}) to {} ({other_name}), {:.0} and {:.0} px: a zoom looks like a pan of the \
             camera, and is not corrected; use images of one focal length (--frames, --exclude)",
            first.told, other.told, first.px, other.px
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::super::exif_of;
    use super::*;

    /// A value of a tag.
    #[derive(Clone, Copy)]
    enum Given {
        Short(u16),
        Long(u32),
        Rational(u32, u32),
    }
    use Given::{Long, Rational, Short};

    const LENGTH: u16 = 0x920a;
    const X_RESOLUTION: u16 = 0xa20e;
    const Y_RESOLUTION: u16 = 0xa20f;
    const UNIT: u16 = 0xa210;
    const FILM: u16 = 0xa405;
    const COLUMNS: u16 = 0xa002;
    const ROWS: u16 = 0xa003;

    /// TIFF with these tags in its Exif table, in one byte order or the other.
    fn tiff(tags: &[(u16, Given)], is_big: bool) -> Vec<u8> {
        let two = |value: u16| if is_big { value.to_be_bytes() } else { value.to_le_bytes() };
        let four = |value: u32| if is_big { value.to_be_bytes() } else { value.to_le_bytes() };
        let mut bytes = if is_big { b"MM\0*\0\0\0\x08".to_vec() } else { b"II*\0\x08\0\0\0".to_vec() };
        // One entry, the place of the second table.
        bytes.extend(two(1));
        bytes.extend([&two(0x8769)[..], &two(4), &four(1), &four(26), &four(0)].concat());
        bytes.extend(two(tags.len() as u16));
        let mut place = 26 + 2 + 12 * tags.len() as u32 + 4;
        let mut values = Vec::new();
        for (tag, given) in tags {
            bytes.extend(two(*tag));
            match given {
                Short(value) => bytes.extend([&two(3)[..], &four(1), &two(*value), &[0, 0]].concat()),
                Long(value) => bytes.extend([&two(4)[..], &four(1), &four(*value)].concat()),
                Rational(above, below) => {
                    bytes.extend([&two(5)[..], &four(1), &four(place)].concat());
                    values.extend([four(*above), four(*below)].concat());
                    place += 8;
                }
            }
        }
        bytes.extend(four(0));
        [bytes, values].concat()
    }

    /// The focal length of an image of 2000 x 3000 with these tags, in both byte orders.
    fn told(tags: &[(u16, Given)]) -> Option<ExifFocalLength> {
        let [big, little] = [true, false].map(|is_big| {
            let exif = exif_of(&tiff(tags, is_big)).unwrap();
            // An image that is turned has the same.
            let found = focal_length(&exif, (2000, 3000));
            assert_eq!(found, focal_length(&exif, (3000, 2000)));
            found
        });
        assert_eq!(big, little);
        big
    }

    fn px(tags: &[(u16, Given)]) -> Option<f64> {
        told(tags).map(|found| found.px)
    }

    fn assert_px(tags: &[(u16, Given)], expected: f64) {
        let found = px(tags).unwrap();
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} px instead of {expected}");
    }

    #[test]
    fn a_lens_of_24_mm_before_pixels_of_6_um_in_each_unit() {
        let length = (LENGTH, Rational(240, 10));
        let found = told(&[length, (X_RESOLUTION, Rational(5000, 3)), (UNIT, Short(3))]).unwrap();
        assert_eq!((found.relative_sigma, found.told), (0.03, ToldLength::LensMm(24.0)));
        assert_eq!(found.told.to_string(), "24 mm");
        assert!((found.px - 4000.0).abs() < 1e-9, "{}", found.px);
        let inches = Rational(254_000, 60);
        assert_px(&[length, (X_RESOLUTION, inches), (UNIT, Short(2))], 4000.0);
        // Inches are meant where no unit is told.
        assert_px(&[length, (X_RESOLUTION, inches)], 4000.0);
        assert_px(&[length, (Y_RESOLUTION, inches)], 4000.0);
        assert_px(&[length, (X_RESOLUTION, Rational(1000, 6)), (UNIT, Short(4))], 4000.0);
        assert_px(&[length, (X_RESOLUTION, Rational(1, 6)), (UNIT, Short(5))], 4000.0);
        for no_length in [1, 6] {
            assert_eq!(px(&[length, (X_RESOLUTION, inches), (UNIT, Short(no_length))]), None);
        }
    }

    #[test]
    fn the_resolution_counts_pixels_of_the_photograph_before_it_was_made_smaller() {
        let tags = [(LENGTH, Rational(24, 1)), (X_RESOLUTION, Rational(5000, 3)), (UNIT, Short(3))];
        let with = |columns, rows| [&tags[..], &[(COLUMNS, columns), (ROWS, rows)]].concat();
        assert_px(&with(Short(3000), Short(2000)), 4000.0);
        assert_px(&with(Long(6000), Long(4000)), 2000.0);
        assert_px(&with(Long(4000), Long(6000)), 2000.0);
        assert_px(&with(Short(0), Short(0)), 4000.0);
        // A part of a square one.
        assert_eq!(px(&with(Long(3000), Long(3000))), None);
    }

    #[test]
    fn the_length_for_35_mm_film_is_by_the_diagonal() {
        let found = told(&[(FILM, Short(28))]).unwrap();
        assert_eq!((found.relative_sigma, found.told), (0.05, ToldLength::FilmMm(28.0)));
        assert_eq!(found.told.to_string(), "28 mm on 35 mm film");
        // The diagonal is 3605.551 px.
        assert!((found.px - 2333.151).abs() < 1e-3, "{}", found.px);
        // The lens says more, if its pixels are known and square.
        let lens = [(LENGTH, Rational(24, 1)), (X_RESOLUTION, Rational(5000, 3))];
        let unit = [(UNIT, Short(3)), (FILM, Short(28))];
        assert_px(&[&lens[..], &unit].concat(), 4000.0);
        let wide = (Y_RESOLUTION, Rational(5200, 3));
        assert_eq!(told(&[&lens[..], &[wide], &unit].concat()), Some(found));
        assert_eq!(told(&[lens[0], unit[1]]), Some(found));
    }

    #[test]
    fn what_cannot_be_is_not_taken() {
        let resolution = [(X_RESOLUTION, Rational(5000, 3)), (UNIT, Short(3))];
        for length in [(0, 0), (0, 1), (24, 0), (3, 1), (1000, 1)] {
            let length = [(LENGTH, Rational(length.0, length.1))];
            assert_eq!(px(&[&length[..], &resolution].concat()), None);
        }
        let length = (LENGTH, Rational(24, 1));
        for resolution in [(0, 0), (0, 3), (5000, 0)] {
            assert_eq!(px(&[length, (X_RESOLUTION, Rational(resolution.0, resolution.1))]), None);
        }
        assert_eq!(px(&[(LENGTH, Short(24)), resolution[0], resolution[1]]), None);
        for film in [0, 1, 2000] {
            assert_eq!(px(&[(FILM, Short(film))]), None);
        }
        assert_eq!(px(&[length]), None);
    }

    #[test]
    fn images_of_one_focal_length_agree() {
        let agreed = |lengths: &[f64]| {
            let mut all = FocalLengths::default();
            for (index, px) in lengths.iter().enumerate() {
                let told = ToldLength::LensMm(px / 100.0);
                all.add(ExifFocalLength { px: *px, relative_sigma: 0.03, told }, format!("{index}.jpg"));
            }
            all.agreed()
        };
        assert_eq!(agreed(&[]), None);
        let found = agreed(&[4000.0, 4030.0, 3970.0]).unwrap().unwrap();
        assert_eq!(found.px, 4000.0);
        let words = agreed(&[2400.0, 2400.0, 3500.0, 2400.0, 5000.0]).unwrap().unwrap_err();
        assert!(words.contains("from 24 mm (0.jpg) to 35 mm (2.jpg), 2400 and 3500 px"), "{words}");
    }
}

//! Supported pixel formats: codes, depths and sizes.

use std::fmt;

use super::FourCc;

/// Storage of samples in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SampleCoding {
    /// One byte each.
    Byte,
    /// 10 bit at the low end of a 16 bit little-endian word.
    Word10,
    /// 12 bit at the low end of a 16 bit little-endian word.
    Word12,
    /// 14 bit at the low end of a 16 bit little-endian word.
    Word14,
    /// A 16 bit little-endian word.
    Word16,
    /// MIPI RAW10: four bytes with the high bits of four samples, then one with their low bits.
    Mipi10,
    /// MIPI RAW12: two bytes with the high bits of two samples, then one with their low bits.
    Mipi12,
    /// MIPI RAW14: four bytes with the high bits of four samples, then three with their low bits.
    Mipi14,
}

/// The numbers of a [`SampleCoding`].
struct Facts {
    bit_depth: u8,
    /// Samples and bytes of a packed group.
    group: (usize, usize),
    /// Deepest first; 16 bit words after 12 bit, because drivers store samples of any depth above 8 in them;
    /// packed after unpacked.
    preference: u8,
}

impl SampleCoding {
    fn facts(self) -> Facts {
        let (bit_depth, group, preference) = match self {
            Self::Byte => (8, (1, 1), 9),
            Self::Word10 => (10, (1, 2), 6),
            Self::Word12 => (12, (1, 2), 2),
            Self::Word14 => (14, (1, 2), 0),
            Self::Word16 => (16, (1, 2), 4),
            Self::Mipi10 => (10, (4, 5), 7),
            Self::Mipi12 => (12, (2, 3), 3),
            Self::Mipi14 => (14, (4, 7), 1),
        };
        Facts { bit_depth, group, preference }
    }
}

/// Size of the chroma after a plane of luma, for U and V together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Chroma {
    /// At half the rows and columns.
    Quarter,
    /// At half the columns.
    Half,
    /// At all rows and columns.
    Full,
}

impl Chroma {
    /// Bytes after the luma plane, with chroma sizes rounded up.
    fn bytes(self, rows: usize, stride: usize) -> usize {
        let both = stride.div_ceil(2).saturating_mul(2);
        match self {
            Self::Quarter => rows.div_ceil(2).saturating_mul(both),
            Self::Half => rows.saturating_mul(both),
            Self::Full => rows.saturating_mul(stride).saturating_mul(2),
        }
    }
}

/// Storage of an image, of which a grey frame is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Storage {
    /// Grey samples.
    Grey(SampleCoding),
    /// Grey samples of 10 bit without gaps, the highest bit first.
    GreyBitPacked10,
    /// Grey samples in 16 bit big-endian words.
    GreyBigEndian16,
    /// Colour images whose luma and chroma alternate; luma comes first, or second.
    InterleavedLuma { first: bool },
    /// Colour images whose luma comes first.
    PlanarLuma(Chroma),
    /// A colour filter mosaic. In the first row of a 2 x 2 cell, green is in this column; in the second row
    /// it is in the other one.
    Bayer { green_column: usize, coding: SampleCoding },
    /// JPEG images; those of `MJPG` may omit the Huffman tables.
    Jpeg,
}

use SampleCoding::{Byte, Mipi10, Mipi12, Mipi14, Word10, Word12, Word14, Word16};

const fn mosaic(green_column: usize, coding: SampleCoding) -> Storage {
    Storage::Bayer { green_column, coding }
}

/// All formats: their codes, as in the kernel's `videodev2.h`, and their storage.
#[rustfmt::skip]
const FORMATS: &[(&[&[u8; 4]], Storage)] = &[
    (&[b"GREY"], Storage::Grey(Byte)),
    (&[b"Y10 "], Storage::Grey(Word10)),
    (&[b"Y12 "], Storage::Grey(Word12)),
    (&[b"Y14 "], Storage::Grey(Word14)),
    (&[b"Y16 "], Storage::Grey(Word16)),
    (&[b"Y10P"], Storage::Grey(Mipi10)),
    (&[b"Y12P"], Storage::Grey(Mipi12)),
    (&[b"Y14P"], Storage::Grey(Mipi14)),
    (&[b"Y10B"], Storage::GreyBitPacked10),
    // Y16-BE: the highest bit marks big-endian.
    (&[b"Y16\xa0"], Storage::GreyBigEndian16),
    (&[b"YUYV", b"YVYU"], Storage::InterleavedLuma { first: true }),
    (&[b"UYVY", b"VYUY"], Storage::InterleavedLuma { first: false }),
    (&[b"NV12", b"NV21", b"YU12", b"YV12"], Storage::PlanarLuma(Chroma::Quarter)),
    (&[b"NV16", b"NV61", b"422P"], Storage::PlanarLuma(Chroma::Half)),
    (&[b"NV24", b"NV42"], Storage::PlanarLuma(Chroma::Full)),
    // Blue green, green red, and red green, green blue; green blue, red green, and green red, blue green.
    (&[b"BA81", b"RGGB"], mosaic(1, Byte)), (&[b"GBRG", b"GRBG"], mosaic(0, Byte)),
    (&[b"BG10", b"RG10"], mosaic(1, Word10)), (&[b"GB10", b"BA10"], mosaic(0, Word10)),
    (&[b"BG12", b"RG12"], mosaic(1, Word12)), (&[b"GB12", b"BA12"], mosaic(0, Word12)),
    (&[b"BG14", b"RG14"], mosaic(1, Word14)), (&[b"GB14", b"GR14"], mosaic(0, Word14)),
    (&[b"BYR2", b"RG16"], mosaic(1, Word16)), (&[b"GB16", b"GR16"], mosaic(0, Word16)),
    (&[b"pBAA", b"pRAA"], mosaic(1, Mipi10)), (&[b"pGAA", b"pgAA"], mosaic(0, Mipi10)),
    (&[b"pBCC", b"pRCC"], mosaic(1, Mipi12)), (&[b"pGCC", b"pgCC"], mosaic(0, Mipi12)),
    (&[b"pBEE", b"pREE"], mosaic(1, Mipi14)), (&[b"pGEE", b"pgEE"], mosaic(0, Mipi14)),
    (&[b"MJPG", b"JPEG"], Storage::Jpeg),
];

/// How a buffer is decoded to a grey frame: a code and its storage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelFormat {
    four_cc: FourCc,
    pub(super) storage: Storage,
}

impl PixelFormat {
    /// All formats, in no particular order.
    pub fn all() -> impl Iterator<Item = Self> {
        let formats = |(codes, storage): &'static (&[&[u8; 4]], Storage)| {
            codes.iter().map(|code| Self { four_cc: FourCc(**code), storage: *storage })
        };
        FORMATS.iter().flat_map(formats)
    }

    /// The format of a code; `None` if it is not supported.
    pub fn from_four_cc(code: FourCc) -> Option<Self> {
        Self::all().find(|format| format.four_cc == code)
    }

    /// Its code.
    pub fn four_cc(self) -> FourCc {
        self.four_cc
    }

    /// Bits of a stored sample, 8 to 16. Words of 16 bit often hold fewer significant bits.
    pub fn bit_depth(self) -> u8 {
        match self.storage {
            Storage::Grey(coding) | Storage::Bayer { coding, .. } => coding.facts().bit_depth,
            Storage::GreyBitPacked10 => 10,
            Storage::GreyBigEndian16 => 16,
            Storage::InterleavedLuma { .. } | Storage::PlanarLuma(_) | Storage::Jpeg => 8,
        }
    }

    /// Rank for measuring, 0 is the best: grey, deepest first (16 bit after 12, because its true depth is
    /// unknown); luma of uncompressed colour; mosaics, whose use must be chosen; JPEG.
    pub fn preference(self) -> u8 {
        match self.storage {
            Storage::Grey(coding) => coding.facts().preference,
            Storage::GreyBigEndian16 => 5,
            Storage::GreyBitPacked10 => 8,
            Storage::InterleavedLuma { .. } => 20,
            Storage::PlanarLuma(_) => 21,
            Storage::Bayer { coding, .. } => 40 + coding.facts().preference,
            Storage::Jpeg => 60,
        }
    }

    /// Whether it is a colour filter mosaic.
    pub fn is_bayer(self) -> bool {
        matches!(self.storage, Storage::Bayer { .. })
    }

    /// Whether compression has altered the samples.
    pub fn is_lossy(self) -> bool {
        self.storage == Storage::Jpeg
    }

    /// Bytes of a row without padding (of luma, if planes follow), in whole packed groups; `None` for
    /// compressed formats.
    pub fn least_stride(self, columns: usize) -> Option<usize> {
        let groups = |(samples, bytes): (usize, usize)| Some(columns.div_ceil(samples).saturating_mul(bytes));
        match self.storage {
            Storage::Grey(coding) | Storage::Bayer { coding, .. } => groups(coding.facts().group),
            Storage::GreyBitPacked10 => Some(columns.saturating_mul(5).div_ceil(4)),
            Storage::GreyBigEndian16 => groups((1, 2)),
            Storage::InterleavedLuma { .. } => groups((2, 4)),
            Storage::PlanarLuma(_) => Some(columns),
            Storage::Jpeg => None,
        }
    }

    /// Bytes of an image of `rows` rows at a distance of `stride` bytes, including the padding of the last
    /// row and the chroma planes, whose sizes are rounded up; `None` for compressed formats.
    pub fn image_bytes(self, rows: usize, stride: usize) -> Option<usize> {
        let luma = rows.saturating_mul(stride);
        match self.storage {
            Storage::PlanarLuma(chroma) => Some(luma.saturating_add(chroma.bytes(rows, stride))),
            Storage::Jpeg => None,
            _ => Some(luma),
        }
    }
}

/// Its code, as in [`FourCc`].
impl fmt::Display for PixelFormat {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.four_cc.fmt(formatter)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    fn format(code: &str) -> PixelFormat {
        PixelFormat::from_four_cc(code.parse().unwrap()).unwrap_or_else(|| panic!("{code} is unknown"))
    }

    #[test]
    fn every_code_means_one_format() {
        let codes: BTreeSet<u32> = PixelFormat::all().map(|format| format.four_cc().to_u32()).collect();
        assert_eq!((codes.len(), PixelFormat::all().count()), (57, 57));
        for one in PixelFormat::all() {
            assert_eq!(PixelFormat::from_four_cc(one.four_cc()), Some(one));
        }
        assert_eq!(PixelFormat::from_four_cc(FourCc(*b"H264")), None);
    }

    #[test]
    fn codes_are_those_of_the_kernels_header() {
        // linux/videodev2.h: V4L2_PIX_FMT_SBGGR8, _SGRBG10, _SBGGR16, _SGRBG12P, _YUV422P, _YVU420.
        for (code, storage) in [
            ("BA81", mosaic(1, Byte)),
            ("BA10", mosaic(0, Word10)),
            ("BYR2", mosaic(1, Word16)),
            ("pgCC", mosaic(0, Mipi12)),
            ("422P", Storage::PlanarLuma(Chroma::Half)),
            ("YV12", Storage::PlanarLuma(Chroma::Quarter)),
            ("Y16-BE", Storage::GreyBigEndian16),
        ] {
            assert_eq!(format(code).storage, storage, "{code}");
        }
    }

    #[test]
    fn sizes_are_those_that_drivers_state() {
        // Bytes per line and image size that the kernel's v4l2_fill_pixfmt gives, or the format's own page.
        for (code, rows, columns, stride, bytes) in [
            ("GREY", 480, 640, 640, 307_200),
            ("Y12", 480, 640, 1280, 614_400),
            ("Y10B", 480, 640, 800, 384_000),
            ("Y10P", 480, 640, 800, 384_000),
            ("Y12P", 480, 640, 960, 460_800),
            ("Y14P", 480, 640, 1120, 537_600),
            ("YUYV", 480, 640, 1280, 614_400),
            ("UYVY", 1, 3, 8, 8),
            ("NV12", 480, 640, 640, 460_800),
            ("NV12", 3, 3, 3, 9 + 2 * 4),
            ("NV16", 480, 640, 640, 614_400),
            ("NV24", 480, 640, 640, 921_600),
            ("YU12", 3, 3, 3, 9 + 2 * 2 * 2),
            ("422P", 3, 3, 3, 9 + 2 * 3 * 2),
            ("pRAA", 480, 640, 800, 384_000),
        ] {
            assert_eq!(format(code).least_stride(columns), Some(stride), "{code}");
            assert_eq!(format(code).image_bytes(rows, stride), Some(bytes), "{code}");
        }
        assert_eq!(format("MJPG").least_stride(640), None);
        assert_eq!(format("MJPG").image_bytes(480, 0), None);
        assert_eq!(format("NV24").image_bytes(usize::MAX, 2), Some(usize::MAX), "no overflow");
    }

    #[test]
    fn what_measures_best_comes_first() {
        let order = ["Y14", "Y12", "Y16", "Y10", "GREY", "YUYV", "NV12", "RG12", "RG16", "RGGB", "MJPG"];
        let ranks: Vec<u8> = order.map(|code| format(code).preference()).to_vec();
        assert!(ranks.is_sorted_by(|a, b| a < b), "{ranks:?}");
        assert!(format("BA81").is_bayer() && !format("GREY").is_bayer());
        assert!(format("JPEG").is_lossy() && !format("NV12").is_lossy());
    }
}

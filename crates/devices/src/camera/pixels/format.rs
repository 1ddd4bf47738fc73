//! Supported pixel formats: codes, depths and sizes.

use std::fmt;

use super::FourCc;

/// Storage of samples in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SampleCoding {
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

impl SampleCoding {
    const ALL: [Self; 8] = [
        Self::Byte,
        Self::Word10,
        Self::Word12,
        Self::Word14,
        Self::Word16,
        Self::Mipi10,
        Self::Mipi12,
        Self::Mipi14,
    ];

    fn bit_depth(self) -> u8 {
        match self {
            Self::Byte => 8,
            Self::Word10 | Self::Mipi10 => 10,
            Self::Word12 | Self::Mipi12 => 12,
            Self::Word14 | Self::Mipi14 => 14,
            Self::Word16 => 16,
        }
    }

    fn least_stride(self, columns: usize) -> usize {
        let groups = |samples: usize, bytes: usize| columns.div_ceil(samples).saturating_mul(bytes);
        match self {
            Self::Byte => columns,
            Self::Word10 | Self::Word12 | Self::Word14 | Self::Word16 => groups(1, 2),
            Self::Mipi10 => groups(4, 5),
            Self::Mipi12 => groups(2, 3),
            Self::Mipi14 => groups(4, 7),
        }
    }

    /// Deepest first; 16 bit words after 12 bit, because drivers store samples of any depth above 8 in them;
    /// packed after unpacked.
    fn preference(self) -> u8 {
        match self {
            Self::Word14 => 0,
            Self::Mipi14 => 1,
            Self::Word12 => 2,
            Self::Mipi12 => 3,
            Self::Word16 => 4,
            Self::Word10 => 6,
            Self::Mipi10 => 7,
            Self::Byte => 9,
        }
    }
}

/// Order of luma and chroma bytes of a pair of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InterleavedYuv {
    /// Y0 U Y1 V.
    Yuyv,
    /// Y0 V Y1 U.
    Yvyu,
    /// U Y0 V Y1.
    Uyvy,
    /// V Y0 U Y1.
    Vyuy,
}

/// Layout of chroma after the luma plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlanarYuv {
    /// U and V in turn, at half the rows and columns.
    Nv12,
    /// V and U in turn, at half the rows and columns.
    Nv21,
    /// U and V in turn, at half the columns.
    Nv16,
    /// V and U in turn, at half the columns.
    Nv61,
    /// U and V in turn.
    Nv24,
    /// V and U in turn.
    Nv42,
    /// A plane of U and one of V, at half the rows and columns.
    Yu12,
    /// A plane of V and one of U, at half the rows and columns.
    Yv12,
    /// A plane of U and one of V, at half the columns.
    Yuv422P,
}

impl PlanarYuv {
    /// Bytes after the luma plane, with chroma sizes rounded up.
    fn chroma_bytes(self, rows: usize, stride: usize) -> usize {
        let half = rows.div_ceil(2);
        let both = stride.div_ceil(2).saturating_mul(2);
        match self {
            Self::Nv12 | Self::Nv21 | Self::Yu12 | Self::Yv12 => half.saturating_mul(both),
            Self::Nv16 | Self::Nv61 | Self::Yuv422P => rows.saturating_mul(both),
            Self::Nv24 | Self::Nv42 => rows.saturating_mul(stride).saturating_mul(2),
        }
    }
}

/// Colours of the filter mosaic's first 2 x 2 cell, row by row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BayerPattern {
    /// Blue green, green red.
    Bggr,
    /// Green blue, red green.
    Gbrg,
    /// Green red, blue green.
    Grbg,
    /// Red green, green blue.
    Rggb,
}

impl BayerPattern {
    /// Column of the green pixel in the first row of a cell; in the second row it is in the other column.
    pub(super) fn green_column(self) -> usize {
        match self {
            Self::Bggr | Self::Rggb => 1,
            Self::Gbrg | Self::Grbg => 0,
        }
    }
}

/// The code of JPEG images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JpegName {
    /// `MJPG`: may omit the Huffman tables.
    Mjpg,
    /// `JPEG`.
    Jpeg,
}

/// How a buffer is decoded to a grey frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PixelFormat {
    /// Grey samples.
    Grey(SampleCoding),
    /// `Y10B`: grey samples of 10 bit without gaps, the highest bit first.
    GreyBitPacked10,
    /// `Y16-BE`: grey samples in 16 bit big-endian words.
    GreyBigEndian16,
    /// The luma of colour images whose luma and chroma alternate.
    InterleavedLuma(InterleavedYuv),
    /// The luma of colour images whose luma comes first.
    PlanarLuma(PlanarYuv),
    /// A colour filter mosaic.
    Bayer(BayerPattern, SampleCoding),
    /// The luma of JPEG images.
    Jpeg(JpegName),
}

impl PixelFormat {
    /// All formats, in no particular order.
    pub fn all() -> impl Iterator<Item = Self> {
        use BayerPattern::{Bggr, Gbrg, Grbg, Rggb};
        use InterleavedYuv::{Uyvy, Vyuy, Yuyv, Yvyu};
        use PlanarYuv::{Nv12, Nv16, Nv21, Nv24, Nv42, Nv61, Yu12, Yuv422P, Yv12};
        let bayer = [Bggr, Gbrg, Grbg, Rggb]
            .into_iter()
            .flat_map(|pattern| SampleCoding::ALL.map(|coding| Self::Bayer(pattern, coding)));
        [Self::GreyBitPacked10, Self::GreyBigEndian16]
            .into_iter()
            .chain(SampleCoding::ALL.map(Self::Grey))
            .chain([Yuyv, Yvyu, Uyvy, Vyuy].map(Self::InterleavedLuma))
            .chain([Nv12, Nv21, Nv16, Nv61, Nv24, Nv42, Yu12, Yv12, Yuv422P].map(Self::PlanarLuma))
            .chain(bayer)
            .chain([JpegName::Mjpg, JpegName::Jpeg].map(Self::Jpeg))
    }

    /// The format of a code; `None` if it is not supported.
    pub fn from_four_cc(code: FourCc) -> Option<Self> {
        Self::all().find(|format| format.four_cc() == code)
    }

    /// Its code.
    pub fn four_cc(self) -> FourCc {
        use SampleCoding::{Byte, Mipi10, Mipi12, Mipi14, Word10, Word12, Word14, Word16};
        FourCc(*match self {
            Self::Grey(Byte) => b"GREY",
            Self::Grey(Word10) => b"Y10 ",
            Self::Grey(Word12) => b"Y12 ",
            Self::Grey(Word14) => b"Y14 ",
            Self::Grey(Word16) => b"Y16 ",
            Self::Grey(Mipi10) => b"Y10P",
            Self::Grey(Mipi12) => b"Y12P",
            Self::Grey(Mipi14) => b"Y14P",
            Self::GreyBitPacked10 => b"Y10B",
            Self::GreyBigEndian16 => return FourCc(*b"Y16 ").big_endian(),
            Self::InterleavedLuma(InterleavedYuv::Yuyv) => b"YUYV",
            Self::InterleavedLuma(InterleavedYuv::Yvyu) => b"YVYU",
            Self::InterleavedLuma(InterleavedYuv::Uyvy) => b"UYVY",
            Self::InterleavedLuma(InterleavedYuv::Vyuy) => b"VYUY",
            Self::PlanarLuma(PlanarYuv::Nv12) => b"NV12",
            Self::PlanarLuma(PlanarYuv::Nv21) => b"NV21",
            Self::PlanarLuma(PlanarYuv::Nv16) => b"NV16",
            Self::PlanarLuma(PlanarYuv::Nv61) => b"NV61",
            Self::PlanarLuma(PlanarYuv::Nv24) => b"NV24",
            Self::PlanarLuma(PlanarYuv::Nv42) => b"NV42",
            Self::PlanarLuma(PlanarYuv::Yu12) => b"YU12",
            Self::PlanarLuma(PlanarYuv::Yv12) => b"YV12",
            Self::PlanarLuma(PlanarYuv::Yuv422P) => b"422P",
            Self::Bayer(pattern, coding) => {
                let [bggr, gbrg, grbg, rggb] = match coding {
                    Byte => [b"BA81", b"GBRG", b"GRBG", b"RGGB"],
                    Word10 => [b"BG10", b"GB10", b"BA10", b"RG10"],
                    Word12 => [b"BG12", b"GB12", b"BA12", b"RG12"],
                    Word14 => [b"BG14", b"GB14", b"GR14", b"RG14"],
                    Word16 => [b"BYR2", b"GB16", b"GR16", b"RG16"],
                    Mipi10 => [b"pBAA", b"pGAA", b"pgAA", b"pRAA"],
                    Mipi12 => [b"pBCC", b"pGCC", b"pgCC", b"pRCC"],
                    Mipi14 => [b"pBEE", b"pGEE", b"pgEE", b"pREE"],
                };
                match pattern {
                    BayerPattern::Bggr => bggr,
                    BayerPattern::Gbrg => gbrg,
                    BayerPattern::Grbg => grbg,
                    BayerPattern::Rggb => rggb,
                }
            }
            Self::Jpeg(JpegName::Mjpg) => b"MJPG",
            Self::Jpeg(JpegName::Jpeg) => b"JPEG",
        })
    }

    /// Bits of a stored sample, 8 to 16. Words of 16 bit often hold fewer significant bits.
    pub fn bit_depth(self) -> u8 {
        match self {
            Self::Grey(coding) | Self::Bayer(_, coding) => coding.bit_depth(),
            Self::GreyBitPacked10 => 10,
            Self::GreyBigEndian16 => 16,
            Self::InterleavedLuma(_) | Self::PlanarLuma(_) | Self::Jpeg(_) => 8,
        }
    }

    /// Rank for measuring, 0 is the best: grey, deepest first (16 bit after 12, because its true depth is
    /// unknown); luma of uncompressed colour; mosaics, whose use must be chosen; JPEG.
    pub fn preference(self) -> u8 {
        match self {
            Self::Grey(coding) => coding.preference(),
            Self::GreyBigEndian16 => 5,
            Self::GreyBitPacked10 => 8,
            Self::InterleavedLuma(_) => 20,
            Self::PlanarLuma(_) => 21,
            Self::Bayer(_, coding) => 40 + coding.preference(),
            Self::Jpeg(_) => 60,
        }
    }

    /// Whether it is a colour filter mosaic.
    pub fn is_bayer(self) -> bool {
        matches!(self, Self::Bayer(..))
    }

    /// Whether compression has altered the samples.
    pub fn is_lossy(self) -> bool {
        matches!(self, Self::Jpeg(_))
    }

    /// Bytes of a row without padding (of luma, if planes follow), in whole packed groups; `None` for
    /// compressed formats.
    pub fn least_stride(self, columns: usize) -> Option<usize> {
        match self {
            Self::Grey(coding) | Self::Bayer(_, coding) => Some(coding.least_stride(columns)),
            Self::GreyBitPacked10 => Some(columns.saturating_mul(5).div_ceil(4)),
            Self::GreyBigEndian16 => Some(columns.saturating_mul(2)),
            Self::InterleavedLuma(_) => Some(columns.div_ceil(2).saturating_mul(4)),
            Self::PlanarLuma(_) => Some(columns),
            Self::Jpeg(_) => None,
        }
    }

    /// Bytes of an image of `rows` rows at a distance of `stride` bytes, including the padding of the last
    /// row and the chroma planes, whose sizes are rounded up; `None` for compressed formats.
    pub fn image_bytes(self, rows: usize, stride: usize) -> Option<usize> {
        let luma = rows.saturating_mul(stride);
        match self {
            Self::PlanarLuma(planes) => Some(luma.saturating_add(planes.chroma_bytes(rows, stride))),
            Self::Jpeg(_) => None,
            _ => Some(luma),
        }
    }
}

/// Its code, as in [`FourCc`].
impl fmt::Display for PixelFormat {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.four_cc().fmt(formatter)
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
        assert_eq!(codes.len(), PixelFormat::all().count());
        for one in PixelFormat::all() {
            assert_eq!(PixelFormat::from_four_cc(one.four_cc()), Some(one));
        }
        assert_eq!(PixelFormat::from_four_cc(FourCc(*b"H264")), None);
    }

    #[test]
    fn codes_are_those_of_the_kernels_header() {
        // linux/videodev2.h: V4L2_PIX_FMT_SBGGR8, _SGRBG10, _SBGGR16, _SGRBG12P, _YUV422P, _YVU420.
        let bayer = |pattern, coding| PixelFormat::Bayer(pattern, coding);
        assert_eq!(format("BA81"), bayer(BayerPattern::Bggr, SampleCoding::Byte));
        assert_eq!(format("BA10"), bayer(BayerPattern::Grbg, SampleCoding::Word10));
        assert_eq!(format("BYR2"), bayer(BayerPattern::Bggr, SampleCoding::Word16));
        assert_eq!(format("pgCC"), bayer(BayerPattern::Grbg, SampleCoding::Mipi12));
        assert_eq!(format("422P"), PixelFormat::PlanarLuma(PlanarYuv::Yuv422P));
        assert_eq!(format("YV12"), PixelFormat::PlanarLuma(PlanarYuv::Yv12));
        assert_eq!(format("Y16-BE"), PixelFormat::GreyBigEndian16);
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

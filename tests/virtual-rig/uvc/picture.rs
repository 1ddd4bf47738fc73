//! What the camera sends. Every picture names its frame, the place of the stage and its settings, so that
//! whoever receives it can make it again and compare every sample.
//!
//! The stamp lies in the lowest bits of the first samples (of the first blocks in a JPEG image): pictures of
//! one view differ by one grey level there, which is less than any camera's noise.

use epirig_core::frame::{Frame, Samples};

use super::controls::EXPOSURE_DEFAULT;
use super::jpeg;

/// Pixel formats that the camera offers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    Yuyv,
    Grey,
    Y16,
    Mjpg,
}

impl Format {
    pub const ALL: [Self; 4] = [Self::Yuyv, Self::Grey, Self::Y16, Self::Mjpg];

    /// V4L2's name.
    pub fn four_cc(self) -> &'static str {
        match self {
            Self::Yuyv => "YUYV",
            Self::Grey => "GREY",
            Self::Y16 => "Y16",
            Self::Mjpg => "MJPG",
        }
    }

    /// The first four bytes of UVC's name; the other twelve are the same for all.
    pub fn guid(self) -> &'static [u8; 4] {
        match self {
            Self::Yuyv => b"YUY2",
            Self::Grey => b"Y800",
            Self::Y16 => b"Y16 ",
            Self::Mjpg => b"MJPG",
        }
    }

    pub fn bytes_per_pixel(self) -> usize {
        if self == Self::Grey { 1 } else { 2 }
    }
}

/// Settings that show in a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// In units of 100 us.
    pub exposure: u16,
    /// In hundredths above 1.
    pub gain: u16,
    pub white: u16,
    pub focus: u8,
    pub mains: u8,
}

/// How a picture was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stamp {
    pub frame: u32,
    /// Where the carriage was; `None` while it moved.
    pub steps: Option<i32>,
    pub settings: Settings,
    /// When the exposure began: the lower 32 bits of microseconds of CLOCK_MONOTONIC, the clock of V4L2.
    pub taken_us: u32,
}

const WORDS: usize = 6;
pub const STAMP_BITS: usize = 32 * WORDS;

fn check(words: &[u32]) -> u32 {
    words.iter().fold(0x5556_4321, |sum, word| (sum ^ word).wrapping_mul(0x0100_0193))
}

impl Stamp {
    fn words(self) -> [u32; WORDS] {
        let Settings { exposure, gain, white, focus, mains } = self.settings;
        let mut words = [
            self.frame,
            self.steps.unwrap_or(i32::MIN).cast_unsigned(),
            u32::from(exposure) << 16 | u32::from(gain),
            u32::from(white) << 16 | u32::from(focus) << 8 | u32::from(mains),
            self.taken_us,
            0,
        ];
        words[WORDS - 1] = check(&words[..WORDS - 1]);
        words
    }

    fn bit(words: &[u32; WORDS], index: usize) -> u8 {
        (words[index / 32] >> (index % 32) & 1) as u8
    }

    /// The stamp of a received frame; `None` if it has none.
    pub fn of(frame: &Frame, format: Format) -> Option<Self> {
        let mut words = [0; WORDS];
        for index in 0..STAMP_BITS {
            let place = place(format, frame.columns(), index);
            let bit = match frame.samples() {
                Samples::U8(samples) => u32::from(samples[place] & 1),
                Samples::U16(samples) => u32::from(samples[place] & 1),
            };
            words[index / 32] |= bit << (index % 32);
        }
        let steps = words[1].cast_signed();
        let settings = Settings {
            exposure: (words[2] >> 16) as u16,
            gain: words[2] as u16,
            white: (words[3] >> 16) as u16,
            focus: (words[3] >> 8) as u8,
            mains: words[3] as u8,
        };
        (words[WORDS - 1] == check(&words[..WORDS - 1])).then_some(Self {
            frame: words[0],
            steps: (steps != i32::MIN).then_some(steps),
            settings,
            taken_us: words[4],
        })
    }
}

/// The sample that holds a bit of the stamp.
fn place(format: Format, columns: usize, index: usize) -> usize {
    if format != Format::Mjpg {
        return index;
    }
    let across = columns / jpeg::BLOCK;
    index / across * jpeg::BLOCK * columns + index % across * jpeg::BLOCK
}

/// The grey levels of a picture: the scene, in the light of the settings, with the stamp.
pub fn grey(scene: &[u8], columns: usize, stamp: Stamp, format: Format) -> Vec<u8> {
    let Settings { exposure, gain, focus, .. } = stamp.settings;
    let light = f64::from(exposure) / f64::from(EXPOSURE_DEFAULT) * (1.0 + f64::from(gain) / 100.0);
    let levels: Vec<u8> = (0..256).map(|level| (f64::from(level) * light).round().min(255.0) as u8).collect();
    let mut grey: Vec<u8> = scene.iter().map(|&level| levels[usize::from(level)]).collect();
    // In focus at 100; a pixel of blur for each 10.
    let reach = 1 + usize::from(focus.abs_diff(100)) / 10;
    if reach > 1 {
        grey = grey.chunks_exact(columns).flat_map(|row| blurred(row, reach)).collect();
    }
    if format == Format::Mjpg {
        jpeg::flatten(&mut grey, columns);
    }
    let words = stamp.words();
    for index in 0..STAMP_BITS {
        let place = place(format, columns, index);
        grey[place] = grey[place] & !1 | Stamp::bit(&words, index);
    }
    if format == Format::Mjpg {
        jpeg::spread(&mut grey, columns);
    }
    grey
}

/// The mean of each sample and those to the right of it, `reach` in all.
pub fn blurred(row: &[u8], reach: usize) -> Vec<u8> {
    let mut sum: u32 = row.iter().take(reach).map(|&sample| u32::from(sample)).sum();
    let mut blurred = Vec::with_capacity(row.len());
    for (x, &first) in row.iter().enumerate() {
        blurred.push((sum / reach as u32) as u8);
        sum = sum - u32::from(first) + row.get(x + reach).map_or(0, |&next| u32::from(next));
    }
    blurred
}

/// The bytes of a picture as the camera sends them.
pub fn encoded(grey: &[u8], columns: usize, white: u16, format: Format) -> Vec<u8> {
    match format {
        Format::Grey => grey.to_vec(),
        Format::Y16 => grey.iter().flat_map(|&level| [level, level]).collect(),
        // Chroma shows the white balance: 128 at 4600 K.
        Format::Yuyv => {
            let chroma = (128 + (i32::from(white) - 4600) / 50).clamp(0, 255) as u8;
            grey.iter().flat_map(|&level| [level, chroma]).collect()
        }
        Format::Mjpg => jpeg::encoded(grey, columns),
    }
}

/// The frame that a program must make of a picture.
pub fn decoded(grey: Vec<u8>, columns: usize, format: Format) -> Frame {
    let rows = grey.len() / columns;
    match format {
        Format::Y16 => {
            let samples = grey.iter().map(|&level| u16::from(level) * 257).collect();
            Frame::new(rows, columns, 16, Samples::U16(samples)).unwrap()
        }
        _ => Frame::new(rows, columns, 8, Samples::U8(grey)).unwrap(),
    }
}

//! The pictures as they are sent to a page: the part that it shows, in as many values as it can show.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::panel_state::SharedState;
use epirig_core::frame::{Frame, Samples};
use epirig_server::{Bell, Feed, Message, Refusal, RefusalKind};

/// What a page wishes to see.
#[derive(Debug, Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(default)]
pub(in crate::panel) struct PictureWish {
    /// The part of the frame, in px; all of it by default.
    x: f64,
    y: f64,
    width: f64,
    height: f64,
    /// Most values that are sent.
    pixels: usize,
    /// Every picture; else two in a second.
    live: bool,
}

impl Default for PictureWish {
    fn default() -> Self {
        Self { x: 0.0, y: 0.0, width: f64::MAX, height: f64::MAX, pixels: MOST_PIXELS, live: true }
    }
}

/// Most values of a message.
const MOST_PIXELS: usize = 1 << 20;
/// Time between two pictures for a page that does not want all of them.
const SELDOM: Duration = Duration::from_millis(500);

/// What is sent before the values.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct PictureHead {
    number: u64,
    x: usize,
    y: usize,
    bin: usize,
    rows: usize,
    columns: usize,
    frame_rows: usize,
    frame_columns: usize,
    age_ms: f64,
}

/// The pictures for one page.
pub(in crate::panel) struct PictureFeed {
    shared: Arc<SharedState>,
    wish: PictureWish,
    sent: Option<(u64, Instant)>,
}

impl PictureFeed {
    pub(in crate::panel) fn new(shared: Arc<SharedState>) -> Self {
        Self { shared, wish: PictureWish::default(), sent: None }
    }
}

impl Feed for PictureFeed {
    fn bell(&self) -> Bell {
        self.shared.pictures.bell.clone()
    }

    fn next(&mut self) -> Option<Message> {
        let picture = self.shared.pictures.latest()?;
        if let Some((number, at)) = self.sent
            && (number == picture.number || (!self.wish.live && at.elapsed() < SELDOM))
        {
            return None;
        }
        self.sent = Some((picture.number, Instant::now()));
        let frame = &picture.frame;
        let part = Part::of(&self.wish, frame.rows(), frame.columns());
        let values = part.values(frame);
        let head = PictureHead {
            number: picture.number,
            x: part.x,
            y: part.y,
            bin: part.bin,
            rows: part.rows,
            columns: part.columns,
            frame_rows: frame.rows(),
            frame_columns: frame.columns(),
            age_ms: picture.at.elapsed().as_secs_f64() * 1e3,
        };
        Message::framed(&head, &values).ok()
    }

    fn wish(&mut self, wish: &Value) -> Result<(), Refusal> {
        self.wish = serde_json::from_value(wish.clone()).map_err(|error| {
            Refusal::new(RefusalKind::Wrong, format!("this is no part of a picture: {error}"))
        })?;
        // The same picture is sent again in its new part.
        self.sent = None;
        Ok(())
    }
}

/// A part of a frame in blocks of `bin` x `bin` pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Part {
    x: usize,
    y: usize,
    bin: usize,
    rows: usize,
    columns: usize,
}

/// The value of a block with a sample at full scale, and of one with a sample at 0.
const SATURATED: u8 = 255;
const DARK: u8 = 0;

impl Part {
    fn of(wish: &PictureWish, rows: usize, columns: usize) -> Self {
        // Numbers of a page may be anything; casts saturate, and NaN becomes 0.
        let (x, y) = ((wish.x.floor() as usize).min(columns - 1), (wish.y.floor() as usize).min(rows - 1));
        let right = ((wish.x.max(0.0) + wish.width).ceil() as usize).clamp(x + 1, columns);
        let bottom = ((wish.y.max(0.0) + wish.height).ceil() as usize).clamp(y + 1, rows);
        let (width, height) = (right - x, bottom - y);
        let most = wish.pixels.clamp(1, MOST_PIXELS);
        let mut bin = ((width * height) as f64 / most as f64).sqrt().floor().max(1.0) as usize;
        while width.div_ceil(bin) * height.div_ceil(bin) > most {
            bin += 1;
        }
        // Blocks begin at multiples of their size, so that a picture that is shifted does not shimmer.
        let (x, y) = (x / bin * bin, y / bin * bin);
        Self { x, y, bin, rows: (bottom - y).div_ceil(bin), columns: (right - x).div_ceil(bin) }
    }

    /// A value for each block: 1 to 254 for its mean, 255 if a sample is at full scale, 0 if one is at 0.
    fn values(&self, frame: &Frame) -> Vec<u8> {
        match frame.samples() {
            Samples::U8(samples) => self.reduce(frame, samples),
            Samples::U16(samples) => self.reduce(frame, samples),
        }
    }

    fn reduce<T: Copy + Into<u32>>(&self, frame: &Frame, samples: &[T]) -> Vec<u8> {
        let full = u32::from(frame.full_scale());
        let mut values = Vec::with_capacity(self.rows * self.columns);
        for row in 0..self.rows {
            let top = self.y + row * self.bin;
            let bottom = (top + self.bin).min(frame.rows());
            for column in 0..self.columns {
                let left = self.x + column * self.bin;
                let right = (left + self.bin).min(frame.columns());
                let (mut sum, mut saturated, mut dark) = (0_u64, false, false);
                for y in top..bottom {
                    for &sample in &samples[y * frame.columns() + left..y * frame.columns() + right] {
                        let sample: u32 = sample.into();
                        sum += u64::from(sample);
                        saturated |= sample >= full;
                        dark |= sample == 0;
                    }
                }
                let count = ((bottom - top) * (right - left)).max(1) as u64;
                let grey = 1 + 253 * sum / (count * u64::from(full.max(1)));
                values.push(match (saturated, dark) {
                    (true, _) => SATURATED,
                    (false, true) => DARK,
                    (false, false) => grey.min(254) as u8,
                });
            }
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wish(x: f64, y: f64, width: f64, height: f64, pixels: usize) -> PictureWish {
        PictureWish { x, y, width, height, pixels, live: true }
    }

    #[test]
    fn a_part_covers_what_is_wished_and_stays_in_the_frame() {
        assert_eq!(
            Part::of(&PictureWish::default(), 48, 64),
            Part { x: 0, y: 0, bin: 1, rows: 48, columns: 64 }
        );
        assert_eq!(
            Part::of(&wish(10.2, 5.0, 3.1, 2.0, 1000), 48, 64),
            Part { x: 10, y: 5, bin: 1, rows: 2, columns: 4 }
        );
        let overview = Part::of(&wish(0.0, 0.0, 5472.0, 3648.0, 500_000), 3648, 5472);
        assert!(overview.rows * overview.columns <= 500_000 && overview.bin == 7, "{overview:?}");
        for odd in [
            wish(-5.0, -5.0, 2.0, 2.0, 0),
            wish(1e300, 1e300, 1e300, -1.0, usize::MAX),
            wish(f64::NAN, f64::INFINITY, f64::NAN, f64::NEG_INFINITY, 1),
        ] {
            let part = Part::of(&odd, 48, 64);
            assert!(part.rows >= 1 && part.columns >= 1, "{odd:?}: {part:?}");
            let frame = Frame::new(48, 64, 8, Samples::U8(vec![7; 48 * 64])).unwrap();
            assert_eq!(part.values(&frame).len(), part.rows * part.columns);
        }
    }

    #[test]
    fn saturation_is_that_of_the_raw_samples_and_survives_a_mean() {
        let mut samples = vec![100_u16; 4 * 4];
        (samples[5], samples[10]) = (4095, 0);
        let frame = Frame::new(4, 4, 12, Samples::U16(samples)).unwrap();
        let values = Part { x: 0, y: 0, bin: 2, rows: 2, columns: 2 }.values(&frame);
        // 1 + 253 * 100 / 4095 = 7.2.
        assert_eq!(values, [SATURATED, 7, 7, DARK]);
        let single = Part { x: 1, y: 1, bin: 1, rows: 1, columns: 2 }.values(&frame);
        assert_eq!(single, [SATURATED, 7]);
    }
}

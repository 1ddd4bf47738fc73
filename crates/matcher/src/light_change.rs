//! How much light changed over a sequence, as the fit tells it.

use serde::{Deserialize, Serialize};

/// What the fit took off because light changed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct LightChange {
    /// Deviation of the frames' gains from their mean (root mean square), as a share of the light;
    /// 0 if it is no more than chance.
    pub frames: f64,
    /// What intensities drift by beside that over the whole baseline, in DN (root mean square over
    /// the pixels).
    pub drift_dn: f64,
    /// What this drift would move the disparity of a single pixel by, in px (root mean square,
    /// weighted by texture).
    pub effect_px: f64,
    /// How far squares of 8 x 8 px show the drift: the mean of its squares over that by chance.
    /// About 1 in steady light.
    pub significance: f64,
}

/// A drift whose squares exceed those by chance by this factor is no chance in the thousands of
/// squares of an image.
const SIGNIFICANT: f64 = 1.5;

impl LightChange {
    /// Whether there was more than chance.
    pub fn is_significant(&self) -> bool {
        self.frames > 0.0 || self.significance > SIGNIFICANT
    }

    /// What was taken off, such as "gains of frames vary by 1.2 %, and intensities drift by 0.40
    /// DN"; `None` if it is no more than chance.
    pub fn in_words(&self) -> Option<String> {
        let frames =
            (self.frames > 0.0).then(|| format!("gains of frames vary by {:.1} %", 100.0 * self.frames));
        let drift = (self.significance > SIGNIFICANT).then(|| {
            format!(
                "intensities drift by {:.2} DN, {:.4} px for a single pixel",
                self.drift_dn, self.effect_px
            )
        });
        match (frames, drift) {
            (Some(frames), Some(drift)) => Some(format!("{frames}, and {drift}")),
            (frames, drift) => frames.or(drift),
        }
    }
}

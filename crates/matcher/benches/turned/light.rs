//! Light that changes over the sequence.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Radius of a highlight (standard deviation), in px: wider than a disc, narrower than the image.
const HIGHLIGHT_PX: f64 = 40.0;
/// Distance from the image's middle in which shading changes by all of its share, in px.
const SHADING_PX: f64 = 128.0;

#[derive(Debug, Clone, Copy)]
pub(super) enum Light {
    Steady,
    /// A lamp that becomes lighter by this share over the whole baseline.
    Ramp(f64),
    /// A lamp that changes by steps of this share (standard deviation) from frame to frame, which
    /// add up.
    Walk(f64),
    /// The same, each frame for itself.
    Flicker(f64),
    /// Light that moves from one side to the other, by this share.
    Shading(f64),
    /// A highlight of so many DN that stands still in the frame.
    Highlight(f64),
}

/// The light of one frame.
pub(super) struct LightOfFrame {
    light: Light,
    gain: f64,
    offset: f64,
}

impl Light {
    /// That of frame `t`, whose tau is `offset` from the middle.
    pub(super) fn of_frame(self, seed: u64, t: u64, offset: f64) -> LightOfFrame {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let normals = (0..=t).map(|_| -> f64 { StandardNormal.sample(&mut random) });
        let gain = match self {
            Self::Ramp(share) => 1.0 + share * offset,
            Self::Walk(step) => 1.0 + step * normals.sum::<f64>(),
            Self::Flicker(share) => 1.0 + share * normals.last().unwrap_or(0.0),
            Self::Steady | Self::Shading(_) | Self::Highlight(_) => 1.0,
        };
        LightOfFrame { light: self, gain, offset }
    }
}

impl LightOfFrame {
    /// DN of a point that has `dn` in steady light, seen at this place from the middle of the
    /// frame.
    pub(super) fn on(&self, dn: f64, x: f64, y: f64) -> f64 {
        match self.light {
            Light::Shading(share) => dn * (1.0 + share * self.offset * (x - 0.5 * y) / SHADING_PX),
            Light::Highlight(more) => {
                dn + more * (-0.5 * ((x + 9.0).powi(2) + (y - 14.0).powi(2)) / HIGHLIGHT_PX.powi(2)).exp()
            }
            _ => dn * self.gain,
        }
    }
}

//! The keys of section `sim`: the simulator and its imperfections.

use super::super::parts::SceneName;
use super::key::{Allowed, Key, Kind, key, keys, measure};
use epirig_core::choice::names;
use epirig_core::settings::quantity::{DEG, DN, MM, PERCENT, UM};

keys!(
    "sim",
    SCENE =
        key("scene", Kind::Choice(names::<SceneName>), "tile", "The scene that the simulated camera sees")
            .or("plane"),
    NOISE = key(
        "noise",
        measure(DN, Allowed::ZeroOrMore),
        "1 DN",
        "Standard deviation of the noise of a pixel, in grey levels of 255"
    )
    .or("0 DN"),
    SEED = key(
        "seed",
        Kind::Whole(0, i64::MAX),
        "7",
        "Seed of all random numbers but those of the texture: the same seed gives the same frames"
    )
    .or("0"),
    TEXTURE_SEED = key(
        "texture_seed",
        Kind::Whole(0, i64::MAX),
        "2",
        "Seed of the texture: another one is another object of the same shape"
    )
    .or("1"),
    REAL_TIME = key("real_time", Kind::Flag, "true", "Whether moves and frames take real time").or("false"),
    ROLL = key(
        "roll",
        measure(DEG, Allowed::Within(180.0)),
        "0.7 deg",
        "Roll of the camera about its optical axis, relative to the travel"
    )
    .or("0 deg"),
    // The simulator refuses 0.5 rad and more.
    PAN = key("pan", measure(DEG, Allowed::Within(28.0)), "0.4 deg", "Pan of the camera towards the travel")
        .or("0 deg"),
    K1 = key(
        "k1",
        Kind::Number,
        "-0.02",
        "Radial distortion of the simulated lens, coefficient of r^2; negative for barrel distortion"
    )
    .or("0"),
    VIGNETTING = key(
        "vignetting",
        measure(PERCENT, Allowed::UpTo(90.0)),
        "18 %",
        "Vignetting: relative loss of light in the farthest corner"
    )
    .or("0 %"),
    FLICKER = key(
        "flicker",
        measure(PERCENT, Allowed::UpTo(10.0)),
        "0.3 %",
        "Relative standard deviation of the lamp from frame to frame"
    )
    .or("0 %"),
    DRIFT = key(
        "drift",
        measure(PERCENT, Allowed::Within(90.0)),
        "3 %",
        "How much lighter the lamp becomes from the first to the last stop"
    )
    .or("0 %"),
    HIGHLIGHT = key(
        "highlight",
        measure(DN, Allowed::UpTo(127.0)),
        "2 DN",
        "Brightness of a highlight that stands still in the image while the object moves, in grey levels of 255"
    )
    .or("0 DN"),
    STEP_ERROR = key(
        "step_error",
        measure(UM, Allowed::ZeroOrMore),
        "5 um",
        "Standard deviation of the true minus the reported position"
    )
    .or("0 um"),
    BOW = key(
        "bow",
        measure(MM, Allowed::Any),
        "0.3 mm",
        "Bow: depth of the middle of an edge of the tile below its centre; only with scene = \"tile\""
    )
    .or("0 mm"),
    BLACK_LEVEL = key(
        "black_level",
        measure(DN, Allowed::UpTo(127.0)),
        "3 DN",
        "Pixel value without light, in grey levels of 255"
    )
    .or("0 DN"),
    PIXEL_GAINS = key(
        "pixel_gains",
        measure(PERCENT, Allowed::UpTo(10.0)),
        "0.5 %",
        "Relative standard deviation of the pixels' gains"
    )
    .or("0 %"),
    HOT_PIXELS =
        key("hot_pixels", Kind::Whole(0, 1_000_000), "5", "Number of hot pixels: nearly white in any light")
            .or("0"),
);

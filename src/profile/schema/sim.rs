//! The keys of section `sim`: the simulator, and its faults.

use super::super::parts::SceneName;
use super::key::{Allowed, Key, Kind, key, keys, measure};
use epirig_core::choice::names;
use epirig_core::settings::quantity::{DEG, DN, MM, PERCENT, UM};

keys!(
    "sim",
    SCENE = key("scene", Kind::Choice(names::<SceneName>), "tile", "What the simulated camera looks at")
        .or("plane"),
    NOISE = key(
        "noise",
        measure(DN, Allowed::ZeroOrMore),
        "1 DN",
        "Standard deviation of the noise of a pixel, in grey levels of 255"
    )
    .or("0 DN"),
    SEED =
        key("seed", Kind::Whole(0, i64::MAX), "7", "Of all that is random: the same seed, the same frames")
            .or("0"),
    REAL_TIME =
        key("real_time", Kind::Flag, "true", "Whether moves and frames take the time that real ones take")
            .or("false"),
    ROLL = key(
        "roll",
        measure(DEG, Allowed::Within(180.0)),
        "0.7 deg",
        "How far the camera is rolled about its axis against the travel"
    )
    .or("0 deg"),
    // The simulator refuses 0.5 rad.
    PAN = key(
        "pan",
        measure(DEG, Allowed::Within(28.0)),
        "0.4 deg",
        "How far the camera is turned towards the travel"
    )
    .or("0 deg"),
    K1 = key(
        "k1",
        Kind::Number,
        "-0.02",
        "Radial distortion of the simulated lens, of r^2; negative for a barrel"
    )
    .or("0"),
    VIGNETTING = key(
        "vignetting",
        measure(PERCENT, Allowed::UpTo(90.0)),
        "18 %",
        "Share of the light that the lens loses in the farthest corner"
    )
    .or("0 %"),
    FLICKER = key(
        "flicker",
        measure(PERCENT, Allowed::UpTo(10.0)),
        "0.3 %",
        "Standard deviation of the lamp from frame to frame"
    )
    .or("0 %"),
    STEP_ERROR = key(
        "step_error",
        measure(UM, Allowed::ZeroOrMore),
        "5 um",
        "Standard deviation of the carriage's true place from the one that the stage reports"
    )
    .or("0 um"),
    BOW = key(
        "bow",
        measure(MM, Allowed::Any),
        "0.3 mm",
        "How much deeper the middle of an edge of the tile lies than its middle; only with scene = \"tile\""
    )
    .or("0 mm"),
    BLACK_LEVEL = key(
        "black_level",
        measure(DN, Allowed::UpTo(127.0)),
        "3 DN",
        "What a pixel reads without light, in grey levels of 255"
    )
    .or("0 DN"),
    PIXEL_GAINS = key(
        "pixel_gains",
        measure(PERCENT, Allowed::UpTo(10.0)),
        "0.5 %",
        "Standard deviation of the gains of the pixels"
    )
    .or("0 %"),
    HOT_PIXELS = key(
        "hot_pixels",
        Kind::Whole(0, 1_000_000),
        "5",
        "Number of pixels that are nearly white whatever the light"
    )
    .or("0"),
);

//! The keys of section `camera`; its controls are the camera's own.

use super::super::parts::BAYER_USES;
use super::super::quantity::{HZ, S, US};
use super::key::{Allowed, Key, Kind, key, keys, measure, names};

keys!(
    "camera",
    DEVICE = key(
        "device",
        Kind::Camera,
        "/dev/video0",
        "Which one; without it, the only camera. sim looks at the simulated object, replay:FOLDER gives the frames of a sequence",
    ),
    FORMAT = key("format", Kind::Format, "GREY", "Pixel format; without it, the deepest uncompressed grey"),
    SIZE = key("size", Kind::Size, "1024x768", "Columns and rows; without it, the largest size"),
    RATE = key(
        "rate",
        measure(HZ, Allowed::Positive),
        "25 Hz",
        "Frames per second; without it, as the camera has it"
    ),
    EXPOSURE = key(
        "exposure",
        measure(US, Allowed::Positive),
        "10 ms",
        "Exposure time; under lamps on mains, whole half periods of the mains (10 ms at 50 Hz)",
    ),
    BAYER = key(
        "bayer",
        Kind::Choice(&names(&BAYER_USES)),
        "green",
        "What to make of a colour mosaic: the sum of the two green pixels of each cell, or of all four",
    ),
    PATIENCE = key(
        "patience",
        measure(S, Allowed::Positive),
        "20 s",
        "How long to wait for a good frame, and for a steady picture",
    )
    .or("10 s"),
    MAINS = key(
        "mains",
        measure(HZ, Allowed::Among(&[50.0, 60.0])),
        "50 Hz",
        "Frequency of the mains that the lamps hang on",
    ),
);

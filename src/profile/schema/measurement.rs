//! The keys of the sections that describe what is measured, and how precisely.

/// Section `plan`.
pub(in crate::profile) mod plan {
    use super::super::key::{Allowed, Key, Kind, key, keys, measure};
    use epirig_core::settings::quantity::{MM, MS};

    keys!(
        "plan",
        START =
            key("start", measure(MM, Allowed::ZeroOrMore), "10 mm", "Position of the first frame, from home")
                .or("0 mm"),
        STEP = key("step", measure(MM, Allowed::Positive), "1.5 mm", "Distance between stops"),
        FRAMES = key("frames", Kind::Whole(2, 100_000), "101", "Number of frames: one more than steps"),
        SETTLE = key(
            "settle",
            measure(MS, Allowed::ZeroOrMore),
            "100 ms",
            "Time for which the stage vibrates after a move"
        )
        .or("200 ms"),
        AVERAGE = key(
            "average",
            Kind::Whole(1, 65_536),
            "4",
            "Number of frames averaged at each stop, into one of 16 bit"
        )
        .or("1"),
        DARK = key("dark", Kind::Whole(0, 1_000), "16", "Number of dark frames, taken without light").or("0"),
        FLAT = key(
            "flat",
            Kind::Whole(0, 1_000),
            "16",
            "Number of frames of a uniform target, for the flat field"
        )
        .or("0"),
        BOARD = key(
            "board",
            Kind::Whole(0, 1_000),
            "20",
            "Number of frames of the hand-held chess-board of [board], each in a different pose, to calibrate the lens"
        )
        .or("0"),
    );
}

/// Section `optics`.
pub(in crate::profile) mod optics {
    use super::super::key::{Allowed, Key, Kind, key, keys, measure};
    use epirig_core::settings::quantity::{MM, PERCENT, PX};

    keys!(
        "optics",
        FOCAL_LENGTH = key(
            "focal_length",
            Kind::Measure { unit: MM, or: Some(PX), allowed: Allowed::Positive },
            "25 mm",
            "Focal length of the lens; a value in mm needs sensor_width",
        ),
        FOCAL_LENGTH_SIGMA = key(
            "focal_length_sigma",
            measure(PERCENT, Allowed::UpTo(100.0)),
            "0.5 %",
            "Relative standard uncertainty of the focal length; part of the interval of a depth, and limits how far calibration changes it",
        )
        .or("2 %"),
        SENSOR_WIDTH = key(
            "sensor_width",
            measure(MM, Allowed::Positive),
            "9 mm",
            "Width of the part of the sensor that the image covers"
        ),
        PRINCIPAL_POINT_X = key(
            "principal_point_x",
            measure(PX, Allowed::Any),
            "511.5 px",
            "Column of the principal point, from the centre of the first column; by default the centre of the image",
        ),
        PRINCIPAL_POINT_Y = key(
            "principal_point_y",
            measure(PX, Allowed::Any),
            "383.5 px",
            "Row of the principal point, from the centre of the first row; only together with principal_point_x",
        ),
        DISTANCE =
            key("distance", measure(MM, Allowed::Positive), "900 mm", "Distance from the lens to the object"),
        K1 = key(
            "k1",
            Kind::Number,
            "-0.02",
            "Radial distortion of the lens, coefficient of r^2, as in OpenCV"
        )
        .or("0"),
        K2 = key("k2", Kind::Number, "0.01", "Radial distortion, coefficient of r^4").or("0"),
        P1 = key("p1", Kind::Number, "0.001", "Tangential distortion, along y").or("0"),
        P2 = key("p2", Kind::Number, "-0.001", "Tangential distortion, along x").or("0"),
        K3 = key("k3", Kind::Number, "0.001", "Radial distortion, coefficient of r^6").or("0"),
    );
}

/// Section `target`.
pub(in crate::profile) mod target {
    use super::super::key::{Allowed, Key, Kind, MOST_CORNERS, key, keys, measure};
    use epirig_core::settings::quantity::MM;

    keys!(
        "target",
        RELIEF = key(
            "relief",
            measure(MM, Allowed::Positive),
            "0.2 mm",
            "Height difference that the measurement must resolve"
        ),
        SQUARE = key(
            "square",
            measure(MM, Allowed::Positive),
            "7.5 mm",
            "Side of a square of the chess-boards on the object, measured with a ruler; omit it if there are none",
        ),
        COLUMNS = key(
            "columns",
            Kind::Whole(2, MOST_CORNERS),
            "18",
            "Inner corners of a chess-board along the travel: one less than squares",
        ),
        ROWS = key(
            "rows",
            Kind::Whole(2, MOST_CORNERS),
            "2",
            "Inner corners of a chess-board across the travel"
        ),
        BANDS = key(
            "bands",
            Kind::Whole(1, 2),
            "2",
            "Number of chess-boards: one, or two with the relief between them"
        )
        .or("1"),
        BAND_DISTANCE = key(
            "band_distance",
            measure(MM, Allowed::Positive),
            "127.5 mm",
            "For two: distance from the first row of inner corners of the upper board to that of the lower",
        ),
    );
}

/// Section `board`.
pub(in crate::profile) mod board {
    use super::super::key::{Allowed, Key, Kind, MOST_CORNERS, key, keys, measure};
    use epirig_core::settings::quantity::MM;

    keys!(
        "board",
        SQUARE =
            key("square", measure(MM, Allowed::Positive), "16 mm", "Side of a square, measured with a ruler"),
        COLUMNS =
            key("columns", Kind::Whole(2, MOST_CORNERS), "9", "Inner corners per row: one less than squares"),
        ROWS = key("rows", Kind::Whole(2, MOST_CORNERS), "6", "Rows of inner corners"),
    );
}

/// Section `limits`.
pub(in crate::profile) mod limits {
    use super::super::key::{Allowed, Key, Kind, key, keys, measure};
    use epirig_core::settings::quantity::{MIN, PERCENT, PX, UM};

    keys!(
        "limits",
        RETAKES =
            key("retakes", Kind::Whole(0, 100), "5", "Retakes of a frame before the scan stops").or("3"),
        SATURATED = key(
            "saturated",
            measure(PERCENT, Allowed::UpTo(100.0)),
            "0.5 %",
            "Share of a frame's pixels that may be saturated"
        )
        .or("1 %"),
        POSITION = key(
            "position",
            measure(UM, Allowed::Positive),
            "10 um",
            "Largest distance of the reported from the commanded position"
        )
        .or("20 um"),
        WAIT = key(
            "wait",
            measure(MIN, Allowed::ZeroOrMore),
            "10 min",
            "Longest wait for a device that has disconnected"
        )
        .or("5 min"),
        SHIFT = key(
            "shift",
            measure(PX, Allowed::Positive),
            "0.2 px",
            "Largest shift of the picture when a stop is taken again"
        )
        .or("0.1 px"),
    );
}

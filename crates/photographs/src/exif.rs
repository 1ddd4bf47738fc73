//! How a camera stores a photograph: turned, with a tag that says so, and what the tags tell of its
//! lens.

use epirig_core::grid::Grid;

/// How a stored picture is to be turned so that it is upright; the number is that of the tag.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Orientation {
    /// Not at all.
    Upright = 1,
    /// By 180 degrees.
    HalfTurn = 3,
    /// By 90 degrees clockwise.
    Clockwise = 6,
    /// By 90 degrees counterclockwise.
    Counterclockwise = 8,
}

impl Orientation {
    /// The picture as it is stored, of the upright one.
    pub fn stored(self, upright: &Grid<u8>) -> Grid<u8> {
        match self {
            Self::Upright => upright.clone(),
            Self::HalfTurn => half_turned(upright),
            Self::Clockwise => turned_counterclockwise(upright),
            Self::Counterclockwise => half_turned(&turned_counterclockwise(upright)),
        }
    }

    /// The upright picture, of the stored one.
    pub fn upright(self, stored: &Grid<u8>) -> Grid<u8> {
        match self {
            Self::Clockwise => Self::Counterclockwise.stored(stored),
            Self::Counterclockwise => Self::Clockwise.stored(stored),
            Self::Upright | Self::HalfTurn => self.stored(stored),
        }
    }
}

fn half_turned(grid: &Grid<u8>) -> Grid<u8> {
    let values = grid.values().iter().rev().copied().collect();
    Grid::from_values(grid.rows(), grid.columns(), values).unwrap()
}

/// The column on the right becomes the first row.
fn turned_counterclockwise(grid: &Grid<u8>) -> Grid<u8> {
    let (rows, columns) = (grid.rows(), grid.columns());
    let values = (0..columns).rev().flat_map(|x| (0..rows).map(move |y| (x, y)));
    Grid::from_values(columns, rows, values.map(|(x, y)| grid.at(x, y)).collect()).unwrap()
}

/// Length of a pixel of the sensor that the tags tell, in mm.
const SENSOR_PIXEL_MM: f64 = 0.004;

/// Tags, as the segment APP1 of a JPEG image. A focal length, in px, becomes one in mm and a number
/// of pixels in a cm.
pub fn segment(orientation: Orientation, focal_length_px: Option<f64>) -> Vec<u8> {
    /// Bytes of TIFF before its first table, and of a table with `entries` entries.
    const HEADER: u32 = 8;
    let table = |entries: u32| 2 + 12 * entries + 4;
    let short = |value: u16| (u32::from(value)) << 16;
    let mut tiff = b"MM\0*\0\0\0\x08".to_vec();
    let mut first = vec![(0x0112, 3, short(orientation as u16))];
    let Some(focal_length_px) = focal_length_px else {
        put_table(&mut tiff, &first);
        return wrapped(&tiff);
    };
    let second = HEADER + table(2);
    first.push((0x8769, 4, second));
    put_table(&mut tiff, &first);
    let values = second + table(3);
    // Focal length; pixels in a unit of the sensor; the unit: cm.
    put_table(&mut tiff, &[(0x920a, 5, values), (0xa20e, 5, values + 8), (0xa210, 3, short(3))]);
    for value in [focal_length_px * SENSOR_PIXEL_MM, 10.0 / SENSOR_PIXEL_MM] {
        tiff.extend(((value * 1e4).round() as u32).to_be_bytes());
        tiff.extend(10_000_u32.to_be_bytes());
    }
    wrapped(&tiff)
}

/// A table of entries with one value each: tag, type, and value or its place.
fn put_table(tiff: &mut Vec<u8>, entries: &[(u16, u16, u32)]) {
    tiff.extend((entries.len() as u16).to_be_bytes());
    for (tag, kind, value) in entries {
        tiff.extend(tag.to_be_bytes());
        tiff.extend(kind.to_be_bytes());
        tiff.extend(1_u32.to_be_bytes());
        tiff.extend(value.to_be_bytes());
    }
    tiff.extend([0; 4]);
}

fn wrapped(tiff: &[u8]) -> Vec<u8> {
    let length = (2 + 6 + tiff.len()) as u16;
    [&[0xff, 0xe1][..], &length.to_be_bytes(), b"Exif\0\0", tiff].concat()
}

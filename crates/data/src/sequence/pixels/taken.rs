//! When a photograph was taken, as its EXIF tells.

use std::io::Cursor;

use exif::{DateTime, Exif, In, Reader, Tag, Value};
use jiff::civil;

/// When the photograph in these bytes of a file was taken, by the clock of the camera: `DateTimeOriginal` with
/// `SubSecTimeOriginal`. `None` if the file does not tell it, or nothing that can be: EXIF that is damaged counts
/// as none.
///
/// The zone is not looked at: the photographs of a scan come from one camera.
pub fn time_taken(bytes: &[u8]) -> Option<civil::DateTime> {
    time_of(&exif_of(bytes)?)
}

/// The EXIF in these bytes of a file; `None` if there is none, or it is damaged.
pub(in super::super) fn exif_of(bytes: &[u8]) -> Option<Exif> {
    Reader::new().read_from_container(&mut Cursor::new(bytes)).ok()
}

/// As [`time_taken`].
pub(in super::super) fn time_of(exif: &Exif) -> Option<civil::DateTime> {
    let mut time = DateTime::from_ascii(text(exif, Tag::DateTimeOriginal)?).ok()?;
    if let Some(fraction) = text(exif, Tag::SubSecTimeOriginal) {
        // A fraction that is none leaves whole seconds.
        let _ = time.parse_subsec(fraction);
    }
    let year = i16::try_from(time.year).ok()?;
    let [month, day, hour, minute, second] =
        [time.month, time.day, time.hour, time.minute, time.second].map(|part| i8::try_from(part).ok());
    let nanosecond = i32::try_from(time.nanosecond.unwrap_or_default()).ok()?;
    civil::DateTime::new(year, month?, day?, hour?, minute?, second?, nanosecond).ok()
}

fn text(exif: &Exif, tag: Tag) -> Option<&[u8]> {
    match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Ascii(lines) => lines.first().map(Vec::as_slice),
        _ => None,
    }
}

//! Files that people take for images, and that are not read: what they are, and what makes images of them.

use std::path::Path;

/// A format that is not read.
#[derive(Debug)]
pub struct ForeignFormat {
    /// What a file of it is, with its article.
    pub name: &'static str,
    /// How names of such files end, in small letters.
    endings: &'static [&'static str],
    /// Whether a file begins as such files do.
    begins: fn(&[u8]) -> bool,
    /// The command that makes images of FILE, or what else helps.
    pub convert: &'static str,
}

/// Bytes of a file that tell its format.
pub(in super::super) const TELLING_BYTES: u64 = 64;

/// Whether an ISO base media file (ISO/IEC 14496-12) is of one of these brands.
fn is_of_brand(bytes: &[u8], brands: &[&[u8]]) -> bool {
    bytes.get(4..8) == Some(b"ftyp") && bytes.get(8..12).is_some_and(|brand| brands.contains(&brand))
}

const FORMATS: [ForeignFormat; 9] = [
    ForeignFormat {
        name: "a HEIC image",
        endings: &["heic", "heif", "hif", "avif"],
        begins: |bytes| {
            is_of_brand(bytes, &[b"heic", b"heix", b"heim", b"heis", b"hevc", b"mif1", b"msf1", b"avif"])
        },
        convert: "heif-convert FILE FILE.png",
    },
    ForeignFormat {
        name: "a camera's raw image",
        endings: &["cr2", "cr3", "crw", "nef", "arw", "dng", "raf", "orf", "rw2", "pef", "srw", "raw"],
        begins: |bytes| {
            (bytes.starts_with(b"II*\0") && bytes.get(8..10) == Some(b"CR"))
                || is_of_brand(bytes, &[b"crx "])
                || [&b"FUJIFILMCCD-RAW"[..], b"IIRO", b"IIRS", b"MMOR", b"IIU\0"]
                    .iter()
                    .any(|magic| bytes.starts_with(magic))
        },
        convert: "dcraw -T -6 -W FILE   or: darktable-cli FILE FILE.tif",
    },
    ForeignFormat {
        name: "a WebP image",
        endings: &["webp"],
        begins: |bytes| bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP"),
        convert: "dwebp FILE -o FILE.png",
    },
    ForeignFormat {
        name: "a JPEG XL image",
        endings: &["jxl"],
        begins: |bytes| bytes.starts_with(&[0xff, 0x0a]) || bytes.starts_with(b"\0\0\0\x0cJXL "),
        convert: "djxl FILE FILE.png",
    },
    ForeignFormat {
        name: "a JPEG 2000 image",
        endings: &["jp2", "j2k", "jpx"],
        begins: |bytes| bytes.starts_with(b"\0\0\0\x0cjP  ") || bytes.starts_with(&[0xff, 0x4f, 0xff, 0x51]),
        convert: "opj_decompress -i FILE -o FILE.png",
    },
    ForeignFormat {
        name: "a GIF image",
        endings: &["gif"],
        begins: |bytes| bytes.starts_with(b"GIF8"),
        convert: "ffmpeg -i FILE -fps_mode passthrough frame_%04d.png",
    },
    ForeignFormat {
        name: "an OpenEXR image, whose numbers have no white",
        endings: &["exr"],
        begins: |bytes| bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]),
        convert: "write PNG of 16 bit, with one white for all frames",
    },
    ForeignFormat {
        name: "a zip archive",
        endings: &["zip"],
        begins: |bytes| bytes.starts_with(b"PK\x03\x04"),
        convert: "unzip FILE -d FOLDER",
    },
    ForeignFormat {
        name: "an archive",
        endings: &["tar", "tgz", "gz", "bz2", "xz", "zst", "7z", "rar"],
        begins: |bytes| {
            [&b"\x1f\x8b"[..], b"BZh", b"\xfd7zXZ\0", b"\x28\xb5\x2f\xfd", b"7z\xbc\xaf\x27\x1c", b"Rar!"]
                .iter()
                .any(|magic| bytes.starts_with(magic))
        },
        convert: "tar -xf FILE, or the program that packed it",
    },
];

/// The format of a file that is not read, by its first bytes or else by its name; `None` if it is none of those that
/// are known.
pub(in super::super) fn foreign_format(path: &Path, bytes: &[u8]) -> Option<&'static ForeignFormat> {
    FORMATS.iter().find(|format| (format.begins)(bytes)).or_else(|| foreign_name(path))
}

/// The format that the name of a file tells, if such are not read.
pub(in super::super) fn foreign_name(path: &Path) -> Option<&'static ForeignFormat> {
    let ending = path.extension()?.to_string_lossy().to_ascii_lowercase();
    FORMATS.iter().find(|format| format.endings.contains(&&*ending))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_known_by_content_and_by_name() {
        let name =
            |path: &str, bytes: &[u8]| foreign_format(Path::new(path), bytes).map(|format| format.name);
        assert_eq!(name("a.jpg", b"\0\0\0\x18ftypheic"), Some("a HEIC image"));
        assert_eq!(name("a.tif", b"II*\0\x10\0\0\0CR\x02\0"), Some("a camera's raw image"));
        assert_eq!(name("a.cr3", b"\0\0\0\x18ftypcrx "), Some("a camera's raw image"));
        // A DNG begins as any TIFF does.
        assert_eq!(name("A.DNG", b"II*\0\x08\0\0\0"), Some("a camera's raw image"));
        assert_eq!(name("a", b"RIFF\0\0\0\0WEBP"), Some("a WebP image"));
        assert_eq!(name("a.png", b"PK\x03\x04"), Some("a zip archive"));
        assert_eq!(name("a.png", b"\x89PNG\r\n\x1a\n"), None);
        assert_eq!(name("a.tif", b"II*\0\x08\0\0\0"), None);
        assert_eq!(name("a.mp4", b"\0\0\0\x18ftypisom"), None);
        assert_eq!(name("notes.txt", b""), None);
    }
}

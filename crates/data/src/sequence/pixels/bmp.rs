//! BMP images.

use super::fault::ImageFault;

/// Where the bits of a pixel stand in the header of Windows 3 and later, and the compression.
const BITS: usize = 28;
const COMPRESSION: usize = 30;
/// Compressions that keep each pixel: none, and none with masks for the colours.
const PLAIN: [u8; 3] = [0, 3, 6];

/// Refuses a file that has fewer bytes than pixels: the decoder would make room for all of them first.
pub(super) fn check(bytes: &[u8], rows: usize, columns: usize) -> Result<(), ImageFault> {
    let (Some(&bits), Some(compression)) = (bytes.get(BITS), bytes.get(COMPRESSION..COMPRESSION + 4)) else {
        return Err(ImageFault::cut_short());
    };
    // The oldest header is shorter and has its values elsewhere; such files are not compressed.
    let has_old_header = bytes.get(14) == Some(&12);
    let plain = compression[1..] == [0, 0, 0] && PLAIN.contains(&compression[0]);
    let bits = if has_old_header { bytes.get(24).copied().unwrap_or(0) } else { bits };
    match (has_old_header || plain) && rows * columns * usize::from(bits) / 8 > bytes.len() {
        true => Err(ImageFault::cut_short()),
        false => Ok(()),
    }
}

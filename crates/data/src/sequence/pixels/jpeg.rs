//! JPEG images.

use super::fault::ImageFault;

/// Refuses images that a decoder would complete: their end is missing, or they are too large for their bytes.
pub(super) fn check(bytes: &[u8], rows: usize, columns: usize) -> Result<(), ImageFault> {
    /// A block of 64 pixels takes a bit at least.
    const PIXELS_OF_A_BYTE: usize = 8 * 64;
    /// Larger sides overflow in the decoder.
    const LONGEST: usize = 65_528;
    const START_OF_SCAN: u8 = 0xda;
    const END: u8 = 0xd9;
    if rows.max(columns) > LONGEST {
        return Err(ImageFault::TooLarge { rows, columns });
    }
    // Segments up to the first scan: marker, length, contents.
    let mut place = 2;
    while let Some(&[0xff, marker, high, low]) = bytes.get(place..place + 4) {
        place += 2 + usize::from(u16::from_be_bytes([high, low]));
        if marker == START_OF_SCAN {
            break;
        }
    }
    let data = bytes.get(place..).unwrap_or_default();
    // Within the compressed data 0xff is followed by 0 or by a restart.
    let has_end = data.windows(2).any(|pair| pair == [0xff, END]);
    if !has_end || rows * columns > PIXELS_OF_A_BYTE * data.len() {
        return Err(ImageFault::cut_short());
    }
    Ok(())
}

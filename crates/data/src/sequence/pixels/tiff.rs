//! TIFF images: what the decoder does not read or would not refuse.

use std::borrow::Cow;
use std::io::Cursor;

use image::{DynamicImage, Rgb, RgbImage};
use tiff::decoder::Decoder;
use tiff::tags::{PhotometricInterpretation, SampleFormat, Tag};

use super::fault::ImageFault;

/// Refuses a file of several images: it is not known which of them is the frame.
pub(super) fn check(bytes: &[u8], _rows: usize, _columns: usize) -> Result<(), ImageFault> {
    let several = Decoder::new(Cursor::new(bytes)).is_ok_and(|decoder| decoder.more_images());
    if several {
        let reason = "it holds several images; save each as a file of its own";
        return Err(ImageFault::Unsupported(reason.to_owned()));
    }
    Ok(())
}

/// Refuses samples that have no full scale, before the decoder does so in words of its own.
pub(super) fn refuse_floats(bytes: &[u8]) -> Result<(), ImageFault> {
    let formats = Decoder::new(Cursor::new(bytes)).ok().and_then(|mut decoder| {
        let found = decoder.find_tag(Tag::SampleFormat).ok()??;
        found.into_u16_vec().ok()
    });
    let float = SampleFormat::IEEEFP.to_u16();
    if formats.is_some_and(|formats| formats.contains(&float)) {
        let reason = "its samples are floating-point numbers, and nothing says which of them is white; multiply all \
                      images by one factor, and save them as grey PNG of 8 or 16 bit";
        return Err(ImageFault::Unsupported(reason.to_owned()));
    }
    Ok(())
}

/// The colours of a palette, of 8 bit.
#[derive(Debug)]
pub(super) struct Palette(Vec<Rgb<u8>>);

impl Palette {
    /// The image whose grey values are places in the palette.
    pub(super) fn colours(&self, places: &DynamicImage) -> Result<DynamicImage, ImageFault> {
        let places = places
            .as_luma8()
            .ok_or_else(|| ImageFault::Damaged("the places in its palette are not 8 bit".to_owned()))?;
        let black = Rgb([0, 0, 0]);
        let colour = |x, y| self.0.get(usize::from(places.get_pixel(x, y).0[0])).copied().unwrap_or(black);
        Ok(RgbImage::from_fn(places.width(), places.height(), colour).into())
    }
}

/// The palette of a TIFF that has one, and its bytes made those of a grey image: the decoder reads no
/// palettes, but these differ from grey images by one value in their head. Other bytes come back as they are.
pub(super) fn without_palette(bytes: &[u8]) -> Result<(Cow<'_, [u8]>, Option<Palette>), ImageFault> {
    let as_it_is = (Cow::Borrowed(bytes), None);
    let Ok(mut decoder) = Decoder::new(Cursor::new(bytes)) else { return Ok(as_it_is) };
    let mut numbers = |tag| {
        decoder.find_tag(tag).ok().flatten().and_then(|value| value.into_u16_vec().ok()).unwrap_or_default()
    };
    if numbers(Tag::PhotometricInterpretation) != [PhotometricInterpretation::RGBPalette.to_u16()] {
        return Ok(as_it_is);
    }
    let (bits, map) = (numbers(Tag::BitsPerSample), numbers(Tag::ColorMap));
    let place = value_place(bytes, Tag::PhotometricInterpretation.to_u16());
    let (Some((place, grey)), [8], 768) = (place, &*bits, map.len()) else {
        let reason = "its palette is not of 8 bit in a usual TIFF; save it as a grey PNG of 8 or 16 bit";
        return Err(ImageFault::Unsupported(reason.to_owned()));
    };
    let colour =
        |index: usize| Rgb([map[index], map[256 + index], map[512 + index]].map(|value| (value >> 8) as u8));
    let mut grey_bytes = bytes.to_vec();
    grey_bytes[place..place + 2].copy_from_slice(&grey);
    Ok((Cow::Owned(grey_bytes), Some(Palette((0..256).map(colour).collect()))))
}

/// Where the first directory holds the value of `tag`, and the bytes that say "grey, 0 is black" there.
/// `None` for files of more than 4 GB, whose directories are others.
fn value_place(bytes: &[u8], tag: u16) -> Option<(usize, [u8; 2])> {
    /// Bytes of an entry; its value comes after tag, type and count.
    const ENTRY: usize = 12;
    const VALUE: usize = 8;
    const BLACK_IS_ZERO: u16 = 1;
    let little = bytes.starts_with(b"II*\0");
    if !little && !bytes.starts_with(b"MM\0*") {
        return None;
    }
    let short = |place: usize| {
        let two: [u8; 2] = bytes.get(place..place + 2)?.try_into().ok()?;
        Some(if little { u16::from_le_bytes(two) } else { u16::from_be_bytes(two) })
    };
    let four: [u8; 4] = bytes.get(4..8)?.try_into().ok()?;
    let directory = if little { u32::from_le_bytes(four) } else { u32::from_be_bytes(four) } as usize;
    let entries = usize::from(short(directory)?);
    let mut places = (0..entries).map(|index| directory + 2 + ENTRY * index);
    let entry = places.find(|&place| short(place) == Some(tag))?;
    let grey = if little { BLACK_IS_ZERO.to_le_bytes() } else { BLACK_IS_ZERO.to_be_bytes() };
    bytes.get(entry + VALUE..entry + VALUE + 2)?;
    Some((entry + VALUE, grey))
}

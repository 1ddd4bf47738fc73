//! What the camera says of itself: the descriptors of a high-speed UVC 1.1 camera with a camera terminal, a
//! processing unit and one video stream. "USB Device Class Definition for Video Devices", revision 1.1, and
//! its payload documents have the layouts and numbers.

use super::picture::Format;

/// Sizes that it offers: columns and rows.
pub const SIZES: [(u16, u16); 2] = [(160, 120), (320, 240)];
/// Frame intervals in units of 100 ns: 30, 15 and 5 frames a second.
pub const INTERVALS: [u32; 3] = [333_333, 666_666, 2_000_000];
/// Of the camera's own clock, which is not used.
pub const CLOCK_HZ: u32 = 10_000_000;
/// Unit of the controls of sensor and lens.
pub const TERMINAL: u8 = 1;
/// Unit of the controls of the picture.
pub const PROCESSING: u8 = 2;
pub const VIDEO_ENDPOINT: u8 = 1;
/// Three transactions of 1024 bytes in each microframe: the most of high speed.
pub const PACKET: usize = 3 * 1024;
/// Bytes of the stream's settings that are negotiated.
pub const PROBE: usize = 34;

/// What kind of camera it is.
#[derive(Clone, Debug)]
pub struct Model {
    pub isochronous: bool,
    pub serial_number: String,
    /// Bytes of a bulk payload at most, with its header.
    pub payload: usize,
}

impl Model {
    pub fn device() -> Vec<u8> {
        // Vendor and product are of pid.codes' range for tests; names 1, 2 and 3 are below.
        vec![18, 1, 0x00, 0x02, 0xEF, 2, 1, 64, 0x09, 0x12, 0x01, 0x00, 0x00, 0x01, 1, 2, 3, 1]
    }

    pub fn qualifier() -> Vec<u8> {
        vec![10, 6, 0x00, 0x02, 0xEF, 2, 1, 64, 1, 0]
    }

    pub fn name(&self, index: u8) -> Option<Vec<u8>> {
        let text = match index {
            // The languages: English.
            0 => return Some(vec![4, 3, 0x09, 0x04]),
            1 => "Virtual",
            2 => "UVC camera",
            3 => &self.serial_number,
            _ => return None,
        };
        let mut bytes = vec![0, 3];
        bytes.extend(text.encode_utf16().flat_map(u16::to_le_bytes));
        bytes[0] = bytes.len() as u8;
        Some(bytes)
    }

    pub fn configuration(&self) -> Vec<u8> {
        // Two interfaces, powered by the bus with 100 mA; both are one function: video.
        let mut all = vec![9, 2, 0, 0, 2, 1, 0, 0x80, 50];
        all.extend([8, 0x0B, 0, 2, 0x0E, 3, 0, 2]);
        let units = units();
        all.extend([9, 4, 0, 0, 0, 0x0E, 1, 0, 2]);
        all.extend([13, 0x24, 1, 0x10, 0x01]);
        all.extend((units.len() as u16 + 13).to_le_bytes());
        all.extend(CLOCK_HZ.to_le_bytes());
        all.extend([1, 1]);
        all.extend(units);
        let endpoint = 0x80 | VIDEO_ENDPOINT;
        if self.isochronous {
            // Setting 0 uses no bandwidth.
            all.extend([9, 4, 1, 0, 0, 0x0E, 2, 0, 0]);
            all.extend(formats());
            all.extend([9, 4, 1, 1, 1, 0x0E, 2, 0, 0]);
            all.extend([7, 5, endpoint, 0x05, 0x00, 0x14, 1]);
        } else {
            all.extend([9, 4, 1, 0, 1, 0x0E, 2, 0, 0]);
            all.extend(formats());
            all.extend([7, 5, endpoint, 0x02, 0x00, 0x02, 0]);
        }
        let length = (all.len() as u16).to_le_bytes();
        all[2..4].copy_from_slice(&length);
        all
    }
}

fn units() -> Vec<u8> {
    let mut units = Vec::new();
    // Bits: automatic exposure 1, exposure time 3, focus 5, automatic focus 17.
    let of_lens = [0b0010_1010, 0, 0b10];
    units.extend([18, 0x24, 2, TERMINAL, 0x01, 0x02, 0, 0, 0, 0, 0, 0, 0, 0, 3]);
    units.extend(of_lens);
    // Bits: white balance 6, gain 9, mains frequency 10, automatic white balance 12.
    units.extend([12, 0x24, 5, PROCESSING, TERMINAL, 0, 0, 2, 0b0100_0000, 0b0001_0110, 0, 0]);
    // Unit 3: what leaves by USB.
    units.extend([9, 0x24, 3, 3, 0x01, 0x01, 0, PROCESSING, 0]);
    units
}

fn formats() -> Vec<u8> {
    /// What all names of uncompressed formats end with.
    const GUID_TAIL: [u8; 12] = [0, 0, 0x10, 0, 0x80, 0, 0, 0xAA, 0, 0x38, 0x9B, 0x71];
    let mut formats = Vec::new();
    for (number, format) in (1..).zip(Format::ALL) {
        let count = SIZES.len() as u8;
        let kind = if format == Format::Mjpg {
            formats.extend([11, 0x24, 6, number, count, 1, 1, 0, 0, 0, 0]);
            7
        } else {
            formats.extend([27, 0x24, 4, number, count]);
            formats.extend(format.guid());
            formats.extend(GUID_TAIL);
            formats.extend([8 * format.bytes_per_pixel() as u8, 1, 0, 0, 0, 0]);
            5
        };
        for (frame, size) in (1..).zip(SIZES) {
            let bytes = frame_bytes(format, size);
            formats.extend([26 + 4 * INTERVALS.len() as u8, 0x24, kind, frame, 0]);
            formats.extend(size.0.to_le_bytes());
            formats.extend(size.1.to_le_bytes());
            // Least and greatest bits a second, bytes of a frame, the interval by default.
            for word in [bytes * 8 * 5, bytes * 8 * 30, bytes, INTERVALS[0]] {
                formats.extend(word.to_le_bytes());
            }
            formats.push(INTERVALS.len() as u8);
            formats.extend(INTERVALS.iter().flat_map(|interval| interval.to_le_bytes()));
        }
        // Colours of sRGB.
        formats.extend([6, 0x24, 0x0D, 1, 1, 4]);
    }
    let count = Format::ALL.len() as u8;
    let mut all = vec![13 + count, 0x24, 1, count];
    all.extend((formats.len() as u16 + 13 + u16::from(count)).to_le_bytes());
    all.extend([0x80 | VIDEO_ENDPOINT, 0, 3, 0, 0, 0, 1]);
    all.extend(vec![0; count.into()]);
    all.extend(formats);
    all
}

/// Bytes of a frame at most.
pub fn frame_bytes(format: Format, (columns, rows): (u16, u16)) -> u32 {
    u32::from(columns) * u32::from(rows) * format.bytes_per_pixel() as u32
}

/// The stream's settings: what is nearest to those that the host asks for.
pub fn offer(model: &Model, asked: &[u8]) -> [u8; PROBE] {
    let mut offer = [0; PROBE];
    offer[..2].copy_from_slice(&asked[..2]);
    offer[2] = asked[2].clamp(1, Format::ALL.len() as u8);
    offer[3] = asked[3].clamp(1, SIZES.len() as u8);
    let interval = match u32::from_le_bytes(asked[4..8].try_into().unwrap()) {
        0 => INTERVALS[0],
        asked => INTERVALS.into_iter().min_by_key(|offered| offered.abs_diff(asked)).unwrap(),
    };
    offer[4..8].copy_from_slice(&interval.to_le_bytes());
    let (format, size) = chosen(&offer);
    offer[18..22].copy_from_slice(&frame_bytes(format, size).to_le_bytes());
    let payload = if model.isochronous { PACKET } else { model.payload };
    offer[22..26].copy_from_slice(&(payload as u32).to_le_bytes());
    offer[26..30].copy_from_slice(&CLOCK_HZ.to_le_bytes());
    // Headers tell frames apart and mark their ends.
    offer[30] = 3;
    offer
}

/// Format and size of an offer.
pub fn chosen(offer: &[u8; PROBE]) -> (Format, (u16, u16)) {
    (Format::ALL[usize::from(offer[2]) - 1], SIZES[usize::from(offer[3]) - 1])
}

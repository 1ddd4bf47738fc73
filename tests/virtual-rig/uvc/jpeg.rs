//! A JPEG encoder (ITU-T T.81, baseline) for pictures whose blocks are flat, as a camera's MJPG: 4:2:2, and
//! without Huffman tables, which many cameras leave out. Nothing is rounded.

/// Side of a block, in px.
pub const BLOCK: usize = 8;

/// Codes of the sizes of differences, from table K.3.
const SIZES: [(u32, u32); 9] = [
    (0b00, 2),
    (0b010, 3),
    (0b011, 3),
    (0b100, 3),
    (0b101, 3),
    (0b110, 3),
    (0b1110, 4),
    (0b11110, 5),
    (0b111110, 6),
];
/// Ends a block of luma, from table K.5.
const END_OF_LUMA: (u32, u32) = (0b1010, 4);
/// No difference, and the end of a block of chroma, from tables K.4 and K.6.
const GREY_CHROMA: (u32, u32) = (0b0000, 4);

/// Makes the first sample of each block its mean.
pub fn flatten(grey: &mut [u8], columns: usize) {
    for top in (0..grey.len()).step_by(BLOCK * columns) {
        for start in (top..top + columns).step_by(BLOCK) {
            let rows = (0..BLOCK).map(|row| start + row * columns);
            let sum: u32 =
                rows.flat_map(|row| grey[row..row + BLOCK].iter()).map(|&level| u32::from(level)).sum();
            grey[start] = (sum / (BLOCK * BLOCK) as u32) as u8;
        }
    }
}

/// Gives each block the level of its first sample.
pub fn spread(grey: &mut [u8], columns: usize) {
    for top in (0..grey.len()).step_by(BLOCK * columns) {
        for start in (top..top + columns).step_by(BLOCK) {
            let level = grey[start];
            (0..BLOCK).for_each(|row| grey[start + row * columns..][..BLOCK].fill(level));
        }
    }
}

struct Bits {
    bytes: Vec<u8>,
    held: u32,
    count: u32,
}

impl Bits {
    fn put(&mut self, (value, length): (u32, u32)) {
        self.held = self.held << length | value;
        self.count += length;
        while self.count >= 8 {
            self.count -= 8;
            let byte = (self.held >> self.count) as u8;
            self.bytes.push(byte);
            // A marker begins with 0xff and another byte than 0.
            if byte == 0xff {
                self.bytes.push(0);
            }
        }
    }

    fn put_difference(&mut self, difference: i32) {
        let size = 32 - difference.unsigned_abs().leading_zeros();
        self.put(SIZES[size as usize]);
        let bits = if difference < 0 { difference - 1 } else { difference };
        self.put((bits.cast_unsigned() & ((1 << size) - 1), size));
    }
}

/// A picture whose blocks are flat.
pub fn encoded(grey: &[u8], columns: usize) -> Vec<u8> {
    let rows = grey.len() / columns;
    let mut bytes = vec![0xff, 0xd8, 0xff, 0xdb, 0, 67, 0];
    // A quantisation of 8: the first coefficient of a flat block is 8 (level - 128).
    bytes.extend([8; 64]);
    bytes.extend([0xff, 0xc0, 0, 17, 8]);
    bytes.extend((rows as u16).to_be_bytes());
    bytes.extend((columns as u16).to_be_bytes());
    bytes.extend([3, 1, 0x21, 0, 2, 0x11, 0, 3, 0x11, 0]);
    bytes.extend([0xff, 0xda, 0, 12, 3, 1, 0x00, 2, 0x11, 3, 0x11, 0, 63, 0]);
    let mut bits = Bits { bytes, held: 0, count: 0 };
    let mut before = 128;
    for top in (0..grey.len()).step_by(BLOCK * columns) {
        for pair in (top..top + columns).step_by(2 * BLOCK) {
            for start in [pair, pair + BLOCK] {
                let level = i32::from(grey[start]);
                bits.put_difference(level - before);
                bits.put(END_OF_LUMA);
                before = level;
            }
            bits.put(GREY_CHROMA);
            bits.put(GREY_CHROMA);
        }
    }
    // The last byte is filled with ones.
    bits.put((0x7f, 7));
    bits.bytes.extend([0xff, 0xd9]);
    bits.bytes
}

//! Reads through the compressed data of a baseline JPEG image, to verify that every block exists (ITU-T T.81
//! F.2.2).

use super::header::Header;
use super::huffman::HuffmanTable;

/// Most bytes between the last block and the end: the firmware of many cameras leaves a few.
const MAXIMUM_SURPLUS: usize = 16;

const TOO_EARLY: &str = "its data end before the last block: part of it was lost";
const IMPOSSIBLE: &str = "its data hold impossible coefficients: they are damaged";

/// Position of the end of the image in `scan`, after the end marker.
///
/// # Errors
/// What is missing or invalid.
pub(super) fn end_of_image(header: &Header, scan: &[u8]) -> Result<usize, String> {
    let blocks = blocks_of_a_unit(header)?;
    let mut bits = Bits { bytes: scan, position: 0, held: 0, count: 0 };
    for unit in 0..units(header) {
        if header.restart_interval > 0 && unit > 0 && unit % header.restart_interval == 0 {
            bits.restart(unit / header.restart_interval - 1)?;
        }
        for &(dc_table, ac_table) in &blocks {
            bits.block(dc_table, ac_table)?;
        }
    }
    bits.end()
}

/// Number of smallest units with blocks of all components.
fn units(header: &Header) -> usize {
    let (across, down) = match header.components[..] {
        // Blocks of a single component come one by one, for any sampling.
        [_] => (1, 1),
        [luma, ..] => (luma.across, luma.down),
        [] => return 0,
    };
    header.columns.div_ceil(8 * across) * header.rows.div_ceil(8 * down)
}

/// The Huffman tables of the blocks of a unit, in order.
fn blocks_of_a_unit(header: &Header) -> Result<Vec<(&HuffmanTable, &HuffmanTable)>, String> {
    let mut blocks = Vec::new();
    for component in &header.components {
        let dc_table = header.dc_tables.get(component.dc_table).and_then(Option::as_ref);
        let ac_table = header.ac_tables.get(component.ac_table).and_then(Option::as_ref);
        let tables = dc_table.zip(ac_table).ok_or("a Huffman table is missing")?;
        let count = if header.components.len() == 1 { 1 } else { component.across * component.down };
        blocks.extend(std::iter::repeat_n(tables, count));
    }
    Ok(blocks)
}

/// The bits of the compressed data up to the next marker.
struct Bits<'a> {
    bytes: &'a [u8],
    /// The next byte.
    position: usize,
    /// Bits taken from `bytes`, from the highest down; lower bits are 0.
    held: u64,
    /// Number of bits held.
    count: u8,
}

impl Bits<'_> {
    /// Loads at least 32 bits, unless a marker or the end comes before.
    #[inline]
    fn refill(&mut self) {
        while self.count <= 56 {
            let Some(&byte) = self.bytes.get(self.position) else { return };
            self.position += 1;
            if byte == 0xff {
                // A data byte 0xff is followed by 0; anything else is a marker.
                if self.bytes.get(self.position) != Some(&0) {
                    self.position -= 1;
                    return;
                }
                self.position += 1;
            }
            self.held |= u64::from(byte) << (56 - self.count);
            self.count += 8;
        }
    }

    #[inline]
    fn skip(&mut self, bits: u8) -> Result<(), &'static str> {
        self.count = self.count.checked_sub(bits).ok_or(TOO_EARLY)?;
        self.held <<= bits;
        Ok(())
    }

    /// Reads a symbol; enough bits for its value are loaded.
    #[inline]
    fn symbol(&mut self, table: &HuffmanTable) -> Result<u8, &'static str> {
        if self.count < 32 {
            self.refill();
        }
        let [.., high, low] = (self.held >> 48).to_be_bytes();
        match table.look_up(u16::from_be_bytes([high, low])) {
            Some((length, symbol)) => self.skip(length).map(|()| symbol),
            None if self.count < 16 => Err(TOO_EARLY),
            None => Err("its data hold an invalid code: they are damaged"),
        }
    }

    #[inline]
    fn block(&mut self, dc_table: &HuffmanTable, ac_table: &HuffmanTable) -> Result<(), &'static str> {
        let bits = self.symbol(dc_table)?;
        // Samples of 8 bit give differences of at most 11 bits and other coefficients of at most 10.
        if bits > 11 {
            return Err(IMPOSSIBLE);
        }
        self.skip(bits)?;
        let mut place = 1;
        while place < 64 {
            let symbol = self.symbol(ac_table)?;
            let (zeros, bits) = (symbol >> 4, symbol & 0xf);
            match (zeros, bits) {
                (15, 0) => place += 16,
                (_, 0) => return Ok(()),
                _ => {
                    place += u32::from(zeros) + 1;
                    if bits > 10 {
                        return Err(IMPOSSIBLE);
                    }
                    self.skip(bits)?;
                }
            }
        }
        if place == 64 { Ok(()) } else { Err(IMPOSSIBLE) }
    }

    /// Skips the padding of the last byte. Returns the number of whole bytes up to the marker, and the
    /// marker.
    fn marker(&mut self) -> Result<(usize, u8), String> {
        let mut surplus = 0;
        loop {
            surplus += usize::from(self.count / 8);
            (self.held, self.count) = (0, 0);
            self.refill();
            if self.count == 0 {
                break;
            }
        }
        // Any number of 0xff may precede a marker.
        let rest = self.bytes.get(self.position..).unwrap_or_default();
        let fill = rest.iter().take_while(|&&byte| byte == 0xff).count();
        let marker = *rest.get(fill).ok_or("its end marker is missing: part of it was lost")?;
        self.position += fill + 1;
        Ok((surplus, marker))
    }

    /// Reads restart marker number `number`, counted from 0.
    fn restart(&mut self, number: usize) -> Result<(), String> {
        match self.marker()? {
            (0, marker @ 0xd0..=0xd7) if usize::from(marker & 7) == number % 8 => Ok(()),
            _ => Err("its restart markers are not in order: part of it was lost".to_owned()),
        }
    }

    fn end(mut self) -> Result<usize, String> {
        match self.marker()? {
            (0..=MAXIMUM_SURPLUS, 0xd9) => Ok(self.position),
            (_, 0xd9) => Err("data follow its last block: they are damaged".to_owned()),
            (_, marker) => Err(format!("marker {marker:02x} follows its data instead of the end")),
        }
    }
}

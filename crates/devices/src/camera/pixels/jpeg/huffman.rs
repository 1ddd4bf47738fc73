//! Huffman codes of JPEG (ITU-T T.81 C and F.2.2.3).

/// Codes up to this length are decoded by a table.
const SHORT: u32 = 9;

/// Decodes codes to symbols.
#[derive(Debug, Clone)]
pub(super) struct HuffmanTable {
    /// For the next [`SHORT`] bits: length and symbol of the code at their start; length 0 if the code is
    /// longer or invalid.
    short: Vec<(u8, u8)>,
    /// For each length: the first code, the number of codes and the place of the first symbol.
    lengths: [(usize, usize, usize); 17],
    symbols: Vec<u8>,
}

impl HuffmanTable {
    /// Builds the table from the numbers of codes of length 1 to 16 and the symbols in order of code.
    ///
    /// # Errors
    /// If there are too many codes, or too few symbols.
    pub(super) fn new(counts: &[u8; 16], symbols: &[u8]) -> Result<Self, String> {
        let mut table =
            Self { short: vec![(0, 0); 1 << SHORT], lengths: [(0, 0, 0); 17], symbols: symbols.to_vec() };
        let (mut code, mut place) = (0, 0);
        for (length, &count) in (1_u8..).zip(counts) {
            let count = usize::from(count);
            let codes = symbols.get(place..place + count).ok_or("a Huffman table is cut off")?;
            if code + count > 1 << length {
                return Err("a Huffman table has more codes than there can be".to_owned());
            }
            table.lengths[usize::from(length)] = (code, count, place);
            if u32::from(length) <= SHORT {
                let span = 1 << (SHORT - u32::from(length));
                for (index, &symbol) in codes.iter().enumerate() {
                    let start = (code + index) * span;
                    table.short[start..start + span].fill((length, symbol));
                }
            }
            code = (code + count) << 1;
            place += count;
        }
        Ok(table)
    }

    /// Length and symbol of the code at the start of the 16 bits `next`; `None` if there is none.
    #[inline]
    pub(super) fn look_up(&self, next: u16) -> Option<(u8, u8)> {
        match self.short[usize::from(next >> (16 - SHORT))] {
            (0, _) => self.look_up_long(next),
            found => Some(found),
        }
    }

    fn look_up_long(&self, next: u16) -> Option<(u8, u8)> {
        (10_u8..=16).find_map(|length| {
            let (first, count, place) = self.lengths[usize::from(length)];
            let index = usize::from(next >> (16 - length)).checked_sub(first)?;
            (index < count).then(|| (length, self.symbols[place + index]))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::standard_tables::{AC_LUMINANCE, DC_LUMINANCE};
    use super::*;

    #[test]
    fn codes_are_those_printed_in_the_standard() {
        // T.81 tables K.3 (category: code) and K.5 (run/size: code).
        let dc = HuffmanTable::new(&DC_LUMINANCE.0, &DC_LUMINANCE.1).unwrap();
        let ac = HuffmanTable::new(&AC_LUMINANCE.0, &AC_LUMINANCE.1).unwrap();
        for (table, symbol, code) in [
            (&dc, 0x00, "00"),
            (&dc, 0x01, "010"),
            (&dc, 0x06, "1110"),
            (&dc, 0x0b, "111111110"),
            (&ac, 0x00, "1010"),
            (&ac, 0x01, "00"),
            (&ac, 0x0a, "1111111110000011"),
            (&ac, 0x72, "111111110111"),
            (&ac, 0xf0, "11111111001"),
            (&ac, 0xfa, "1111111111111110"),
        ] {
            let bits = u16::from_str_radix(&format!("{code:0<16}"), 2).unwrap();
            assert_eq!(table.look_up(bits), Some((u8::try_from(code.len()).unwrap(), symbol)), "{code}");
        }
        assert_eq!(dc.look_up(0xffff), None, "all ones is no code");
        assert_eq!(ac.look_up(0xffff), None, "all ones is no code");
    }

    #[test]
    fn tables_that_cannot_be_are_refused() {
        let mut counts = [0; 16];
        counts[0] = 3;
        assert!(HuffmanTable::new(&counts, &[1, 2, 3]).is_err(), "three codes of one bit");
        counts[0] = 2;
        assert!(HuffmanTable::new(&counts, &[1]).is_err(), "a symbol short");
        assert!(HuffmanTable::new(&[255; 16], &[0; 4080]).is_err());
    }
}

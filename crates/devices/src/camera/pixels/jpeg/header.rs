//! Headers before the compressed data of a JPEG image (ITU-T T.81 B).

use super::huffman::HuffmanTable;
use super::standard_tables;

/// Most rows and columns that decoders, such as libjpeg, accept.
const MAXIMUM_SIZE: usize = 65_500;

/// One colour component of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Component {
    /// Its id in the file.
    identity: u8,
    /// Blocks per row in the smallest unit of all components.
    pub(super) across: usize,
    /// Blocks per column in that unit.
    pub(super) down: usize,
    /// Number of its Huffman table for the first coefficient of a block.
    pub(super) dc_table: usize,
    /// Number of its Huffman table for the other coefficients.
    pub(super) ac_table: usize,
}

/// What is needed to read the compressed data.
#[derive(Debug, Default)]
pub(super) struct Header {
    pub(super) rows: usize,
    pub(super) columns: usize,
    /// One component, or luma and two of chroma.
    pub(super) components: Vec<Component>,
    pub(super) dc_tables: [Option<HuffmanTable>; 4],
    pub(super) ac_tables: [Option<HuffmanTable>; 4],
    /// Units between restart markers, 0 for none.
    pub(super) restart_interval: usize,
    /// Start of the compressed data.
    pub(super) scan_start: usize,
    /// Position of missing Huffman tables, which MJPG may omit. The standard tables then apply, and are in
    /// `dc_tables` and `ac_tables`.
    pub(super) tables_missing_at: Option<usize>,
}

impl Header {
    /// Reads the segments up to the compressed data.
    pub(super) fn parse(bytes: &[u8]) -> Result<Self, String> {
        if !bytes.starts_with(&[0xff, 0xd8]) {
            return Err("it does not begin like a JPEG image".to_owned());
        }
        let mut header = Self::default();
        let mut tables_seen = false;
        let mut position = 2;
        loop {
            let (marker, segment, next) = segment(bytes, position)?;
            match marker {
                0xc0 | 0xc1 if !header.components.is_empty() => {
                    return Err("it has two frame headers".to_owned());
                }
                0xc0 | 0xc1 => header.start_of_frame(segment)?,
                0xc4 => {
                    tables_seen = true;
                    header.huffman_tables(segment)?;
                }
                0xda => {
                    if !tables_seen {
                        header.tables_missing_at = Some(position);
                        header.huffman_tables(&standard_tables::segment()[4..])?;
                    }
                    header.start_of_scan(segment)?;
                    header.scan_start = next;
                    return Ok(header);
                }
                0xdd => header.restart_interval = usize::from(word(segment, 0)?),
                // Adobe's colour marker: 0 means neither luma nor chroma.
                0xee if header_says_no_luma(segment) => {
                    return Err("its colours are not luma and chroma".to_owned());
                }
                // The decoder checks quantisation tables; application data and comments are ignored.
                0xdb | 0xe0..=0xef | 0xfe => {}
                0xc2 | 0xc3 | 0xc5..=0xcf => return Err("it is not baseline JPEG".to_owned()),
                _ => return Err(format!("marker {marker:02x} does not belong before its data")),
            }
            position = next;
        }
    }

    fn start_of_frame(&mut self, segment: &[u8]) -> Result<(), String> {
        let cut_off = "its frame header is cut off";
        let (&[depth, ..], Some(&count)) = (segment, segment.get(5)) else { return Err(cut_off.to_owned()) };
        if depth != 8 {
            return Err(format!("its samples have {depth} bit instead of 8"));
        }
        self.rows = usize::from(word(segment, 1)?);
        self.columns = usize::from(word(segment, 3)?);
        if self.rows.min(self.columns) == 0 || self.rows.max(self.columns) > MAXIMUM_SIZE {
            return Err(format!("it claims {} rows x {} columns", self.rows, self.columns));
        }
        let components = segment.get(6..).unwrap_or_default().as_chunks::<3>();
        if !matches!(count, 1 | 3) || components.0.len() != usize::from(count) || !components.1.is_empty() {
            return Err(format!("it has {count} colours instead of 1 or 3, or {cut_off}"));
        }
        self.components = components
            .0
            .iter()
            .map(|&[identity, sampling, _]| {
                let (across, down) = (usize::from(sampling >> 4), usize::from(sampling & 0xf));
                Component { identity, across, down, dc_table: 0, ac_table: 0 }
            })
            .collect();
        let sampling_ok = self.components.iter().all(|component| {
            (1..=4).contains(&component.across)
                && (1..=4).contains(&component.down)
                && component.across <= self.components[0].across
                && component.down <= self.components[0].down
        });
        if !sampling_ok {
            return Err("its luma does not have the full resolution".to_owned());
        }
        if self.components.iter().map(|component| component.identity).eq(*b"RGB") {
            return Err("its colours are red, green and blue instead of luma and chroma".to_owned());
        }
        Ok(())
    }

    fn huffman_tables(&mut self, mut segment: &[u8]) -> Result<(), String> {
        while let Some((&[which, ref counts @ ..], rest)) = segment.split_first_chunk::<17>() {
            let length = counts.iter().map(|&count| usize::from(count)).sum();
            let (symbols, rest) = rest.split_at_checked(length).ok_or("a Huffman table is cut off")?;
            let tables = match which >> 4 {
                0 => &mut self.dc_tables,
                1 => &mut self.ac_tables,
                _ => return Err("a Huffman table is of an unknown kind".to_owned()),
            };
            let table = tables.get_mut(usize::from(which & 0xf)).ok_or("there is a fifth Huffman table")?;
            *table = Some(HuffmanTable::new(counts, symbols)?);
            segment = rest;
        }
        if segment.is_empty() { Ok(()) } else { Err("a Huffman table is cut off".to_owned()) }
    }

    fn start_of_scan(&mut self, segment: &[u8]) -> Result<(), String> {
        if self.components.is_empty() {
            return Err("its frame header is missing".to_owned());
        }
        let count = self.components.len();
        let selectors = segment.get(1..1 + 2 * count).unwrap_or_default().as_chunks::<2>().0;
        if segment.first().map(|&count| usize::from(count)) != Some(count) || segment.len() != 4 + 2 * count {
            return Err("its colours do not come in one scan".to_owned());
        }
        for (component, &[identity, tables]) in self.components.iter_mut().zip(selectors) {
            if component.identity != identity {
                return Err("the colours of its scan are not those of its frame header".to_owned());
            }
            component.dc_table = usize::from(tables >> 4);
            component.ac_table = usize::from(tables & 0xf);
        }
        Ok(())
    }
}

/// Whether an Adobe segment says that the components are red, green and blue.
fn header_says_no_luma(segment: &[u8]) -> bool {
    segment.starts_with(b"Adobe") && segment.get(11) == Some(&0)
}

/// Marker, content and end of the segment at `position`.
fn segment(bytes: &[u8], mut position: usize) -> Result<(u8, &[u8], usize), String> {
    let cut_off = || "it ends within its headers".to_owned();
    if *bytes.get(position).ok_or_else(cut_off)? != 0xff {
        return Err("bytes outside all segments precede its data".to_owned());
    }
    // Any number of 0xff may precede a marker.
    while bytes.get(position) == Some(&0xff) {
        position += 1;
    }
    let marker = *bytes.get(position).ok_or_else(cut_off)?;
    // Markers without content; none is allowed here.
    if matches!(marker, 0x00 | 0x01 | 0xd0..=0xd9) {
        return Ok((marker, &[], position + 1));
    }
    let start = position + 1;
    let length = usize::from(word(bytes, start).map_err(|_| cut_off())?);
    let content = bytes.get(start + 2..start + length.max(2)).ok_or_else(cut_off)?;
    if length < 2 {
        Err("a segment has an impossible length".to_owned())
    } else {
        Ok((marker, content, start + length))
    }
}

/// The big-endian word at `position`.
fn word(bytes: &[u8], position: usize) -> Result<u16, String> {
    let word = bytes.get(position..).and_then(|rest| rest.first_chunk());
    word.copied().map(u16::from_be_bytes).ok_or_else(|| "a segment is cut off".to_owned())
}

//! The option that limits memory.

use clap::Args;

/// Most memory of what holds all frames.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct MemoryArgument {
    /// Most memory to take, such as 2GiB or 800MB [default: half of what is free]. Frames that are more are packed on
    /// disk first, and read a part at a time. The results are the same
    #[arg(long = "memory", value_name = "SIZE", value_parser = parse_size)]
    pub(super) limit: Option<u64>,
}

/// The sizes that a number may be followed by.
const UNITS: [(&str, u64); 7] = [
    ("KiB", 1 << 10),
    ("MiB", 1 << 20),
    ("GiB", 1 << 30),
    ("TiB", 1 << 40),
    ("MB", 1_000_000),
    ("GB", 1_000_000_000),
    ("TB", 1_000_000_000_000),
];

/// Bytes from a text such as "1.5 GiB".
fn parse_size(text: &str) -> Result<u64, String> {
    let wrong =
        || format!("\"{text}\" is not a size of memory; write a number and its unit, such as 2GiB or 800MB");
    let unit = UNITS.iter().find(|(name, _)| {
        let end = text.len().checked_sub(name.len()).and_then(|at| text.get(at..));
        end.is_some_and(|end| end.eq_ignore_ascii_case(name))
    });
    let &(name, bytes) = unit.ok_or_else(wrong)?;
    let number: f64 = text[..text.len() - name.len()].trim().parse().map_err(|_| wrong())?;
    let size = number * bytes as f64;
    if size >= 1.0 && size < u64::MAX as f64 { Ok(size as u64) } else { Err(wrong()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_a_number_and_a_unit() {
        for (text, bytes) in
            [("1GiB", 1 << 30), ("1.5 gib", 3 << 29), ("800MB", 800_000_000), ("64 KiB", 65536)]
        {
            assert_eq!(parse_size(text), Ok(bytes), "{text}");
        }
        for text in ["", "12", "GiB", "-1GB", "0MB", "nan GB", "inf GB", "1e40GB", "1 G", "\u{e4}GB"] {
            let refused = parse_size(text).unwrap_err();
            assert!(refused.contains("such as 2GiB"), "{refused}");
        }
    }
}

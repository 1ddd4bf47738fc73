//! X3P of ISO 25178-72 (formerly ISO 5436-2), after the schema of openGPS
//! (<http://www.opengps.eu/2008/ISO5436_2>).
//!
//! A zip archive with `main.xml` (axes, origin of the data, size of the matrix), `bindata/data.bin` (32-bit
//! floats in m, little endian, row by row from the top; NaN for unknown) and `md5checksum.hex` (the MD5 of
//! `main.xml`). x goes to the right and y down, as in the picture; z goes towards the camera.

use std::io::{Cursor, Write};

use md5::{Digest, Md5};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::codec::{Codec, LengthMap, MapFacts};
use super::error::{FormatError, malformed};
use epirig_core::grid::Grid;

pub(super) const CODEC: Codec =
    Codec { name: NAME, extensions: &["x3p"], encode, holds_facts: true, lengths_only: true, decode: None };

const NAME: &str = "X3P";
const DATA: &str = "bindata/data.bin";
const CHECKSUM: &str = "md5checksum.hex";
/// The schema wants a time; this one stands for "not known".
const NO_TIME: &str = "1970-01-01T00:00:00Z";

fn encode(map: &Grid<f32>, facts: &MapFacts) -> Result<Vec<u8>, FormatError> {
    let LengthMap { pixel_mm } = LengthMap::of(NAME, map, facts)?;
    let mut data = Vec::with_capacity(4 * map.values().len());
    map.values()
        .iter()
        .for_each(|&height_mm| data.extend(((f64::from(height_mm) * 1e-3) as f32).to_le_bytes()));
    let xml = main_xml(map, pixel_mm * 1e-3, facts, &hash(&data));
    let checksum = format!("{} *main.xml\n", hash(xml.as_bytes()));
    let files = [("main.xml", xml.as_bytes()), (DATA, &data[..]), (CHECKSUM, checksum.as_bytes())];
    archive(&files).map_err(|error| malformed(NAME, error))
}

fn archive(files: &[(&str, &[u8])]) -> zip::result::ZipResult<Vec<u8>> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    // The same map gives the same bytes: no time of writing.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .compression_level(Some(1))
        .last_modified_time(DateTime::default());
    for (name, bytes) in files {
        writer.start_file(*name, options)?;
        writer.write_all(bytes)?;
    }
    Ok(writer.finish()?.into_inner())
}

fn hash(bytes: &[u8]) -> String {
    Md5::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn main_xml(map: &Grid<f32>, pixel_m: f64, facts: &MapFacts, data_hash: &str) -> String {
    let taken = escaped(facts.taken.as_deref().unwrap_or(NO_TIME));
    let comment = escaped(&facts.line());
    let version = env!("CARGO_PKG_VERSION");
    let (columns, rows) = (map.columns(), map.rows());
    format!(
        r#"<?xml version="1.0" encoding="UTF-8" standalone="no"?>
<p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:schemaLocation="http://www.opengps.eu/2008/ISO5436_2 http://www.opengps.eu/2008/ISO5436_2/ISO5436_2.xsd">
  <Record1>
    <Revision>ISO5436 - 2000</Revision>
    <FeatureType>SUR</FeatureType>
    <Axes>
      <CX>
        <AxisType>I</AxisType>
        <DataType>D</DataType>
        <Increment>{pixel_m:e}</Increment>
        <Offset>0</Offset>
      </CX>
      <CY>
        <AxisType>I</AxisType>
        <DataType>D</DataType>
        <Increment>{pixel_m:e}</Increment>
        <Offset>0</Offset>
      </CY>
      <CZ>
        <AxisType>A</AxisType>
        <DataType>F</DataType>
        <Increment>1</Increment>
        <Offset>0</Offset>
      </CZ>
    </Axes>
  </Record1>
  <Record2>
    <Date>{taken}</Date>
    <Creator>epirig {version}</Creator>
    <Instrument>
      <Manufacturer>not available</Manufacturer>
      <Model>camera on a linear stage</Model>
      <Serial>not available</Serial>
      <Version>epirig {version}</Version>
    </Instrument>
    <CalibrationDate>{taken}</CalibrationDate>
    <ProbingSystem>
      <Type>NonContacting</Type>
      <Identification>epipolar plane images</Identification>
    </ProbingSystem>
    <Comment>{comment}</Comment>
  </Record2>
  <Record3>
    <MatrixDimension>
      <SizeX>{columns}</SizeX>
      <SizeY>{rows}</SizeY>
      <SizeZ>1</SizeZ>
    </MatrixDimension>
    <DataLink>
      <PointDataLink>{DATA}</PointDataLink>
      <MD5ChecksumPointData>{data_hash}</MD5ChecksumPointData>
    </DataLink>
  </Record3>
  <Record4>
    <ChecksumFile>{CHECKSUM}</ChecksumFile>
  </Record4>
</p:ISO5436_2>
"#
    )
}

/// Text that cannot end its element.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::super::codec::Quantity;
    use super::*;

    #[test]
    fn the_archive_holds_what_the_standard_asks_for() {
        let map = Grid::from_values(1, 2, vec![0.25, f32::NAN]).unwrap();
        let title = "a<b & c\nd".to_owned();
        let mut facts =
            MapFacts { quantity: Quantity::LengthMm, pixel_mm: Some(0.5), title, ..MapFacts::default() };
        facts.taken = Some("2024-05-06T07:08:09Z".to_owned());
        let bytes = encode(&map, &facts).unwrap();
        assert_eq!(bytes, encode(&map, &facts).unwrap(), "no time of writing");
        // Version 2.0 of zip is needed to unpack, and `main.xml` comes first: readers know the format by that.
        assert_eq!(&bytes[..5], b"PK\x03\x04\x14");
        let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
        let mut file = |name: &str| {
            let mut bytes = Vec::new();
            archive.by_name(name).unwrap().read_to_end(&mut bytes).unwrap();
            bytes
        };
        let (xml, data, checksum) = (file("main.xml"), file(DATA), file(CHECKSUM));
        assert_eq!(data[..4], 2.5e-4_f32.to_le_bytes());
        assert!(f32::from_le_bytes(data[4..].try_into().unwrap()).is_nan());
        assert_eq!(checksum, format!("{} *main.xml\n", hash(&xml)).into_bytes());
        let text = String::from_utf8(xml).unwrap();
        for part in [
            "<SizeX>2</SizeX>",
            "<SizeY>1</SizeY>",
            "<Increment>5e-4</Increment>",
            "<Comment>a&lt;b &amp; c d</Comment>",
            "<Date>2024-05-06T07:08:09Z</Date>",
            &format!("<MD5ChecksumPointData>{}</MD5ChecksumPointData>", hash(&data)),
        ] {
            assert!(text.contains(part), "{part} in {text}");
        }
    }

    #[test]
    fn the_hash_is_that_of_rfc_1321() {
        assert_eq!(hash(b"message digest"), "f96b697d7cb7938d525a2f31aaf161d0");
    }

    #[test]
    fn what_is_no_length_or_has_no_scale_is_refused() {
        let map = Grid::from_values(1, 1, vec![0.25]).unwrap();
        assert!(encode(&map, &MapFacts::default()).is_err());
        let facts =
            MapFacts { quantity: Quantity::LengthMm, pixel_mm: Some(f64::NAN), ..MapFacts::default() };
        assert!(matches!(encode(&map, &facts), Err(FormatError::Unsuitable { .. })));
    }
}

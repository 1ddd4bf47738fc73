//! Photographs and truth as files.

use image::metadata::Orientation as Turn;
use image::{DynamicImage, ImageDecoder, ImageReader};

use epirig_photographs::{Orientation, Photographs};

#[test]
fn a_reader_that_heeds_the_tag_gets_the_upright_photograph() {
    let cases = [
        (Orientation::Upright, Turn::NoTransforms),
        (Orientation::HalfTurn, Turn::Rotate180),
        (Orientation::Clockwise, Turn::Rotate90),
        (Orientation::Counterclockwise, Turn::Rotate270),
    ];
    for (orientation, turn) in cases {
        let folder = tempfile::tempdir().unwrap();
        let asked = Photographs { orientation, exif_focal_length: true, ..Photographs::sized(80, 120, 2) };
        let series = asked.take();
        series.write_photographs(folder.path());
        let path = folder.path().join(series.file_name(1));
        let mut decoder = ImageReader::open(path).unwrap().into_decoder().unwrap();
        assert_eq!(decoder.orientation().unwrap(), turn);
        let is_turned = matches!(turn, Turn::Rotate90 | Turn::Rotate270);
        assert_eq!(decoder.dimensions(), if is_turned { (80, 120) } else { (120, 80) });
        let mut picture = DynamicImage::from_decoder(decoder).unwrap();
        picture.apply_orientation(turn);
        let upright = picture.into_luma8();
        assert_eq!(upright.dimensions(), (120, 80));
        assert!(upright.as_raw() == series.frame(1).values(), "{orientation:?}");
        // JPEG takes little away.
        let exposed = series.exposed(1);
        let squares =
            upright.as_raw().iter().zip(exposed.values()).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
        let rms = (squares.sum::<f64>() / 9600.0).sqrt();
        assert!(rms < 6.0, "{orientation:?}: {rms} grey values");
    }
}

#[test]
fn names_tell_what_is_missing_or_not() {
    let folder = tempfile::tempdir().unwrap();
    let asked = Photographs { missing: vec![2], jpeg_quality: None, ..Photographs::sized(40, 60, 4) };
    let names = |asked: &Photographs| {
        let series = asked.take();
        (0..series.count()).map(|frame| series.file_name(frame)).collect::<Vec<_>>()
    };
    assert_eq!(names(&asked), ["IMG_0001.png", "IMG_0003.png", "IMG_0004.png"]);
    let renumbered = Photographs { renumbered: true, ..asked.clone() };
    assert_eq!(names(&renumbered), ["IMG_0001.png", "IMG_0002.png", "IMG_0003.png"]);
    let series = asked.take();
    series.write_photographs(folder.path());
    let read = image::open(folder.path().join("IMG_0003.png")).unwrap().into_luma8();
    assert!(read.as_raw() == series.frame(1).values(), "a PNG image is not what was seen");
}

#[test]
fn the_truth_is_written_beside_them() {
    let folder = tempfile::tempdir().unwrap();
    let series = Photographs { roll_deg: 5.0, wobble_deg: 0.1, ..Photographs::sized(40, 60, 3) }.take();
    series.write_truth(folder.path());
    let text = std::fs::read_to_string(folder.path().join("truth.json")).unwrap();
    let record: serde_json::Value = serde_json::from_str(&text).unwrap();
    for frame in 0..3 {
        assert_eq!(record["positions_mm"][frame], series.motion.positions_mm[frame]);
        assert_eq!(record["rotations"][frame][1], series.motion.rotations[frame].y);
    }
    assert_eq!(record["direction"][1], series.motion.direction.y);
    let bytes = std::fs::read(folder.path().join("parallax.npy")).unwrap();
    let last = f32::from_le_bytes(*bytes.last_chunk().unwrap());
    assert_eq!(bytes.len(), 128 + 4 * 40 * 60);
    assert!(bytes.starts_with(b"\x93NUMPY") && bytes[127] == b'\n');
    assert_eq!(last, series.parallax(1).at(59, 39) as f32);
}

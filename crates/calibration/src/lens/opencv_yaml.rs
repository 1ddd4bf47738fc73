//! OpenCV's files (`cv::FileStorage`, YAML).

use super::Lens;
pub use super::yaml::read_lens;
use super::yaml::{camera_matrix, distortion, list};

/// A file that `cv::FileStorage` reads, with the names that OpenCV's calibration sample gives. Numbers come
/// back to the last bit.
pub fn write(rows: usize, columns: usize, lens: &Lens) -> String {
    format!(
        "%YAML:1.0\n---\nimage_width: {columns}\nimage_height: {rows}\ncamera_matrix: {}distortion_coefficients: {}",
        matrix(3, 3, &camera_matrix(lens)),
        matrix(1, 5, &distortion(lens)),
    )
}

fn matrix(rows: usize, columns: usize, values: &[f64]) -> String {
    let data = list(values);
    format!("!!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: {data}\n")
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::lens::LensFile;

    proptest! {
        #[test]
        fn numbers_come_back_to_the_last_bit(
            focal in prop::array::uniform2(1e-3..1e9),
            place in prop::array::uniform2(-1e4..1e4),
            terms in prop::array::uniform5(proptest::num::f64::NORMAL | proptest::num::f64::ZERO | proptest::num::f64::SUBNORMAL),
            rows in 1_usize..10_000,
            columns in 1_usize..10_000,
        ) {
            let [k1, k2, p1, p2, k3] = terms;
            let lens = Lens::from_array([focal[0], focal[1], place[0], place[1], k1, k2, p1, p2, k3]);
            let found = read_lens(&write(rows, columns, &lens)).unwrap();
            prop_assert_eq!(found, LensFile { rows: Some(rows), columns: Some(columns), lens });
        }

        #[test]
        fn no_text_makes_it_panic(text in "(%YAML:1.0\n)?([a-zA-Z0-9_:!. \\-\\[\\],{}&*\n]{0,80})") {
            let _ = read_lens(&text);
        }
    }

    #[test]
    fn deep_nesting_is_no_crash() {
        for bracket in ["[", "{a: ", "- "] {
            assert!(read_lens(&format!("a: 1\nb: {}", bracket.repeat(100_000))).is_err());
            assert!(read_lens(&bracket.repeat(50_000)).is_err());
        }
    }

    const SAMPLE: &str = "%YAML:1.0\n---\nimage_width: 640\nflags: 2\nM1: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ \
        5.3480326845051309e+02, 0., 3.3568643204394891e+02, 0.,\n       5.3480326845051309e+02, 2.4066183054066337e+02, 0., 0., 1. ]\n\
        D1: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   data: [ 2.9589439552724328e-01, -1.03, 0., .5, 0. ]\n";

    #[test]
    fn a_file_of_opencv_is_read() {
        let found = read_lens(SAMPLE).unwrap();
        assert_eq!((found.rows, found.columns), (None, Some(640)));
        let [fx, fy, cx, cy] = [
            5.348_032_684_505_131e2,
            5.348_032_684_505_131e2,
            3.356_864_320_439_489e2,
            2.406_618_305_406_633_7e2,
        ];
        assert_eq!(found.lens.to_array(), [fx, fy, cx, cy, 2.958_943_955_272_433e-1, -1.03, 0.0, 0.5, 0.0]);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let said = |from: &str, to: &str| {
            assert!(SAMPLE.contains(from), "{from}");
            read_lens(&SAMPLE.replace(from, to)).unwrap_err().to_string()
        };
        let starts = |message: String, start: &str| assert!(message.starts_with(start), "{message}");
        starts(
            said("M1:", "M9:"),
            "there is no matrix of the camera (a key named camera_matrix, cameraMatrix, M1)",
        );
        starts(said("D1:", "D9:"), "there is no distortion");
        starts(said("0.,\n", "0.5,\n"), "line 5: M1 is not a matrix fx 0 cx, 0 fy cy, 0 0 1");
        starts(said("-1.03", "x"), "line 15: D1 is not a number");
        starts(said("-1.03", ".Nan"), "line 15: D1 is not a number");
        starts(said("-1.03, 0.", "0."), "line 11: D1 is not a matrix with as many numbers");
        starts(said("640", "-640"), "line 3: image_width is not a whole number above 0");
        starts(
            said("flags: 2", "fisheye_model: 1"),
            "line 4: fisheye_model says that this is a fisheye lens; calibrate again",
        );
        starts(said("---", "[---"), "line ");
        let more = said(
            "cols: 5\n   dt: d\n   data: [ 2.9589439552724328e-01, -1.03, 0., .5, 0.",
            "cols: 8\n   dt: d\n   data: [ 1., 1., 1., 1., 1., 0., 1., 0.",
        );
        starts(
            more,
            "line 11: D1 has 8 terms, of which number 7 is not 0; calibrate again with the model of five terms",
        );
        starts(
            read_lens("<?xml version=\"1.0\"?>\n<opencv_storage>").unwrap_err().to_string(),
            "this is XML: write it as YAML",
        );
        starts(read_lens("{ \"M1\": 3 }").unwrap_err().to_string(), "this is JSON");
    }
}

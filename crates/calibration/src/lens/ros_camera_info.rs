//! ROS's camera calibration files (`camera_info`, YAML).

use super::Lens;
use super::yaml::{camera_matrix, distortion, list};

/// A camera calibration file of ROS with the model `plumb_bob`: its rectified frames are not turned, and
/// have the lens without distortion. Numbers come back to the last bit.
pub fn write(camera_name: &str, rows: usize, columns: usize, lens: &Lens) -> String {
    let [fx, fy, cx, cy, ..] = lens.to_array();
    format!(
        "image_width: {columns}\nimage_height: {rows}\ncamera_name: {}\ncamera_matrix:\n{}distortion_model: plumb_bob\n\
         distortion_coefficients:\n{}rectification_matrix:\n{}projection_matrix:\n{}",
        quoted(camera_name),
        matrix(3, 3, &camera_matrix(lens)),
        matrix(1, 5, &distortion(lens)),
        matrix(3, 3, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]),
        matrix(3, 4, &[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]),
    )
}

fn matrix(rows: usize, columns: usize, values: &[f64]) -> String {
    format!("  rows: {rows}\n  cols: {columns}\n  data: {}\n", list(values))
}

/// A string in double quotes; characters that may not stand in them are escaped.
fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for character in text.chars() {
        match character {
            '"' | '\\' => quoted.extend(['\\', character]),
            ' '..='~' => quoted.push(character),
            other => quoted.push_str(&format!("\\U{:08x}", u32::from(other))),
        }
    }
    quoted.push('"');
    quoted
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use saphyr::{LoadableYamlNode, Yaml};

    use super::*;
    use crate::lens::LensFile;
    use crate::lens::yaml::read_lens;

    proptest! {
        #[test]
        fn what_is_written_is_read(values in prop::array::uniform9(1e-9..1e5), name in any::<String>()) {
            let lens = Lens::from_array(values);
            let file = write(&name, 480, 640, &lens);
            prop_assert_eq!(read_lens(&file).unwrap(), LensFile { rows: Some(480), columns: Some(640), lens });
            let documents = Yaml::load_from_str(&file).unwrap();
            prop_assert_eq!(documents[0]["camera_name"].as_str(), Some(name.as_str()));
        }
    }

    #[test]
    fn the_file_is_as_ros_writes_it() {
        let lens = Lens::from_array([500.0, 510.0, 320.5, 240.5, -0.25, 1e-7, 0.0, 0.0, 0.0]);
        let expected = "image_width: 640\nimage_height: 480\ncamera_name: \"rig\"\ncamera_matrix:\n  rows: 3\n  cols: 3\n  \
            data: [ 500.0, 0.0, 320.5, 0.0, 510.0, 240.5, 0.0, 0.0, 1.0 ]\ndistortion_model: plumb_bob\n\
            distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [ -0.25, 1.0e-7, 0.0, 0.0, 0.0 ]\n\
            rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [ 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0 ]\n\
            projection_matrix:\n  rows: 3\n  cols: 4\n  data: [ 500.0, 0.0, 320.5, 0.0, 0.0, 510.0, 240.5, 0.0, 0.0, 0.0, 1.0, 0.0 ]\n";
        assert_eq!(write("rig", 480, 640, &lens), expected);
        let other = expected.replace("plumb_bob", "equidistant");
        let message = read_lens(&other).unwrap_err().to_string();
        assert!(message.starts_with("line 8: distortion_model is equidistant; calibrate again"), "{message}");
    }
}

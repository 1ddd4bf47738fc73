//! ROS's camera calibration files (`camera_info`, YAML).

use super::yaml::{camera_matrix, distortion, list, read};
use super::{Lens, LensFile, LensFileError};

/// The content of a camera calibration file of ROS.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraInfo {
    /// Name of the camera.
    pub camera_name: String,
    /// Rows of its frames.
    pub rows: usize,
    /// Columns of its frames.
    pub columns: usize,
    /// The lens.
    pub lens: Lens,
    /// R: turns rays of the camera into those of rectified frames.
    pub rectification: [[f64; 3]; 3],
    /// P: from the rectified frame of the camera to pixels of rectified frames.
    pub projection: [[f64; 4]; 3],
}

impl CameraInfo {
    /// The lens of the rectified frames: without distortion, and not turned.
    pub fn unrectified(camera_name: &str, rows: usize, columns: usize, lens: Lens) -> Self {
        let [fx, fy, cx, cy, ..] = lens.to_array();
        Self {
            camera_name: camera_name.to_owned(),
            rows,
            columns,
            lens,
            rectification: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            projection: [[fx, 0.0, cx, 0.0], [0.0, fy, cy, 0.0], [0.0, 0.0, 1.0, 0.0]],
        }
    }

    /// The file, with ROS's model `plumb_bob`. Numbers come back to the last bit.
    pub fn to_yaml(&self) -> String {
        format!(
            "image_width: {}\nimage_height: {}\ncamera_name: {}\ncamera_matrix:\n{}distortion_model: plumb_bob\n\
             distortion_coefficients:\n{}rectification_matrix:\n{}projection_matrix:\n{}",
            self.columns,
            self.rows,
            quoted(&self.camera_name),
            matrix(3, 3, &camera_matrix(&self.lens)),
            matrix(1, 5, &distortion(&self.lens)),
            matrix(3, 3, self.rectification.as_flattened()),
            matrix(3, 4, self.projection.as_flattened()),
        )
    }
}

/// The lens in a camera calibration file of ROS; its rectification is not read.
///
/// # Errors
/// [`LensFileError`] with the line if it is no such file, or of another model than `plumb_bob`.
pub fn read_lens(file: &str) -> Result<LensFile, LensFileError> {
    read(file)
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

    proptest! {
        #[test]
        fn what_is_written_is_read(values in prop::array::uniform9(1e-9..1e5), name in any::<String>()) {
            let lens = Lens::from_array(values);
            let file = CameraInfo::unrectified(&name, 480, 640, lens).to_yaml();
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
        assert_eq!(CameraInfo::unrectified("rig", 480, 640, lens).to_yaml(), expected);
        let other = expected.replace("plumb_bob", "equidistant");
        let message = read_lens(&other).unwrap_err().to_string();
        assert!(message.starts_with("line 8: distortion_model is equidistant; calibrate again"), "{message}");
    }
}

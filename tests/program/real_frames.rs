//! Photographs of plants in front of a wall: occlusions, points that leave the image, vignetting, small step errors.
//!
//! The photographs may not be shipped; where they are not, the test says so and does nothing.

use std::path::Path;

use crate::support::succeeds;

#[test]
fn left_out_photographs_are_predicted() {
    let trees = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/trees");
    if !trees.exists() {
        eprintln!("SKIPPED left_out_photographs_are_predicted: {} is not there", trees.display());
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &["import", trees.to_str().unwrap(), "--out", "trees", "--frames", "40..80"]);
    let arguments = ["evaluate", "trees", "--leave-out", "5", "--reference", "middle", "--json"];
    let report: serde_json::Value = serde_json::from_str(&succeeds(folder.path(), &arguments)).unwrap();
    let number = |key: &str| report[key].as_f64().unwrap();
    // Half the error of repetition on 60 % of the pixels.
    assert!(number("predicted") >= 0.6, "{report}");
    assert!(number("prediction_error_dn") <= 0.5 * number("repetition_error_dn"), "{report}");
    // The same pixel by pixel.
    assert!(number("halved") >= 0.6, "{report}");
}

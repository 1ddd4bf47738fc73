//! The classes of pixels in the maps `mask.png` and `used.png`: value, colour and words of each, in one place. What an answer
//! means is said by its type.

use epirig_core::choice::Choice as _;
use epirig_matcher::Validity;

/// A class of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Class {
    /// The grey value of its pixels in the file of the map.
    pub value: u8,
    /// Its colour in pictures: red, green, blue.
    pub colour: [u8; 3],
    /// What it is called.
    pub name: &'static str,
}

/// The classes of `mask.png`: the answers in their order, at last that of pixels that were not asked for. The colours
/// are distinct for people with any colour vision (Wong 2011).
pub const ANSWER_CLASSES: [Class; Validity::ALL.len()] = [
    Class { value: 255, colour: [240, 240, 240], name: "answered" },
    Class { value: 0, colour: [60, 60, 60], name: "leaves the image" },
    Class { value: 40, colour: [0, 114, 178], name: "beyond the range" },
    Class { value: 80, colour: [230, 159, 0], name: "too uncertain" },
    Class { value: 120, colour: [213, 94, 0], name: "occluded" },
    Class { value: 160, colour: [204, 121, 167], name: "ambiguous" },
    Class { value: 200, colour: [130, 130, 130], name: "outside mask or region" },
];

/// The class of an answer.
pub const fn class_of(validity: Validity) -> Class {
    ANSWER_CLASSES[validity as usize]
}

/// Why a pixel has this answer, in words.
pub fn reason(validity: Validity) -> String {
    let mut words = validity.help().trim_end_matches('.').to_owned();
    words[..1].make_ascii_lowercase();
    words
}

/// Uses of the pixels of a surface, the classes of `used.png`: for the levels; used, but not for the levels (too near
/// to a wall, or an outlier); a height that is not used; at last no height.
pub const USED_CLASSES: [Class; 4] = [
    Class { value: 255, colour: [0, 158, 115], name: "used" },
    Class { value: 160, colour: [230, 159, 0], name: "walls and outliers" },
    Class { value: 80, colour: [86, 180, 233], name: "left out" },
    Class { value: 0, colour: [60, 60, 60], name: "no height" },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_the_mask_are_those_of_the_manual() {
        let manual = include_str!("../../docs/src/results.md");
        let values = [255, 0, 40, 80, 120, 160, 200];
        for (&validity, value) in Validity::ALL.iter().zip(values) {
            let Class { name, .. } = class_of(validity);
            assert_eq!(class_of(validity).value, value, "{validity}");
            assert!(manual.contains(&format!("| {value} | {name}")), "{name}");
        }
        assert_eq!(class_of(Validity::Occluded).name, "occluded");
        assert_eq!(class_of(Validity::Ambiguous).name, "ambiguous");
        assert_eq!(reason(Validity::NoTexture), "too uncertain: little texture, or no line fits");
    }
}

//! Colours and names of the classes of pixels in pictures.

use crate::report::Class;
use crate::results::mask_value;
use epirig_matcher::Answer;

/// Kinds of answers, as in `mask.png`, in colours that are distinct for people with any colour vision (Wong 2011).
pub fn answer_classes() -> [Class; 7] {
    let class = |answer, colour, name| Class { value: mask_value(answer), colour, name };
    [
        class(Answer::Found, [240, 240, 240], "answered"),
        class(Answer::LeavesImage, [60, 60, 60], "leaves the image"),
        class(Answer::BeyondRange, [0, 114, 178], "at an end of the range"),
        class(Answer::NoTexture, [230, 159, 0], "too uncertain: little texture, or no line fits"),
        class(Answer::Occluded, [213, 94, 0], "occluded"),
        class(Answer::Ambiguous, [204, 121, 167], "ambiguous"),
        class(Answer::Outside, [130, 130, 130], "outside mask or region"),
    ]
}

//! A motion that a match does not take for granted, in words: its direction and its steps.

use crate::calibrate::some_of;
use epirig_calibration::motion::Doubt;
use epirig_calibration::texture_motion::Return;

/// What is wrong with direction or steps, and the cure; `None` for other doubts. `name` names a frame, `calibrate` is
/// the command that measures positions.
pub(super) fn words(doubt: &Doubt, name: &dyn Fn(usize) -> String, calibrate: &str) -> Option<String> {
    Some(match doubt {
        Doubt::Vertical => {
            format!(
                "what moves goes along the columns, and a match needs motion along the rows: `{calibrate}` turns the frames"
            )
        }
        Doubt::Oblique { degrees, drift_px } => {
            let size = degrees.abs();
            let how_far = match drift_px {
                Some(drift_px) => {
                    // As many digits as tell a tenth of a pixel over the baseline.
                    let digits = if size < 10.0 { 2 } else { 1 };
                    format!(
                        "at {size:.digits$} degrees to the rows, {drift_px:.1} px across them from the first image to the last"
                    )
                }
                None => format!("at about {size:.0} degrees to the rows"),
            };
            format!(
                "what moves goes {how_far}, and a match needs motion along them: `{calibrate}` measures the direction and turns the frames"
            )
        }
        Doubt::Uneven { displacement_px, share, gaps } => {
            let mut what = Vec::new();
            if !gaps.is_empty() {
                what.push(some_of(gaps, |gap| {
                    let (from, to) = (name(gap.from), name(gap.to));
                    format!("from {from} to {to} it goes {:.2} steps instead of {:.2}", gap.length, gap.taken)
                }));
            }
            if *share > 0.0 {
                what.push(format!("steps differ by {:.2} %", 100.0 * share).replace(".00 %", " %"));
            }
            format!(
                "the steps are not as they are taken to be: {}; frames stand {displacement_px:.2} px from there (RMS), and a match gets worse by \
                 it: `{calibrate}` measures where they stand",
                if what.is_empty() { "they grow or shrink".to_owned() } else { what.join(", ") }
            )
        }
        Doubt::Other(motion) => motion.to_string(),
        Doubt::Returns(frames) => {
            let what = some_of(frames, |(frame, how)| match how {
                Return::Back(steps) => {
                    format!("{} stands {steps:.2} steps before the one in front of it", name(*frame))
                }
                _ => format!("the step to {} cannot be told from none", name(*frame)),
            });
            format!(
                "a match needs frames that go on: {what}; `{calibrate}` takes them in the order of their positions"
            )
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_calibration::texture_motion::Step;

    #[test]
    fn angles_and_steps_are_told_with_digits_that_mean_something() {
        let words = |doubt| words(&doubt, &|frame| format!("image {frame}"), "epirig calibrate seq").unwrap();
        let oblique = |degrees, drift_px| words(Doubt::Oblique { degrees, drift_px });
        let turned = oblique(1.974, Some(6.04));
        assert!(turned.contains("1.97 degrees") && turned.contains("6.0 px"), "{turned}");
        assert!(oblique(-45.2, None).contains("at about 45 degrees"));
        assert!(words(Doubt::Vertical).contains("`epirig calibrate seq` turns the frames"));
        let uneven = |share, gaps| words(Doubt::Uneven { displacement_px: 2.1, share, gaps });
        let gap = |from| Step { from, to: from + 2, length: 3.0, sigma: 0.01, taken: 2.0 };
        let gaps = uneven(0.0, (5..10).map(gap).collect());
        assert!(gaps.contains("from image 5 to image 7 it goes 3.00 steps instead of 2.00, "), "{gaps}");
        assert!(
            gaps.contains(" and 2 more;") && !gaps.contains("from image 8") && !gaps.contains('%'),
            "{gaps}"
        );
        assert!(gaps.contains("`epirig calibrate seq`"), "{gaps}");
        assert!(uneven(0.11, Vec::new()).contains("steps differ by 11 %"));
        let back = words(Doubt::Returns(vec![(4, Return::Repeated), (9, Return::Back(0.2))]));
        assert!(
            back.contains("the step to image 4 cannot be told from none, image 9 stands 0.20 steps before")
        );
    }
}

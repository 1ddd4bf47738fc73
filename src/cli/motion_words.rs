//! A motion that a match does not take for granted, in words: its direction and its steps.

use epirig_calibration::motion::Doubt;

/// Most gaps that are named.
const MOST: usize = 3;

/// What is wrong with direction or steps, and the cure; `None` for other doubts. `name` names a frame, `calibrate` is
/// the command that measures positions.
pub(super) fn words(doubt: &Doubt, name: &dyn Fn(usize) -> String, calibrate: &str) -> Option<String> {
    Some(match doubt {
        Doubt::Oblique { degrees, drift_px } => oblique(*degrees, *drift_px),
        Doubt::Uneven { displacement_px, share, gaps } => {
            let mut what = Vec::new();
            for (before, after, steps) in gaps.iter().take(MOST) {
                what.push(format!(
                    "from {} to {} it goes {steps:.2} steps at once",
                    name(*before),
                    name(*after)
                ));
            }
            if gaps.len() > MOST {
                what.push(format!("there are {} more gaps", gaps.len() - MOST));
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
        Doubt::Returns(frames) => {
            let what = frames.iter().take(MOST).map(|&(frame, step)| match step < -0.3 {
                true => format!("{} stands {:.2} steps before the one in front of it", name(frame), -step),
                false => format!("{} stands where the one in front of it does", name(frame)),
            });
            let more = if frames.len() > MOST {
                format!(" and {} more", frames.len() - MOST)
            } else {
                String::new()
            };
            format!(
                "a match needs frames that go on: {}{more}; import without them (--exclude), or in order (--sort motion)",
                what.collect::<Vec<_>>().join(", ")
            )
        }
        _ => return None,
    })
}

/// A motion at an angle to the rows.
fn oblique(degrees: f64, drift_px: Option<f64>) -> String {
    // Rows count downwards: what goes to the right and down is turned back against the clock.
    let way = if degrees > 0.0 { "counter-clockwise" } else { "clockwise" };
    let size = degrees.abs();
    match drift_px {
        Some(drift_px) => {
            // As many digits as tell a tenth of a pixel over the baseline.
            let digits = if size < 10.0 { 2 } else { 1 };
            format!(
                "what moves goes at {size:.digits$} degrees to the rows, {drift_px:.1} px across them from the first image to the last, and a match \
                 needs motion along them: turn the images {way} by {size:.digits$} degrees in an image program, or turn the camera"
            )
        }
        None => format!(
            "what moves goes at about {size:.0} degrees to the rows, and a match needs motion along them: turn the images {way} by that angle in an \
             image program, or turn the camera"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_and_steps_are_told_with_digits_that_mean_something() {
        let words = |doubt| words(&doubt, &|frame| format!("image {frame}"), "epirig calibrate seq").unwrap();
        let turned = words(Doubt::Oblique { degrees: 1.974, drift_px: Some(6.04) });
        assert!(turned.contains("1.97 degrees") && turned.contains("6.0 px"), "{turned}");
        assert!(turned.contains("counter-clockwise by 1.97"), "{turned}");
        assert!(words(Doubt::Oblique { degrees: -45.2, drift_px: None }).contains(" clockwise by that"));
        let uneven = |share, gaps| words(Doubt::Uneven { displacement_px: 2.1, share, gaps });
        let gap = uneven(0.0, vec![(6, 7, 3.0)]);
        assert!(gap.contains("from image 6 to image 7 it goes 3.00 steps") && !gap.contains('%'), "{gap}");
        assert!(gap.contains("`epirig calibrate seq`"), "{gap}");
        assert!(uneven(0.11, Vec::new()).contains("steps differ by 11 %"));
        let back = words(Doubt::Returns(vec![(4, 0.01), (9, -0.7)]));
        assert!(back.contains("image 4 stands where") && back.contains("image 9 stands 0.70 steps before"));
    }
}

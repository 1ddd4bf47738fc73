//! Contrast of the texture around a pixel, along its row: the scale for how far a frame may deviate.

/// Half of the columns over which contrast is measured.
const REACH: usize = 4;

/// Variance of the intensities around each pixel of a row, in DN^2.
pub(crate) fn contrast(row: &[f32]) -> impl Iterator<Item = f32> + '_ {
    (0..row.len()).map(|x| {
        let near = &row[x.saturating_sub(REACH)..(x + REACH + 1).min(row.len())];
        let count = near.len() as f32;
        let (sum, squares) = near.iter().fold((0.0, 0.0), |(sum, squares), value| {
            let deviation = value - row[x];
            (sum + deviation, squares + deviation * deviation)
        });
        ((squares - sum * sum / count) / (count - 1.0)).max(0.0)
    })
}

/// Mean of the squared differences of each pixel from its two neighbours, in DN^2.
pub(crate) fn squared_gradients(row: &[f32]) -> impl Iterator<Item = f32> + '_ {
    (0..row.len()).map(|x| {
        let square = |other: usize| (row[other] - row[x]).powi(2);
        0.5 * (square(x.saturating_sub(1)) + square((x + 1).min(row.len() - 1)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contrast_is_the_variance_of_nine_pixels() {
        let row: Vec<f32> = (0..20).map(|x| if x % 2 == 0 { 10.0 } else { 16.0 }).collect();
        let found: Vec<f32> = contrast(&row).collect();
        // Five of one and four of the other: 5 * 4 / 9 * 6^2 / 8; at the border three and two: 3 * 2 / 5 *
        // 6^2 / 4.
        assert!((found[10] - 10.0).abs() < 1e-4);
        assert!((found[0] - 10.8).abs() < 1e-4);
    }

    #[test]
    fn gradients_are_those_of_a_ramp() {
        let row: Vec<f32> = (0..6).map(|x| 3.0 * x as f32).collect();
        let found: Vec<f32> = squared_gradients(&row).collect();
        assert_eq!(found, [4.5, 9.0, 9.0, 9.0, 9.0, 4.5]);
    }
}

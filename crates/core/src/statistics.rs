//! Medians, quantiles and means, in the conventions that the stations need.

/// The middle value, of an even number of them the upper of the two in the middle; `None` of none.
/// It is one of the values. They get another order.
///
/// ```
/// use epirig_core::statistics::upper_median;
///
/// assert_eq!(upper_median(&mut [4.0, 1.0, 3.0, 2.0]), Some(3.0));
/// assert_eq!(upper_median::<f32>(&mut []), None);
/// ```
pub fn upper_median<T: Copy + Into<f64>>(values: &mut [T]) -> Option<T> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, order).1)
}

/// The median: the middle value, of an even number of them the mean of the two in the middle;
/// `None` of none. The values get another order.
///
/// ```
/// use epirig_core::statistics::median;
///
/// assert_eq!(median(&mut [4.0, 1.0, 3.0, 2.0]), Some(2.5));
/// assert_eq!(median(&mut [4.0, 1.0, 3.0]), Some(3.0));
/// ```
pub fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let (low, high) = (values.get(values.len().saturating_sub(1) / 2)?, values.get(values.len() / 2)?);
    Some(0.5 * (low + high))
}

/// The value of rank `share` (0 to 1) from the least to the largest, the nearest that there is; `None` of
/// none. The values get another order.
///
/// ```
/// use epirig_core::statistics::quantile;
///
/// assert_eq!(quantile(&mut [4.0, 1.0, 3.0, 2.0, 5.0], 0.75), Some(4.0));
/// ```
pub fn quantile<T: Copy + Into<f64>>(values: &mut [T], share: f64) -> Option<T> {
    let rank = ((values.len().checked_sub(1)?) as f64 * share).round() as usize;
    Some(*values.select_nth_unstable_by(rank, order).1)
}

/// The value below which the share `share` (0 to 1) of the `sorted` values lies; `None` of none.
///
/// ```
/// use epirig_core::statistics::quantile_of_sorted;
///
/// assert_eq!(quantile_of_sorted(&[1.0, 2.0, 3.0, 4.0], 0.5), Some(3.0));
/// assert_eq!(quantile_of_sorted(&[1.0, 2.0, 3.0, 4.0], 1.0), Some(4.0));
/// ```
pub fn quantile_of_sorted(sorted: &[f64], share: f64) -> Option<f64> {
    let place = (share * sorted.len() as f64) as usize;
    sorted.get(place.min(sorted.len().saturating_sub(1))).copied()
}

/// The mean; 0 of none.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// The root of the mean square; 0 of none.
pub fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The standard deviation of Gaussian values over the median of their absolute values: one over the quantile
/// 3/4 of the normal distribution, which is 0.67449.
pub const SIGMA_OF_MEDIAN: f64 = 1.482_602;

/// [`SIGMA_OF_MEDIAN`] to four digits, as photometry uses it: another digit would change calibrations.
pub const SIGMA_OF_MEDIAN_4: f64 = 1.4826;

/// The total order of IEEE 754.
fn order<T: Copy + Into<f64>>(one: &T, other: &T) -> std::cmp::Ordering {
    (*one).into().total_cmp(&(*other).into())
}

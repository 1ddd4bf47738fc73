//! Medians, in the two conventions that the stations need.

use std::cmp::Ordering;

/// A floating-point number that can be put in order, NaN included.
pub trait Ordered: Copy {
    /// The total order of IEEE 754.
    fn order(&self, other: &Self) -> Ordering;
}

impl Ordered for f32 {
    fn order(&self, other: &Self) -> Ordering {
        self.total_cmp(other)
    }
}

impl Ordered for f64 {
    fn order(&self, other: &Self) -> Ordering {
        self.total_cmp(other)
    }
}

/// The middle value, of an even number of them the upper of the two in the middle; `None` of none.
/// It is one of the values. They get another order.
///
/// ```
/// use epirig_core::statistics::upper_median;
///
/// assert_eq!(upper_median(&mut [4.0, 1.0, 3.0, 2.0]), Some(3.0));
/// assert_eq!(upper_median::<f32>(&mut []), None);
/// ```
pub fn upper_median<T: Ordered>(values: &mut [T]) -> Option<T> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, T::order).1)
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

//! B-splines through equidistant samples (Unser 1999): weights, derivatives and the filters to coefficients.
//!
//! A sample between pixels is a sum of coefficients, each times a weight that depends on the fraction of a
//! pixel only. The coefficients come from the pixels by a recursive filter with one pole ([`cubic`]) or two
//! ([`quintic`]).
//!
//! The stations that use it keep what is theirs: the layout of the samples, the number of lanes, and what
//! lies beyond the borders. The simulator has a spline of its own, because it is the truth that these are
//! compared with.

pub mod cubic;
pub mod quintic;

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A floating-point number in which weights are computed: `f32` or `f64`.
pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + From<i8>
{
}

impl Real for f32 {}
impl Real for f64 {}

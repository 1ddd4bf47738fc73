//! Conformity with a specification: limits of characteristics, a decision rule, and the verdict.
//!
//! Words and rules are those of ISO 14253-1:2017 and of JCGM 106:2012.

mod limits;
mod rule;
mod specification;
mod value;

pub use limits::{Limits, NoTolerance, Tolerance};
pub use rule::{DecisionRule, Rule, Verdict};
pub use specification::{Conformity, Judgement, Specification};
pub use value::{Characteristic, SurfaceValues, Value};

//! GRBL's table of settings.

use std::collections::BTreeMap;

/// Number of axes.
pub(super) const AXES: usize = 3;

/// Numbers and values, as after `$RST=$` of a generic build.
const DEFAULTS: [(u8, f64); 34] = [
    (0, 10.0),
    (1, 25.0),
    (2, 0.0),
    (3, 0.0),
    (4, 0.0),
    (5, 0.0),
    (6, 0.0),
    (10, 1.0),
    (11, 0.010),
    (12, 0.002),
    (13, 0.0),
    (20, 0.0),
    (21, 0.0),
    (22, 0.0),
    (23, 0.0),
    (24, 25.0),
    (25, 500.0),
    (26, 250.0),
    (27, 1.0),
    (30, 1000.0),
    (31, 0.0),
    (32, 0.0),
    (100, 250.0),
    (101, 250.0),
    (102, 250.0),
    (110, 500.0),
    (111, 500.0),
    (112, 500.0),
    (120, 10.0),
    (121, 10.0),
    (122, 10.0),
    (130, 200.0),
    (131, 200.0),
    (132, 200.0),
];

#[derive(Debug, Clone)]
pub(super) struct Table(BTreeMap<u8, f64>);

impl Default for Table {
    fn default() -> Self {
        Self(DEFAULTS.into())
    }
}

impl Table {
    pub(super) fn get(&self, number: u8) -> f64 {
        self.0.get(&number).copied().unwrap_or(0.0)
    }

    pub(super) fn on(&self, number: u8) -> bool {
        self.get(number) != 0.0
    }

    pub(super) fn knows(&self, number: u8) -> bool {
        self.0.contains_key(&number)
    }

    pub(super) fn set(&mut self, number: u8, value: f64) {
        self.0.insert(number, value);
    }

    /// As printed by `$$`: integers for switches and masks, three decimals for all others.
    pub(super) fn lines(&self) -> Vec<String> {
        let decimals = |number: u8| if matches!(number, 11 | 12 | 24 | 25 | 27 | 100..) { 3 } else { 0 };
        self.0.iter().map(|(number, value)| format!("${number}={value:.*}", decimals(*number))).collect()
    }
}

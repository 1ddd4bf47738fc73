//! The sheet to print: the squares in true mm, marks to cut along, a ruler that shows whether the printer has
//! scaled it.

mod pdf;
mod svg;
#[cfg(test)]
mod tests;

use super::board::Target;
use super::error::TargetError;

/// Printers leave this much of a page white, in mm.
const MARGIN_MM: f64 = 10.0;
/// Cut marks: free distance from the squares, length and width, in mm.
const MARK_MM: (f64, f64) = (2.0, 5.0);
const LINE_MM: f64 = 0.15;
/// From the squares to the ruler, in mm: cut marks lie between.
const RULER_BELOW_MM: f64 = 12.0;
/// Ruler and text below it, in mm.
const FOOT_MM: f64 = 14.0;
/// Longest ruler, in mm.
const RULER_MM: usize = 100;
/// Height of letters, in mm.
const LETTERS_MM: f64 = 3.0;
/// Mean width of a letter over its height, of Helvetica.
const LETTER_RATIO: f64 = 0.55;

epirig_core::choices! {
    /// Paper to print on.
    pub enum Page {
        /// 210 mm x 297 mm.
        A4 = "a4",
        /// 297 mm x 420 mm.
        A3 = "a3",
        /// 8.5 inch x 11 inch.
        Letter = "letter",
        /// As large as the target needs.
        Fit = "fit",
    }
}

impl Page {
    /// Shorter and longer side, in mm.
    fn sides_mm(self) -> Option<(f64, f64)> {
        match self {
            Self::A4 => Some((210.0, 297.0)),
            Self::A3 => Some((297.0, 420.0)),
            Self::Letter => Some((215.9, 279.4)),
            Self::Fit => None,
        }
    }
}

/// Letters that begin at a place.
#[derive(Debug, Clone, PartialEq)]
struct Text {
    at_mm: (f64, f64),
    letters_mm: f64,
    words: String,
}

/// A target laid out on a page; x to the right, y down, from the upper left of the page.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet {
    width_mm: f64,
    height_mm: f64,
    square_mm: f64,
    /// Upper left corners of dark squares.
    squares: Vec<(f64, f64)>,
    /// Straight lines of [`LINE_MM`]: x and y of both ends.
    lines: Vec<[f64; 4]>,
    texts: Vec<Text>,
}

impl Sheet {
    /// Lays out a target. The square at the upper left is dark.
    ///
    /// ```
    /// use epirig_calibration::target::print::{Page, Sheet};
    /// use epirig_calibration::target::{ChessBoard, Target};
    ///
    /// let board = ChessBoard { columns: 9, rows: 6, square_mm: 20.0 };
    /// let sheet = Sheet::new(&Target { board, bands: 1, band_distance_mm: 0.0 }, Page::A4)?;
    /// assert_eq!(sheet.size_mm(), (297.0, 210.0));
    /// assert!(sheet.to_svg().starts_with("<svg"));
    /// # Ok::<(), epirig_calibration::target::TargetError>(())
    /// ```
    ///
    /// # Errors
    /// [`TargetError::Description`] for an impossible target, [`TargetError::Page`] if the page does not hold
    /// it, neither upright nor turned.
    pub fn new(target: &Target, page: Page) -> Result<Self, TargetError> {
        target.check()?;
        let square_mm = target.board.square_mm;
        let width = (target.board.columns + 1) as f64 * square_mm;
        let band = (target.board.rows + 1) as f64 * square_mm;
        let distance = if target.bands == 2 { target.band_distance_mm } else { 0.0 };
        let height = distance + band;
        let around = MARGIN_MM + MARK_MM.0 + MARK_MM.1;
        let needed = (width + 2.0 * around, height + around + RULER_BELOW_MM + FOOT_MM + MARGIN_MM);
        let (width_mm, height_mm) = fitting(page, needed)?;

        let left = 0.5 * (width_mm - width);
        let tops: Vec<f64> = (0..target.bands).map(|band| around + band as f64 * distance).collect();
        let mut squares = Vec::new();
        for &top in &tops {
            for row in 0..=target.board.rows {
                for column in (row % 2..=target.board.columns).step_by(2) {
                    squares.push((left + column as f64 * square_mm, top + row as f64 * square_mm));
                }
            }
        }
        let mut sheet =
            Self { width_mm, height_mm, square_mm, squares, lines: Vec::new(), texts: Vec::new() };
        sheet.add_cut_marks((left, left + width), &tops, band);
        let foot = around + height + RULER_BELOW_MM;
        sheet.add_ruler(foot);
        sheet.add_text(target, foot + FOOT_MM);
        Ok(sheet)
    }

    /// Width and height of the page, in mm.
    pub fn size_mm(&self) -> (f64, f64) {
        (self.width_mm, self.height_mm)
    }

    /// Marks outside of the corners of every band: along its sides, not between the bands' own.
    fn add_cut_marks(&mut self, (left, right): (f64, f64), tops: &[f64], band: f64) {
        let (free, length) = MARK_MM;
        for &top in tops {
            for y in [top, top + band] {
                for (x, way) in [(left, -1.0), (right, 1.0)] {
                    self.line((x + way * free, y), (x + way * (free + length), y));
                }
            }
        }
        let (first, last) = (tops[0], tops[tops.len() - 1] + band);
        for x in [left, right] {
            for (y, way) in [(first, -1.0), (last, 1.0)] {
                self.line((x, y + way * free), (x, y + way * (free + length)));
            }
        }
    }

    fn add_ruler(&mut self, top: f64) {
        let room = (self.width_mm - 2.0 * MARGIN_MM) as usize;
        let length = (room / 10 * 10).min(RULER_MM);
        let left = 0.5 * (self.width_mm - length as f64);
        self.line((left, top), (left + length as f64, top));
        for mm in 0..=length {
            let tick = if mm % 10 == 0 {
                4.0
            } else if mm % 5 == 0 {
                3.0
            } else {
                2.0
            };
            let x = left + mm as f64;
            self.line((x, top), (x, top + tick));
        }
        let letters_mm = LETTERS_MM;
        let below = top + 5.0 + LETTERS_MM;
        self.texts.push(Text { at_mm: (left, below), letters_mm, words: "0".to_owned() });
        let words = format!("{length} mm");
        let at_mm = (left + length as f64 - words.len() as f64 * LETTER_RATIO * LETTERS_MM, below);
        self.texts.push(Text { at_mm, letters_mm, words });
    }

    fn add_text(&mut self, target: &Target, baseline: f64) {
        let board = &target.board;
        let bands = if target.bands == 2 {
            format!(", 2 bands {} mm apart", number(target.band_distance_mm))
        } else {
            String::new()
        };
        let words = format!(
            "{} x {} inner corners, squares of {} mm{bands}. Print at 100 %; the ruler must be true.",
            board.columns,
            board.rows,
            number(board.square_mm)
        );
        let room = self.width_mm - 2.0 * MARGIN_MM;
        let letters_mm = (room / (words.len() as f64 * LETTER_RATIO)).min(LETTERS_MM);
        let left = 0.5 * (self.width_mm - words.len() as f64 * LETTER_RATIO * letters_mm);
        self.texts.push(Text { at_mm: (left, baseline), letters_mm, words });
    }

    fn line(&mut self, from_mm: (f64, f64), to_mm: (f64, f64)) {
        self.lines.push([from_mm.0, from_mm.1, to_mm.0, to_mm.1]);
    }
}

/// Width and height of the page, upright or turned.
fn fitting(page: Page, needed: (f64, f64)) -> Result<(f64, f64), TargetError> {
    let Some((shorter, longer)) = page.sides_mm() else { return Ok(needed) };
    let holds = |&(width, height): &(f64, f64)| needed.0 <= width && needed.1 <= height;
    [(shorter, longer), (longer, shorter)].into_iter().find(holds).ok_or_else(|| TargetError::Page {
        page: page.to_string().to_owned(),
        width_mm: needed.0,
        height_mm: needed.1,
        page_width_mm: shorter,
        page_height_mm: longer,
    })
}

/// A number to a tenth of a micrometre, without zeros at its end.
fn number(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

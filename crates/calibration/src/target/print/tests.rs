//! What stands in the files, read back as numbers.

use super::*;
use crate::target::ChessBoard;

fn bands() -> Target {
    let board = ChessBoard { columns: 18, rows: 2, square_mm: 7.5 };
    Target { board, bands: 2, band_distance_mm: 127.5 }
}

/// The number after `name="` in a line of SVG.
fn attribute(line: &str, name: &str) -> f64 {
    let rest = line.split(&format!(" {name}=\"")).nth(1).unwrap();
    rest.split('"').next().unwrap().parse().unwrap()
}

#[test]
fn squares_stand_where_the_target_says() {
    let svg = Sheet::new(&bands(), Page::A4).unwrap().to_svg();
    assert!(svg.contains("width=\"210mm\" height=\"297mm\" viewBox=\"0 0 210 297\""));
    let squares: Vec<(f64, f64)> = svg
        .lines()
        .filter(|line| line.contains("<rect x="))
        .map(|line| {
            assert_eq!((attribute(line, "width"), attribute(line, "height")), (7.5, 7.5));
            (attribute(line, "x"), attribute(line, "y"))
        })
        .collect();
    // Of 19 x 3 squares 29 are dark, the four outermost among them.
    assert_eq!(squares.len(), 2 * 29);
    let (left, top) = squares[0];
    // 142.5 mm in the middle of 210 mm.
    assert!((left - 33.75).abs() < 1e-3, "{left}");
    for (column, row) in [(0, 0), (18, 0), (0, 2), (18, 2), (9, 1)] {
        for below in [0.0, 127.5] {
            let place = (left + 7.5 * f64::from(column), top + 7.5 * f64::from(row) + below);
            let there = squares.iter().any(|s| (s.0 - place.0).hypot(s.1 - place.1) < 1e-3);
            assert!(there, "{column}, {row}, {below}");
        }
    }
    // The ruler: 101 ticks, a mm apart.
    let mut ticks: Vec<f64> = svg
        .lines()
        .filter(|line| line.starts_with("<line") && attribute(line, "x1") == attribute(line, "x2"))
        .filter(|line| attribute(line, "y1") > top + 150.0 + MARK_MM.0 + 5.0)
        .map(|line| attribute(line, "x1"))
        .collect();
    ticks.sort_by(f64::total_cmp);
    assert_eq!(ticks.len(), 101);
    assert!(ticks.windows(2).all(|pair| (pair[1] - pair[0] - 1.0).abs() < 1e-3));
    assert!(
        svg.contains(">100 mm<")
            && svg.contains("18 x 2 inner corners, squares of 7.5 mm, 2 bands 127.5 mm apart")
    );
}

#[test]
fn the_table_of_a_pdf_names_its_objects() {
    let pdf = String::from_utf8(Sheet::new(&bands(), Page::Letter).unwrap().to_pdf()).unwrap();
    // 8.5 inch x 11 inch.
    assert!(pdf.contains("/MediaBox [0 0 612.00000 792.00000]"));
    let table: usize = pdf.split("startxref\n").nth(1).unwrap().lines().next().unwrap().parse().unwrap();
    let entries: Vec<&str> = pdf[table..].lines().skip(3).take(5).collect();
    for (index, entry) in entries.iter().enumerate() {
        let offset: usize = entry[..10].parse().unwrap();
        assert!(pdf[offset..].starts_with(&format!("{} 0 obj\n", index + 1)), "{entry}");
        // A line end of two characters, as the format asks for.
        assert_eq!(entry.len(), 19);
    }
    assert_eq!(pdf.lines().filter(|line| line.ends_with(" re")).count(), 58);
}

#[test]
fn a_page_that_is_too_small_is_refused() {
    let mut target = bands();
    target.board.square_mm = 12.0;
    // 228 mm of squares.
    assert!(matches!(Sheet::new(&target, Page::A4), Err(TargetError::Page { .. })));
    assert_eq!(Sheet::new(&target, Page::A3).unwrap().size_mm(), (297.0, 420.0));
    let (width, height) = Sheet::new(&target, Page::Fit).unwrap().size_mm();
    assert!(width > 228.0 && height > 127.5 + 36.0);
    let long = ChessBoard { columns: 40, rows: 3, square_mm: 9.0 };
    let turned = Sheet::new(&Target { board: long, bands: 1, band_distance_mm: 0.0 }, Page::A3).unwrap();
    assert_eq!(turned.size_mm(), (420.0, 297.0));
}

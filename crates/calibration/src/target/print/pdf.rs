//! The sheet as PDF 1.4: one page, one of the fonts that every reader has.

use std::fmt::Write;

use super::{LINE_MM, Sheet, number};

/// Points of 1/72 inch in a mm.
const POINTS_PER_MM: f64 = 72.0 / 25.4;

impl Sheet {
    /// The sheet as the bytes of a PDF file, in true mm.
    pub fn to_pdf(&self) -> Vec<u8> {
        let [width, height] = [self.width_mm, self.height_mm].map(|mm| format!("{:.5}", mm * POINTS_PER_MM));
        let drawing = self.drawing(&height);
        let objects = [
            "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>".to_owned(),
            "<< /Type /Pages /Kids [3 0 R] /Count 1 >>".to_owned(),
            format!(
                "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width} {height}] /Contents 4 0 R \
                 /Resources << /Font << /F 5 0 R >> >> >>"
            ),
            format!("<< /Length {} >>\nstream\n{drawing}endstream", drawing.len()),
            "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>".to_owned(),
        ];
        // All text is ASCII, so that characters are bytes; writing to a String cannot fail.
        let mut pdf = String::from("%PDF-1.4\n");
        let mut offsets = Vec::new();
        for (index, object) in objects.iter().enumerate() {
            offsets.push(pdf.len());
            let _ = write!(pdf, "{} 0 obj\n{object}\nendobj\n", index + 1);
        }
        let table = pdf.len();
        let _ = write!(pdf, "xref\n0 {}\n0000000000 65535 f \n", objects.len() + 1);
        for offset in offsets {
            let _ = writeln!(pdf, "{offset:010} 00000 n ");
        }
        let _ = write!(
            pdf,
            "trailer\n<< /Size {} /Root 1 0 R >>\nstartxref\n{table}\n%%EOF\n",
            objects.len() + 1
        );
        pdf.into_bytes()
    }

    /// The page's operators. The first makes mm of points and lets y run down.
    fn drawing(&self, height_points: &str) -> String {
        let scale = format!("{POINTS_PER_MM:.9}");
        let mut drawing = format!("{scale} 0 0 -{scale} 0 {height_points} cm\n0 g 0 G {LINE_MM} w\n");
        let side = number(self.square_mm);
        for &(x, y) in &self.squares {
            let _ = writeln!(drawing, "{} {} {side} {side} re", number(x), number(y));
        }
        drawing.push_str("f\n");
        for line in &self.lines {
            let [x1, y1, x2, y2] = line.map(number);
            let _ = writeln!(drawing, "{x1} {y1} m {x2} {y2} l S");
        }
        for text in &self.texts {
            let [x, y, size] = [text.at_mm.0, text.at_mm.1, text.letters_mm].map(number);
            // Letters are turned back to stand upright.
            let _ = writeln!(drawing, "BT /F {size} Tf 1 0 0 -1 {x} {y} Tm ({}) Tj ET", text.words);
        }
        drawing
    }
}

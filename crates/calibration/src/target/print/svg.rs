//! The sheet as SVG, whose user unit is a mm.

use std::fmt::Write;

use super::{LINE_MM, Sheet, number};

impl Sheet {
    /// The sheet as the text of an SVG file, in true mm.
    pub fn to_svg(&self) -> String {
        let (width, height) = (number(self.width_mm), number(self.height_mm));
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" \
             viewBox=\"0 0 {width} {height}\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n<g fill=\"black\">\n"
        );
        // Writing to a String cannot fail.
        let side = number(self.square_mm);
        for &(x, y) in &self.squares {
            let _ = writeln!(
                svg,
                "<rect x=\"{}\" y=\"{}\" width=\"{side}\" height=\"{side}\"/>",
                number(x),
                number(y)
            );
        }
        let _ = writeln!(svg, "</g>\n<g stroke=\"black\" stroke-width=\"{LINE_MM}\">");
        for line in &self.lines {
            let [x1, y1, x2, y2] = line.map(number);
            let _ = writeln!(svg, "<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"/>");
        }
        svg.push_str("</g>\n<g font-family=\"Helvetica, Arial, sans-serif\">\n");
        for text in &self.texts {
            let [x, y, size] = [text.at_mm.0, text.at_mm.1, text.letters_mm].map(number);
            let _ = writeln!(svg, "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\">{}</text>", text.words);
        }
        svg.push_str("</g>\n</svg>\n");
        svg
    }
}

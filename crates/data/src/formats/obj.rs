//! Wavefront OBJ: places with colours, and triangles, as text. The format has no unit; these are mm.

use std::fmt::Write as _;

use super::mesh::Mesh;

pub(super) fn encode(mesh: &Mesh) -> Vec<u8> {
    let mut text = format!("# epirig, mm: {}\n", mesh.line());
    for vertex in &mesh.vertices {
        let [x, y, z] = vertex.place_mm;
        let [red, green, blue] = vertex.colour.map(|value| f32::from(value) / 255.0);
        // Nothing fails that writes into a text.
        let _ = writeln!(text, "v {x} {y} {z} {red:.3} {green:.3} {blue:.3}");
    }
    for triangle in &mesh.triangles {
        // Its points count from 1.
        let [a, b, c] = triangle.map(|number| number + 1);
        let _ = writeln!(text, "f {a} {b} {c}");
    }
    text.into_bytes()
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Vertex;
    use super::*;

    #[test]
    fn a_triangle_line_by_line() {
        let vertex = |x: f32| Vertex { place_mm: [x, -2.5, 1e-7], sigma_mm: 0.1, colour: [0, 51, 255] };
        let vertices = vec![vertex(0.0), vertex(1.0), vertex(0.125)];
        let mesh = Mesh { vertices, triangles: vec![[0, 1, 2]], title: "made\nby hand".to_owned() };
        let lines = [
            "# epirig, mm: made by hand",
            "v 0 -2.5 0.0000001 0.000 0.200 1.000",
            "v 1 -2.5 0.0000001 0.000 0.200 1.000",
            "v 0.125 -2.5 0.0000001 0.000 0.200 1.000",
            "f 1 2 3",
            "",
        ];
        assert_eq!(String::from_utf8(encode(&mesh)).unwrap(), lines.join("\n"));
    }
}

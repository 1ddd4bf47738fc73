//! STL, binary: a head of 80 bytes, the number of triangles, and for each its normal and its three corners as 32-bit
//! floats, little endian. The format has no unit; these are mm.

use super::mesh::Mesh;

/// The head must not begin with `solid`, by which readers know the text form.
const HEAD: usize = 80;

pub(super) fn encode(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = format!("epirig, mm: {}", mesh.line()).into_bytes();
    bytes.resize(HEAD, b' ');
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    bytes.reserve(50 * mesh.triangles.len());
    for triangle in &mesh.triangles {
        let corners = triangle.map(|number| mesh.vertices[number as usize].place_mm);
        for place in [normal(corners)].iter().chain(&corners) {
            place.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        }
        bytes.extend([0, 0]);
    }
    bytes
}

/// The unit vector that points out of a triangle; zero for one without area.
fn normal([a, b, c]: [[f32; 3]; 3]) -> [f32; 3] {
    let less = |p: [f32; 3], q: [f32; 3]| [0, 1, 2].map(|axis| f64::from(p[axis]) - f64::from(q[axis]));
    let (u, v) = (less(b, a), less(c, a));
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = cross.iter().map(|value| value * value).sum::<f64>().sqrt();
    cross.map(|value| if length > 0.0 { (value / length) as f32 } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Vertex;
    use super::*;

    #[test]
    fn a_triangle_byte_by_byte() {
        let vertex = |x: f32, y: f32| Vertex { place_mm: [x, y, 0.5], sigma_mm: 0.1, colour: [0; 3] };
        let vertices = vec![vertex(0.0, 0.0), vertex(2.0, 0.0), vertex(0.0, 3.0)];
        let mesh = Mesh { vertices, triangles: vec![[0, 1, 2]], title: "solid".repeat(40) };
        let bytes = encode(&mesh);
        assert!(bytes.starts_with(b"epirig, mm: solid"));
        assert_eq!(bytes.len(), 80 + 4 + 50);
        assert_eq!(bytes[80..84], [1, 0, 0, 0]);
        let float =
            |index: usize| f32::from_le_bytes(bytes[84 + 4 * index..88 + 4 * index].try_into().unwrap());
        let floats: Vec<f32> = (0..12).map(float).collect();
        assert_eq!(floats, [0.0, 0.0, 1.0, 0.0, 0.0, 0.5, 2.0, 0.0, 0.5, 0.0, 3.0, 0.5]);
        assert_eq!(normal([[1.0; 3]; 3]), [0.0; 3]);
    }
}

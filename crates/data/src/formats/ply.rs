//! Points in space with their uncertainty and colour: PLY, binary, little endian.

use super::mesh::Mesh;

/// Vertices x, y, z and sigma (all float, in mm), red, green and blue (uchar), and triangles between them, by the
/// vertices' numbers from 0.
pub(super) fn encode(mesh: &Mesh) -> Vec<u8> {
    let Mesh { vertices, triangles, .. } = mesh;
    let mut header = "ply\nformat binary_little_endian 1.0\ncomment x, y, z and sigma in mm\n".to_owned();
    if !mesh.title.is_empty() {
        header.push_str(&format!("comment {}\n", mesh.line()));
    }
    header.push_str(&format!("element vertex {}\n", vertices.len()));
    for name in ["x", "y", "z", "sigma"] {
        header.push_str(&format!("property float {name}\n"));
    }
    for name in ["red", "green", "blue"] {
        header.push_str(&format!("property uchar {name}\n"));
    }
    header.push_str(&format!(
        "element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        triangles.len()
    ));
    let mut bytes = header.into_bytes();
    bytes.reserve(19 * vertices.len() + 13 * triangles.len());
    for vertex in vertices {
        vertex.place_mm.iter().chain([&vertex.sigma_mm]).for_each(|value| bytes.extend(value.to_le_bytes()));
        bytes.extend(vertex.colour);
    }
    for triangle in triangles {
        bytes.push(3);
        triangle.iter().for_each(|index| bytes.extend(index.to_le_bytes()));
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Vertex;
    use super::*;

    #[test]
    fn a_triangle_byte_by_byte() {
        let vertex = |x: f32| Vertex { place_mm: [x, 2.0, 3.0], sigma_mm: 0.5, colour: [1, 2, 3] };
        let vertices = vec![vertex(0.0), vertex(1.0), vertex(2.0)];
        let bytes = encode(&Mesh { vertices, triangles: vec![[0, 1, 2]], title: "made\nby hand".to_owned() });
        let header = "ply\nformat binary_little_endian 1.0\ncomment x, y, z and sigma in mm\ncomment made by hand\n\
                      element vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float sigma\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
                      element face 1\nproperty list uchar uint vertex_indices\nend_header\n";
        assert!(bytes.starts_with(header.as_bytes()));
        let body = &bytes[header.len()..];
        assert_eq!(body.len(), 3 * 19 + 13);
        assert_eq!(body[19..23], [0, 0, 0x80, 0x3f], "1.0, the x of the second point");
        assert_eq!(body[16..19], [1, 2, 3]);
        assert_eq!(body[57..], [3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
    }
}

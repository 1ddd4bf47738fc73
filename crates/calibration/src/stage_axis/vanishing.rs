//! The vanishing point of the tracks of a translating object: a closed form for the stage axis.

use nalgebra::{Matrix3, Vector3};

/// The direction of the stage axis, a unit vector in the camera's frame, from tracks of undistorted rays (a,
/// b, 1), one list for each point.
///
/// The rays of one track lie in a plane through the centre of the camera, and the direction lies in all of
/// these planes. Each plane's normal is the least eigenvector of its rays' scatter, and the direction that of
/// the normals' (Hartley and Zisserman 2004, section 8.6), weighted by the length of the track. `None` if
/// there are fewer than two tracks, or all lie in one plane: then their vanishing point is open.
pub(super) fn direction<'a>(tracks: impl Iterator<Item = &'a [[f64; 2]]>) -> Option<[f64; 3]> {
    let mut normals = Matrix3::zeros();
    for track in tracks.filter(|track| track.len() >= 2) {
        let mut scatter = Matrix3::zeros();
        for [a, b] in track {
            let ray = Vector3::new(*a, *b, 1.0).normalize();
            scatter += ray * ray.transpose();
        }
        let eigen = scatter.symmetric_eigen();
        let order = order(&eigen.eigenvalues);
        let normal = eigen.eigenvectors.column(order[0]);
        normals += eigen.eigenvalues[order[1]] * normal * normal.transpose();
    }
    let eigen = normals.symmetric_eigen();
    let order = order(&eigen.eigenvalues);
    // Planes that differ by less than 0.1 mrad do not tell where they meet.
    let spread = (eigen.eigenvalues[order[1]] / eigen.eigenvalues[order[2]]).sqrt();
    let direction = eigen.eigenvectors.column(order[0]);
    (spread > 1e-4).then(|| [direction[0], direction[1], direction[2]])
}

/// Indices of the eigenvalues, the least first.
fn order(eigenvalues: &Vector3<f64>) -> [usize; 3] {
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigenvalues[a].total_cmp(&eigenvalues[b]));
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tracks_of_a_translation_meet_in_its_direction() {
        let v = Vector3::new(1.0, -0.012, 0.3).normalize();
        let tracks: Vec<Vec<[f64; 2]>> = [(-30.0, -60.0, 900.0), (10.0, 55.0, 880.0), (40.0, -50.0, 910.0)]
            .map(|(x, y, z)| {
                (0..5)
                    .map(|step| {
                        let point = Vector3::new(x, y, z) + v * (30.0 * f64::from(step));
                        [point[0] / point[2], point[1] / point[2]]
                    })
                    .collect()
            })
            .to_vec();
        let found = direction(tracks.iter().map(Vec::as_slice)).unwrap();
        assert!((Vector3::from(found).dot(&v).abs() - 1.0).abs() < 1e-12);
        assert_eq!(direction(tracks[..1].iter().map(Vec::as_slice)), None);
    }
}

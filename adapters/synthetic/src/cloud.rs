//! A scan of the scene: points on every surface that can be seen.

use std::sync::Arc;

use nalgebra::Point3;
use rayon::prelude::*;

use crate::hash::{hash, unit};
use crate::scene::{Scene, SurfaceKind};

/// Points of a jittered grid of that spacing (metres) on all faces, exact to float rounding.
///
/// Places where a box stands on the floor or on another box are left out, as a scanner would not see them.
pub(crate) fn sample(scene: &Scene, spacing_m: f64) -> Arc<[Point3<f32>]> {
    let faces: Vec<Vec<Point3<f32>>> = scene
        .faces
        .par_iter()
        .enumerate()
        .map(|(index, face)| {
            let own = index / 6;
            let seed = index as u32;
            let [wide, high] = face.size_m;
            let (columns, rows) = ((wide / spacing_m).ceil() as i32, (high / spacing_m).ceil() as i32);
            let mut points = Vec::new();
            for (row, column) in (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c))) {
                let h = hash(column, row, seed);
                let place = |cell: i32, cells: i32, size: f64, byte| {
                    (f64::from(cell) + 0.1 + 0.8 * unit(h, byte)) * size / f64::from(cells)
                };
                let (s, t) = (place(column, columns, wide, 0), place(row, rows, high, 2));
                let point = face.corner + face.right * s + face.up * t;
                let covered =
                    |(i, solid): (usize, &crate::scene::Solid)| i != own && i != 0 && solid.covers(&point);
                let below_box = face.kind == SurfaceKind::Box && point.z < 1e-6;
                if !below_box && !scene.solids.iter().enumerate().any(covered) {
                    points.push(point.cast::<f32>());
                }
            }
            points
        })
        .collect();
    faces.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn every_point_is_where_a_ray_from_the_room_ends() {
        let scene = Scene::new(5);
        let points = sample(&scene, 0.1);
        // 8 x 8 floor and ceiling, four walls, some boxes: about 240 m² at 100 points a square metre.
        assert!((22_000..30_000).contains(&points.len()), "{}", points.len());
        let mut seen = 0;
        for point in points.iter().step_by(7) {
            let point = point.cast::<f64>();
            // Step off the surface towards the middle of the room and look back.
            for towards in
                [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y(), Vector3::z(), -Vector3::z()]
            {
                let eye = point + towards * 0.01;
                if scene.clearance_m(&eye) > 0.005 {
                    let hit = scene.cast(&eye, &(point - eye)).unwrap();
                    assert!((hit.distance - 1.0).abs() < 1e-3, "{point}: {hit:?}");
                    seen += 1;
                    break;
                }
            }
        }
        assert!(seen * 7 > points.len() * 95 / 100, "{seen} of {}", points.len());
    }
}

use super::*;
use crate::cloud::CloudOptions;
use crate::scene::{Scene, camera, grid, look};

fn zmap(points: impl IntoIterator<Item = nalgebra::Point3<f32>>, options: ZMapOptions) -> ZMapDepth {
    let cloud = Cloud::from_points(points, &CloudOptions::default()).unwrap();
    ZMapDepth::new(Arc::new(cloud), Rigid::identity(), options)
}

/// Views into the room: from high and low, along the floor, and close to an edge.
const VIEWS: [([f64; 3], [f64; 3]); 4] = [
    ([-2.0, -1.0, 1.6], [1.0, -0.3, 0.6]),
    ([-1.0, 0.0, 0.5], [1.0, 0.1, 0.4]),
    ([-2.5, 2.0, 2.5], [1.0, -0.5, 0.3]),
    ([0.3, 0.3, 1.0], [2.4, -1.8, 0.9]),
];

/// Shares of pixels that are answered, and of those that are within 2 cm.
fn shares(zmap: &ZMapDepth, scene: &Scene) -> (f64, f64) {
    let camera = camera();
    let (mut asked, mut answered, mut good) = (0, 0, 0);
    for (from, to) in VIEWS {
        let keyframe = look(&camera, from, to);
        let pixels = grid(&camera, 1);
        asked += pixels.len();
        let mut misses = std::collections::BTreeMap::new();
        let (a0, g0) = (answered, good);
        for (px, depth) in pixels.iter().zip(zmap.depths(&keyframe, &pixels).unwrap()) {
            match depth {
                Ok(d) => {
                    answered += 1;
                    good += usize::from((d.z_m - scene.depth(&keyframe, *px)).abs() < 0.02);
                }
                Err(miss) => *misses.entry(miss).or_insert(0) += 1,
            }
        }

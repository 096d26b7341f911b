//! Triangles of a polygon in space, by cutting off its ears.

use nalgebra::{Point3, Vector3};

/// Appends the triangles of a polygon, given as the numbers and places of its corners in order.
///
/// A polygon that is not convex is cut in the plane of its area vector. What has fewer than three corners has no
/// triangles; what crosses itself gets some that cover it.
pub(super) fn triangulate(polygon: &[(u32, Point3<f64>)], triangles: &mut Vec<[u32; 3]>) {
    let normal = area_vector(polygon);
    let mut left: Vec<(u32, Point3<f64>)> = polygon.to_vec();
    while left.len() > 3 {
        let n = left.len();
        let ear = (0..n).find(|i| is_ear(&left, *i, &normal)).unwrap_or(0);
        let (before, after) = ((ear + n - 1) % n, (ear + 1) % n);
        triangles.push([left[before].0, left[ear].0, left[after].0]);
        left.remove(ear);
    }
    if let [a, b, c] = *left.as_slice() {
        triangles.push([a.0, b.0, c.0]);
    }
}

/// Twice the area of a polygon, along its normal (Newell).
fn area_vector(polygon: &[(u32, Point3<f64>)]) -> Vector3<f64> {
    let Some((_, origin)) = polygon.first() else { return Vector3::zeros() };
    polygon.windows(2).map(|w| (w[0].1 - origin).cross(&(w[1].1 - origin))).sum()
}

/// Whether a corner turns the right way and no other corner lies in its triangle.
fn is_ear(polygon: &[(u32, Point3<f64>)], ear: usize, normal: &Vector3<f64>) -> bool {
    let n = polygon.len();
    let (before, after) = ((ear + n - 1) % n, (ear + 1) % n);
    let [a, b, c] = [before, ear, after].map(|i| polygon[i].1);
    let turn = |p: Point3<f64>, q: Point3<f64>, r: Point3<f64>| (q - p).cross(&(r - q)).dot(normal);
    let inside = |p: Point3<f64>| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
    turn(a, b, c) > 0.0 && (0..n).filter(|i| ![before, ear, after].contains(i)).all(|i| !inside(polygon[i].1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(polygon: &[[f64; 3]]) -> (usize, f64) {
        let corners: Vec<_> = (0..).zip(polygon.iter().map(|p| Point3::from(*p))).collect();
        let mut triangles = Vec::new();
        triangulate(&corners, &mut triangles);
        let at = |i: u32| corners[i as usize].1;
        let sum =
            triangles.iter().map(|[a, b, c]| (at(*b) - at(*a)).cross(&(at(*c) - at(*a))).norm() / 2.0).sum();
        (triangles.len(), sum)
    }

    #[test]
    fn polygons_keep_their_area() {
        assert_eq!(area(&[]), (0, 0.0));
        assert_eq!(area(&[[0.0; 3], [1.0, 0.0, 0.0]]), (0, 0.0));
        let square = [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [2.0, 2.0, 1.0], [0.0, 2.0, 1.0]];
        assert_eq!(area(&square), (2, 4.0));
        // An arrow head, whose notch a fan from the first corner would fill, both ways round.
        let mut arrow = [[0.0, 2.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 2.0, 0.5]];
        arrow[2] = [0.0, 0.0, 0.25];
        let (count, sum) = area(&arrow);
        let expected = area_vector(&(0..).zip(arrow.map(Point3::from)).collect::<Vec<_>>()).norm() / 2.0;
        assert_eq!(count, 2);
        assert!((sum - expected).abs() < 1e-12, "{sum} instead of {expected}");
        arrow.reverse();
        assert!((area(&arrow).1 - expected).abs() < 1e-12);
    }
}

//! A spatial index that costs next to nothing: the points themselves are put in order.
//!
//! A k-d tree whose nodes halve their points across the widest side of their cell. Where the points of a node lie
//! follows from their number alone, so that only boxes are kept; and since the halves are sorted into place, there is
//! no second copy of the points at any time. Each leaf, some fifty points, also knows the patch of surface that it
//! most likely is: how far apart its points are and which way it faces.

use nalgebra::Vector3;
use vice_core::statistics::middle;

use crate::scatter::Scatter;

/// Most points of a leaf.
const LEAF_POINTS: usize = 64;

/// Fewer points than this are not worth quartering.
const FEWEST_TO_QUARTER: usize = 24;

/// A leaf thinner than this part of its spacing is flat.
const FLAT: f32 = 0.25;

/// The median distance to the nearest neighbour over the spacing, for points spread at random: `√(ln 2 / π)`.
const MEDIAN_NEIGHBOUR: f32 = 0.47;

/// A leaf whose points would lie this much further apart if they were spread evenly is scattered over several
/// surfaces.
const SCATTERED: f32 = 1.5;

/// Fewer points than this are not worth a second thread.
const PARALLEL_POINTS: usize = 1 << 14;

/// A box with sides along the axes, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) low: [f32; 3],
    pub(crate) high: [f32; 3],
}

impl Bounds {
    const NOTHING: Self = Self { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };

    fn of(points: &[[f32; 3]]) -> Self {
        points.iter().fold(Self::NOTHING, |b, p| b.joined(&Self { low: *p, high: *p }))
    }

    fn joined(&self, other: &Self) -> Self {
        Self {
            low: std::array::from_fn(|i| self.low[i].min(other.low[i])),
            high: std::array::from_fn(|i| self.high[i].max(other.high[i])),
        }
    }

    /// Length along each axis, metres.
    pub(crate) fn size(&self) -> [f32; 3] {
        std::array::from_fn(|i| self.high[i] - self.low[i])
    }

    fn widest(&self) -> usize {
        let s = self.size();
        if s[0] >= s[1] && s[0] >= s[2] {
            0
        } else if s[1] >= s[2] {
            1
        } else {
            2
        }
    }
}

/// The surface that the points of a leaf most likely are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Patch {
    /// Mean of its points, metres.
    pub(crate) centre: [f32; 3],
    /// Unit normal, of either sign.
    pub(crate) normal: [f32; 3],
    /// Typical distance from a point to the next, metres.
    pub(crate) spacing_m: f32,
    /// Standard deviation across the surface, metres.
    pub(crate) thickness_m: f32,
}

/// A run of points that share a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Leaf {
    /// Which leaf, and which patch.
    pub(crate) index: u32,
    /// Which node.
    node: u32,
    /// Its first point.
    pub(crate) start: usize,
    /// Behind its last point.
    pub(crate) end: usize,
}

/// How a box lies to the space asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Overlap {
    Outside,
    Partly,
    Inside,
}

/// The index of a cloud's points.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    points: usize,
    /// Halvings from the root to a leaf.
    levels: u32,
    /// A node, then all of its lower half, then all of its upper half.
    boxes: Vec<Bounds>,
    /// One for each leaf.
    patches: Vec<Patch>,
}

impl Tree {
    /// Puts points in order and indexes them.
    pub(crate) fn build(points: &mut [[f32; 3]]) -> Self {
        let mut levels = 0;
        while points.len() > LEAF_POINTS << levels {
            levels += 1;
        }
        let mut boxes = vec![Bounds::NOTHING; (2 << levels) - 1];
        let flat = Patch { centre: [0.0; 3], normal: [0.0, 0.0, 1.0], spacing_m: 0.0, thickness_m: 0.0 };
        let mut patches = vec![flat; 1 << levels];
        let cell = Bounds::of(points);
        halve(points, cell, &mut boxes, &mut patches);
        Self { points: points.len(), levels, boxes, patches }
    }

    /// Box of all points, metres.
    pub(crate) fn bounds(&self) -> Bounds {
        self.boxes[0]
    }

    /// Patch of a leaf.
    pub(crate) fn patch(&self, leaf: u32) -> &Patch {
        &self.patches[leaf as usize]
    }

    /// Box of a leaf, metres.
    pub(crate) fn bounds_of(&self, leaf: &Leaf) -> &Bounds {
        &self.boxes[leaf.node as usize]
    }

    /// Bytes that the index takes.
    pub(crate) fn bytes(&self) -> usize {
        self.boxes.len() * size_of::<Bounds>() + self.patches.len() * size_of::<Patch>()
    }

    /// Leaves whose boxes are not outside, in order.
    pub(crate) fn leaves(&self, overlap: impl Fn(&Bounds) -> Overlap) -> Vec<Leaf> {
        let mut found = Vec::new();
        let root = Node { at: 0, level: self.levels, leaf: 0, start: 0, end: self.points };
        self.visit(root, false, &overlap, &mut found);
        found
    }

    fn visit(&self, node: Node, inside: bool, overlap: &impl Fn(&Bounds) -> Overlap, found: &mut Vec<Leaf>) {
        let inside = inside
            || match overlap(&self.boxes[node.at]) {
                Overlap::Outside => return,
                Overlap::Partly => false,
                Overlap::Inside => true,
            };
        if node.level == 0 {
            let (index, at) = (node.leaf as u32, node.at as u32);
            found.push(Leaf { index, node: at, start: node.start, end: node.end });
            return;
        }
        for half in node.halves() {
            self.visit(half, inside, overlap, found);
        }
    }
}

/// A node and where its points lie.
#[derive(Clone, Copy)]
struct Node {
    at: usize,
    level: u32,
    leaf: usize,
    start: usize,
    end: usize,
}

impl Node {
    fn halves(self) -> [Self; 2] {
        let (level, middle) = (self.level - 1, self.start + (self.end - self.start) / 2);
        // A half of so many levels has twice as many leaves less one as boxes.
        let (boxes, leaves) = ((2 << level) - 1, 1 << level);
        [
            Self { at: self.at + 1, level, end: middle, ..self },
            Self { at: self.at + 1 + boxes, level, leaf: self.leaf + leaves, start: middle, ..self },
        ]
    }
}

fn halve(points: &mut [[f32; 3]], cell: Bounds, boxes: &mut [Bounds], patches: &mut [Patch]) {
    let [node, below @ ..] = boxes else { return };
    if below.is_empty() {
        *node = Bounds::of(points);
        if let [patch] = patches {
            *patch = fit(points);
        }
        return;
    }
    let (axis, middle) = (cell.widest(), points.len() / 2);
    points.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
    let cut = points[middle][axis];
    let (mut low_cell, mut high_cell) = (cell, cell);
    (low_cell.high[axis], high_cell.low[axis]) = (cut, cut);
    let (low, high) = points.split_at_mut(middle);
    let (low_boxes, high_boxes) = below.split_at_mut(below.len() / 2);
    let (low_patches, high_patches) = patches.split_at_mut(patches.len() / 2);
    let parallel = low.len() >= PARALLEL_POINTS;
    let mut lower = || halve(low, low_cell, low_boxes, low_patches);
    let mut upper = || halve(high, high_cell, high_boxes, high_patches);
    if parallel {
        rayon::join(lower, upper);
    } else {
        lower();
        upper();
    }
    let half = below.len() / 2;
    *node = below[0].joined(&below[half]);
}

/// The patch that points most likely are.
///
/// A leaf at the edge of a box holds points of two or three surfaces, perhaps with nothing between them. One plane
/// through all of them is neither near them nor as dense as they are: discs as far apart as its points would hide what
/// is beside the box, and its thickness would let triangles span the edge. So the distance to the nearest neighbour
/// bounds the spacing, and the quarters of a leaf that is not flat bound its thickness.
fn fit(points: &mut [[f32; 3]]) -> Patch {
    let whole = flat_fit(points);
    if points.len() < FEWEST_TO_QUARTER {
        return whole;
    }
    let spacing_m = whole.spacing_m.min(median_neighbour_m(points) / MEDIAN_NEIGHBOUR);
    let scattered = whole.spacing_m > SCATTERED * spacing_m;
    if !scattered && whole.thickness_m < FLAT * spacing_m {
        return whole;
    }
    let (low, high) = halves(points);
    let mut thickness_m = [low, high].map(|half| {
        let (first, second) = halves(half);
        flat_fit(first).thickness_m.min(flat_fit(second).thickness_m)
    });
    // The thicker of the better quarters: one of them may be flat by chance.
    thickness_m.sort_by(f32::total_cmp);
    let thickness_m = whole.thickness_m.min(thickness_m[1]);
    if scattered {
        return Patch { spacing_m, thickness_m: thickness_m.min(spacing_m), ..whole };
    }
    Patch { thickness_m, ..whole }
}

/// The median distance from a point to the nearest other one, metres.
fn median_neighbour_m(points: &[[f32; 3]]) -> f32 {
    let mut nearest = vec![f32::INFINITY; points.len()];
    for (i, a) in points.iter().enumerate() {
        for (j, b) in points.iter().enumerate().skip(i + 1) {
            let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
            let square = x * x + y * y + z * z;
            nearest[i] = nearest[i].min(square);
            nearest[j] = nearest[j].min(square);
        }
    }
    middle(&mut nearest, f32::total_cmp).unwrap_or(f32::INFINITY).sqrt()
}

/// The two halves of points across the widest side of their box.
fn halves(points: &mut [[f32; 3]]) -> (&mut [[f32; 3]], &mut [[f32; 3]]) {
    let (axis, middle) = (Bounds::of(points).widest(), points.len() / 2);
    points.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
    points.split_at_mut(middle)
}

/// The flat patch through points, by their moments: evenly spread over a rectangle or an ellipse of area `A` they
/// have `A = 12 √(λ1 λ2)` with the two larger eigenvalues of their covariance, to within 5 %.
fn flat_fit(points: &[[f32; 3]]) -> Patch {
    let at = |p: &[f32; 3]| Vector3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]));
    let Scatter { count, mean, squares } = Scatter::of(points.iter().map(at));
    let eigen = (squares / count).symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let value = |i: usize| eigen.eigenvalues[order[i]].max(0.0);
    let normal = eigen.eigenvectors.column(order[0]);
    Patch {
        centre: [mean.x as f32, mean.y as f32, mean.z as f32],
        normal: [normal[0] as f32, normal[1] as f32, normal[2] as f32],
        spacing_m: (12.0 * (value(1) * value(2)).sqrt() / count).sqrt() as f32,
        thickness_m: value(0).sqrt() as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use vice_core::random::Congruential;

    fn scattered(n: usize, side: [f32; 3]) -> Vec<[f32; 3]> {
        let mut random = Congruential::new(1);
        (0..n).map(|_| side.map(|s| random.uniform(0.0, 1.0) as f32 * s)).collect()
    }

    #[test]
    fn a_patch_knows_its_spacing_and_its_normal() {
        let mut points = scattered(100_000, [10.0, 0.0, 10.0]);
        let tree = Tree::build(&mut points);
        // A thousand points a square metre.
        let spacing = 0.001_f32.sqrt();
        let leaves = tree.leaves(|_| Overlap::Inside);
        for leaf in &leaves {
            let patch = tree.patch(leaf.index);
            assert!((patch.spacing_m / spacing - 1.0).abs() < 0.6, "{patch:?}");
            assert!(patch.normal[1].abs() > 0.999 && patch.thickness_m < 1e-3, "{patch:?}");
        }
        let mean = leaves.iter().map(|l| tree.patch(l.index).spacing_m).sum::<f32>() / leaves.len() as f32;
        assert!((mean / spacing - 1.0).abs() < 0.05, "{mean} where {spacing} was expected");
        assert!(tree.bytes() < points.len() * 12 / 5);
    }

    #[test]
    fn a_leaf_of_two_surfaces_is_no_sparser_and_no_thicker_than_they_are() {
        // The edge of a box a centimetre a point, and the ceiling above it.
        let edge = |n: u16| (0..n).map(|i| [f32::from(i) * 0.01, f32::from(i % 3) * 0.01, 0.5]);
        let ceiling = (0..20_u16).map(|i| [f32::from(i % 5) * 0.01, f32::from(i / 5) * 0.01 - 0.9, 2.8]);
        let mut points: Vec<[f32; 3]> = edge(40).chain(ceiling).collect();
        let (flat, patch) = (flat_fit(&points), fit(&mut points));
        assert!(flat.spacing_m > 0.05, "{flat:?}");
        assert!(patch.spacing_m < 0.04 && patch.thickness_m <= patch.spacing_m, "{patch:?}");
        // A surface that is only rough keeps its roughness.
        let mut rough = scattered(60, [0.1, 0.1, 0.05]);
        let patch = fit(&mut rough);
        assert!((0.007..0.02).contains(&patch.thickness_m), "{patch:?}");
    }

    #[test]
    fn equal_points_and_single_ones_are_indexed_too() {
        for n in [1, 2, 64, 65, 1000] {
            let mut points = vec![[1.0, 2.0, 3.0]; n];
            let tree = Tree::build(&mut points);
            assert_eq!(tree.leaves(|_| Overlap::Partly).iter().map(|l| l.end - l.start).sum::<usize>(), n);
            assert_eq!(tree.bounds(), Bounds { low: [1.0, 2.0, 3.0], high: [1.0, 2.0, 3.0] });
            assert_eq!(tree.patch(0).spacing_m, 0.0);
        }
    }

    proptest! {
        #[test]
        fn a_query_finds_what_a_scan_finds(
            n in 1_usize..5000,
            low in prop::array::uniform3(-0.2_f32..0.9),
            size in prop::array::uniform3(0.0_f32..0.7),
        ) {
            let mut points = scattered(n, [1.0, 0.5, 0.1]);
            let all = points.clone();
            let tree = Tree::build(&mut points);
            let wanted = |p: &[f32; 3]| (0..3).all(|i| p[i] >= low[i] && p[i] <= low[i] + size[i]);
            let overlap = |b: &Bounds| {
                if (0..3).any(|i| b.high[i] < low[i] || b.low[i] > low[i] + size[i]) {
                    Overlap::Outside
                } else if wanted(&b.low) && wanted(&b.high) {
                    Overlap::Inside
                } else {
                    Overlap::Partly
                }
            };
            let leaves = tree.leaves(overlap);
            prop_assert!(leaves.windows(2).all(|w| w[0].end <= w[1].start && w[0].index < w[1].index));
            let mut found: Vec<_> =
                leaves.iter().flat_map(|l| &points[l.start..l.end]).filter(|p| wanted(p)).copied().collect();
            let mut expected: Vec<_> = all.into_iter().filter(wanted).collect();
            found.sort_by(|a, b| a.partial_cmp(b).unwrap());
            expected.sort_by(|a, b| a.partial_cmp(b).unwrap());
            prop_assert_eq!(found, expected);
        }
    }
}

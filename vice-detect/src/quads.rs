//! Dark patches whose outline is a quadrangle.

use nalgebra::Vector2;

/// Smaller patches hold no tag that could be read, pixels.
const LEAST_SIDE: usize = 9;

/// Four corners, clockwise as seen in the picture, good to a pixel or two.
pub(crate) type Quad = [Vector2<f64>; 4];

/// A patch: where it lies and how large it is.
#[derive(Clone, Copy)]
struct Patch {
    x: [usize; 2],
    y: [usize; 2],
    area: usize,
}

/// Quadrangles among the dark patches of a picture, that do not touch its border.
pub(crate) fn quads(dark: &[bool], width: usize) -> Vec<Quad> {
    let height = dark.len() / width.max(1);
    let (labels, patches) = patches(dark, width);
    patches
        .iter()
        .enumerate()
        .filter(|(_, p)| {
            let (wide, high) = (p.x[1] - p.x[0] + 1, p.y[1] - p.y[0] + 1);
            wide >= LEAST_SIDE
                && high >= LEAST_SIDE
                && p.x[0] > 0
                && p.y[0] > 0
                && p.x[1] + 1 < width
                && p.y[1] + 1 < height
                && p.area * 8 > wide * high
        })
        .filter_map(|(label, patch)| quad(&labels, width, label as u32, patch))
        .collect()
}

/// The patch of each dark pixel, by neighbours along rows and columns.
fn patches(dark: &[bool], width: usize) -> (Vec<u32>, Vec<Patch>) {
    const NONE: u32 = u32::MAX;
    let mut labels = vec![NONE; dark.len()];
    let mut parent: Vec<u32> = Vec::new();
    fn root(parent: &mut [u32], mut label: u32) -> u32 {
        while parent[label as usize] != label {
            parent[label as usize] = parent[parent[label as usize] as usize];
            label = parent[label as usize];
        }
        label
    }
    for at in 0..dark.len() {
        if !dark[at] {
            continue;
        }
        let left = if at % width > 0 { labels[at - 1] } else { NONE };
        let above = if at >= width { labels[at - width] } else { NONE };
        labels[at] = match (left, above) {
            (NONE, NONE) => {
                parent.push(parent.len() as u32);
                parent.len() as u32 - 1
            }
            (label, NONE) | (NONE, label) => label,
            (a, b) if a == b => a,
            (a, b) => {
                let (a, b) = (root(&mut parent, a), root(&mut parent, b));
                parent[a.max(b) as usize] = a.min(b);
                a.min(b)
            }
        };
    }
    let mut number = vec![NONE; parent.len()];
    let mut patches: Vec<Patch> = Vec::new();
    for (at, label) in labels.iter_mut().enumerate() {
        if *label == NONE {
            continue;
        }
        let root = root(&mut parent, *label) as usize;
        let (x, y) = (at % width, at / width);
        if number[root] == NONE {
            number[root] = patches.len() as u32;
            patches.push(Patch { x: [x, x], y: [y, y], area: 0 });
        }
        *label = number[root];
        let patch = &mut patches[*label as usize];
        patch.x = [patch.x[0].min(x), patch.x[1].max(x)];
        patch.y[1] = y;
        patch.area += 1;
    }
    (labels, patches)
}

fn cross(a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}

fn area(polygon: &[Vector2<f64>]) -> f64 {
    let n = polygon.len();
    0.5 * (0..n).map(|i| cross(polygon[i], polygon[(i + 1) % n])).sum::<f64>()
}

/// The quadrangle that a patch's outline is, if it is one.
fn quad(labels: &[u32], width: usize, label: u32, patch: &Patch) -> Option<Quad> {
    // The outermost pixels of each row, by the corners of their areas.
    let mut points = Vec::new();
    for y in patch.y[0]..=patch.y[1] {
        let row = &labels[y * width + patch.x[0]..=y * width + patch.x[1]];
        let (Some(left), Some(right)) =
            (row.iter().position(|l| *l == label), row.iter().rposition(|l| *l == label))
        else {
            continue;
        };
        for dy in [-0.5, 0.5] {
            points.push(Vector2::new((patch.x[0] + left) as f64 - 0.5, y as f64 + dy));
            points.push(Vector2::new((patch.x[0] + right) as f64 + 0.5, y as f64 + dy));
        }
    }
    let mut polygon = hull(points);
    let whole = area(&polygon);
    // The corner that matters least goes first.
    while polygon.len() > 4 {
        let n = polygon.len();
        let loss = |i: usize| cross(polygon[i] - polygon[(i + n - 1) % n], polygon[(i + 1) % n] - polygon[i]);
        let least = (0..n).min_by(|a, b| loss(*a).total_cmp(&loss(*b)))?;
        polygon.remove(least);
    }
    let quad: Quad = polygon.try_into().ok()?;
    let inside = area(&quad);
    let fill = patch.area as f64 / inside;
    let shortest = (0..4).map(|i| (quad[(i + 1) % 4] - quad[i]).norm()).fold(f64::MAX, f64::min);
    // A tag's border and dark cells are at least a third of it, and some cells are white.
    (inside > 0.8 * whole && shortest > 6.0 && (0.3..0.97).contains(&fill)).then_some(quad)
}

/// Convex hull (Andrew's monotone chain), clockwise as seen with y downwards.
fn hull(mut points: Vec<Vector2<f64>>) -> Vec<Vector2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let half = |points: &mut dyn Iterator<Item = Vector2<f64>>| {
        let mut chain: Vec<Vector2<f64>> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..] {
                if cross(b - a, p - b) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied());
    hull.extend(half(&mut points.iter().rev().copied()));
    hull
}

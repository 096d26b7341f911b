//! Dark patches whose outline is a quadrangle.

use nalgebra::Vector2;

/// Smaller patches hold no tag that could be read, pixels.
const LEAST_SIDE: usize = 9;

/// Four corners, clockwise as seen in the picture, good to a pixel or two.
pub(crate) type Quad = [Vector2<f64>; 4];

/// Dark pixels of one row that touch each other: from the first to the last.
#[derive(Clone, Copy)]
struct Run {
    y: usize,
    x: [usize; 2],
}

/// Dark pixels that touch each other along rows and columns.
struct Patch {
    /// From the top, in a row from the left.
    runs: Vec<Run>,
}

impl Patch {
    fn x(&self) -> [usize; 2] {
        self.runs.iter().fold([usize::MAX, 0], |x, run| [x[0].min(run.x[0]), x[1].max(run.x[1])])
    }

    fn y(&self) -> [usize; 2] {
        [self.runs.first().map_or(0, |r| r.y), self.runs.last().map_or(0, |r| r.y)]
    }

    fn area(&self) -> usize {
        self.runs.iter().map(|run| run.x[1] - run.x[0] + 1).sum()
    }

    /// Whether it can hold a tag: large enough, off the picture's border, and not a thin line.
    fn can_be(&self, width: usize, height: usize) -> bool {
        let (x, y) = (self.x(), self.y());
        let (wide, high) = (x[1] - x[0] + 1, y[1] - y[0] + 1);
        wide >= LEAST_SIDE
            && high >= LEAST_SIDE
            && x[0] > 0
            && y[0] > 0
            && x[1] + 1 < width
            && y[1] + 1 < height
            && self.area() * 8 > wide * high
    }
}

/// Quadrangles among the dark patches of a picture, that do not touch its border.
pub(crate) fn quads(dark: &[bool], width: usize) -> Vec<Quad> {
    let height = dark.len() / width.max(1);
    patches(dark, width).iter().filter(|patch| patch.can_be(width, height)).filter_map(quad).collect()
}

/// The patches, in the order of their first pixels.
fn patches(dark: &[bool], width: usize) -> Vec<Patch> {
    let mut runs: Vec<Run> = Vec::new();
    // Of each run one before it that it belongs to, or itself.
    let mut parent: Vec<usize> = Vec::new();
    fn root(parent: &mut [usize], mut run: usize) -> usize {
        while parent[run] != run {
            parent[run] = parent[parent[run]];
            run = parent[run];
        }
        run
    }
    // The runs of the row above begin here.
    let mut above = 0;
    for (y, row) in dark.chunks_exact(width.max(1)).enumerate() {
        let first = runs.len();
        let (mut x, mut over) = (0, above);
        while let Some(start) = row[x..].iter().position(|d| *d).map(|skip| x + skip) {
            let end = row[start..].iter().position(|d| !*d).map_or(width, |length| start + length);
            let this = runs.len();
            runs.push(Run { y, x: [start, end - 1] });
            parent.push(this);
            while over < first && runs[over].x[1] < start {
                over += 1;
            }
            let mut touching = over;
            while touching < first && runs[touching].x[0] < end {
                let (a, b) = (root(&mut parent, touching), root(&mut parent, this));
                parent[a.max(b)] = a.min(b);
                touching += 1;
            }
            x = end;
        }
        above = first;
    }
    let mut number = vec![usize::MAX; runs.len()];
    let mut patches: Vec<Patch> = Vec::new();
    for (i, run) in runs.iter().enumerate() {
        let root = root(&mut parent, i);
        if number[root] == usize::MAX {
            number[root] = patches.len();
            patches.push(Patch { runs: Vec::new() });
        }
        patches[number[root]].runs.push(*run);
    }
    patches
}

fn cross(a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}

fn area(polygon: &[Vector2<f64>]) -> f64 {
    let n = polygon.len();
    0.5 * (0..n).map(|i| cross(polygon[i], polygon[(i + 1) % n])).sum::<f64>()
}

/// The quadrangle that a patch's outline is, if it is one.
fn quad(patch: &Patch) -> Option<Quad> {
    // The outermost pixels of each row, by the corners of their areas.
    let mut points = Vec::new();
    for row in patch.runs.chunk_by(|a, b| a.y == b.y) {
        let ([first, ..], [.., last]) = (row, row) else { continue };
        for dy in [-0.5, 0.5] {
            points.push(Vector2::new(first.x[0] as f64 - 0.5, first.y as f64 + dy));
            points.push(Vector2::new(last.x[1] as f64 + 0.5, first.y as f64 + dy));
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
    let fill = patch.area() as f64 / inside;
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

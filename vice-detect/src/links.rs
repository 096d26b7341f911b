//! Which saddles are neighbours on a board: along an edge of both, with dark and bright exchanged.

use nalgebra::Vector2;

use crate::saddle::Saddle;

/// How closely neighbours must agree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tolerance {
    /// Sine of how far a neighbour may lie off an edge's direction.
    off_edge: f64,
    /// Cosine of how far its own edge may be turned against that direction.
    turned: f64,
    /// Neighbours have exchanged colours, so that their bright directions are about a right angle apart.
    exchanged: f64,
}

/// Strict first: chance links few saddles then. Where bright squares bleed into dark ones, edges seem turned at their
/// crossings, and only the wider tolerance holds the board together.
pub(crate) const TOLERANCES: [Tolerance; 2] = [
    Tolerance { off_edge: 0.26, turned: 0.9, exchanged: 0.6 },
    Tolerance { off_edge: 0.4, turned: 0.82, exchanged: 0.7 },
];

/// Neighbours on a board are about as strong as each other.
const STRONGER: f32 = 6.0;

/// Neighbours of a saddle with the direction they lie in; at most four.
#[derive(Clone, Debug, Default)]
pub(crate) struct Links(Vec<(Vector2<f64>, usize)>);

impl Links {
    /// The neighbour that lies along a direction.
    pub(crate) fn along(&self, direction: Vector2<f64>) -> Option<usize> {
        self.0.iter().find(|(d, _)| d.dot(&direction) > 0.8).map(|(_, to)| *to)
    }
}

/// Opposite sides of a square differ no more than this in the picture, one by the other: neighbours on a board lie near
/// each other.
const UNLIKE_SIDES: f64 = 1.7;

/// Links that are the side of a square: on a board each is, while chance and print beside the board seldom close one.
pub(crate) fn links(saddles: &[Saddle], tolerance: Tolerance) -> Vec<Links> {
    let mutual = mutual(saddles, tolerance);
    let place = |at: usize| Vector2::new(saddles[at].x, saddles[at].y);
    let alike = |a: [usize; 2], b: [usize; 2]| {
        let length = |[from, to]: [usize; 2]| (place(to) - place(from)).norm();
        let (a, b) = (length(a), length(b));
        a < UNLIKE_SIDES * b && b < UNLIKE_SIDES * a
    };
    let mut sides: Vec<(usize, usize)> = Vec::new();
    for (corner, neighbours) in mutual.iter().enumerate() {
        for (k, (one_way, one)) in neighbours.0.iter().enumerate() {
            for (other_way, other) in &neighbours.0[k + 1..] {
                if one_way.dot(other_way).abs() > 0.9 {
                    continue;
                }
                let across =
                    mutual[*one].0.iter().map(|(_, to)| *to).find(|across| {
                        *across != corner && mutual[*other].0.iter().any(|(_, to)| to == across)
                    });
                let Some(across) = across else { continue };
                if alike([corner, *one], [*other, across]) && alike([corner, *other], [*one, across]) {
                    for (a, b) in [(corner, *one), (corner, *other), (*one, across), (*other, across)] {
                        sides.extend([(a, b), (b, a)]);
                    }
                }
            }
        }
    }
    sides.sort_unstable();
    let is_side = |from: usize, to: usize| sides.binary_search(&(from, to)).is_ok();
    let kept = mutual.into_iter().enumerate();
    kept.map(|(from, links)| Links(links.0.into_iter().filter(|(_, to)| is_side(from, *to)).collect()))
        .collect()
}

/// Links that both ends agree on.
fn mutual(saddles: &[Saddle], tolerance: Tolerance) -> Vec<Links> {
    // Nearest in each of the four directions: edge 0 forwards and backwards, edge 1 forwards and backwards.
    let mut nearest = vec![[(f64::MAX, usize::MAX); 4]; saddles.len()];
    for (from, s) in saddles.iter().enumerate() {
        for (to, t) in saddles.iter().enumerate() {
            let exchanged = s.bright.dot(&t.bright).abs() < tolerance.exchanged;
            let alike = s.response < STRONGER * t.response && t.response < STRONGER * s.response;
            if !(exchanged && alike) || from == to {
                continue;
            }
            let way = Vector2::new(t.x - s.x, t.y - s.y);
            let squared = way.norm_squared();
            for (edge, e) in s.edges.iter().enumerate() {
                let along = way.dot(e);
                let slot = 2 * edge + usize::from(along < 0.0);
                if squared >= nearest[from][slot].0 {
                    continue;
                }
                let off = way.x * e.y - way.y * e.x;
                let own = t.edges.iter().map(|o| way.dot(o).powi(2)).fold(0.0, f64::max);
                if off * off < tolerance.off_edge.powi(2) * squared
                    && own > tolerance.turned.powi(2) * squared
                {
                    nearest[from][slot] = (squared, to);
                }
            }
        }
    }
    nearest
        .iter()
        .enumerate()
        .map(|(from, slots)| {
            let mutual = slots
                .iter()
                .filter(|(_, to)| *to != usize::MAX && nearest[*to].iter().any(|(_, back)| *back == from));
            let towards = mutual.map(|(squared, to)| {
                let way = Vector2::new(saddles[*to].x - saddles[from].x, saddles[*to].y - saddles[from].y);
                (way / squared.sqrt(), *to)
            });
            Links(towards.collect())
        })
        .collect()
}

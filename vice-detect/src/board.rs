//! Chessboards: saddles linked into a grid, and the grid turned so that its names mean the same in every frame.

use std::collections::{BTreeMap, VecDeque};
use std::str::FromStr;

use nalgebra::Vector2;
use vice_core::camera::Pixel;

use crate::gray::Gray;
use crate::links::{Links, TOLERANCES, links};
use crate::saddle::{self, Saddle};

/// Inner corners of a chessboard: a board of 7 by 8 squares has 6 by 7.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoardSize {
    columns: usize,
    rows: usize,
}

impl BoardSize {
    /// A board of at least 3x3 inner corners, which is what it takes to tell a grid from chance.
    ///
    /// # Errors
    /// What is wrong, in words: fewer than 3 or more than 100 corners along a side.
    pub fn new(columns: usize, rows: usize) -> Result<Self, String> {
        let fits = |n: usize| (3..=100).contains(&n);
        if fits(columns) && fits(rows) {
            Ok(Self { columns, rows })
        } else {
            Err(format!(
                "a chessboard of {columns}x{rows} inner corners cannot be found: 3 to 100 along each side"
            ))
        }
    }

    /// Inner corners along a row.
    pub const fn columns(&self) -> usize {
        self.columns
    }

    /// Rows of inner corners.
    pub const fn rows(&self) -> usize {
        self.rows
    }
}

impl FromStr for BoardSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is no board size; give its inner corners, such as 6x7");
        let (columns, rows) = text.split_once(['x', 'X']).ok_or_else(wrong)?;
        Self::new(columns.trim().parse().map_err(|_| wrong())?, rows.trim().parse().map_err(|_| wrong())?)
    }
}

impl std::fmt::Display for BoardSize {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}", self.columns, self.rows)
    }
}

/// A chessboard in one picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Board {
    /// Ways to name its corners, row by row. One where the colours tell which end is which (columns plus rows odd);
    /// otherwise two, or four for a square board, each a turn of the others. Rows run to the right of columns, as seen
    /// on the printed side, and the square between the first four corners is dark where the colours can tell.
    pub turns: Vec<Vec<Pixel>>,
    /// 0 to 1: how evenly the corners are spaced, as they are on a plane seen through a lens.
    pub confidence: f32,
}

/// What a look for a board gives.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Found {
    Board(Board),
    /// A full grid of another size.
    Other(usize, usize),
    Nothing,
}

/// A step of a grid differs from the one before it by less, as a share of it.
const EVEN: f64 = 0.35;

/// Position in the grid, in steps from where the walk began.
type Cell = (i32, i32);
/// Corners by their position.
type Grid = BTreeMap<Cell, Vector2<f64>>;

/// Looks for a board among the saddles of a smoothed picture.
pub(crate) fn find(smooth: &Gray, saddles: &[Saddle], size: BoardSize) -> Found {
    let mut other = Found::Nothing;
    for tolerance in TOLERANCES {
        let mut best: Option<Board> = None;
        for grid in grids(saddles, &links(saddles, tolerance)) {
            match fit(smooth, &grid, size) {
                Found::Board(board) if best.as_ref().is_none_or(|b| board.confidence > b.confidence) => {
                    best = Some(board);
                }
                Found::Other(columns, rows) => other = Found::Other(columns, rows),
                _ => {}
            }
        }
        if let Some(board) = best {
            return Found::Board(board);
        }
    }
    other
}

/// Connected saddles with their positions, the largest first.
fn grids(saddles: &[Saddle], links: &[Links]) -> Vec<Grid> {
    let mut seen = vec![false; saddles.len()];
    let mut grids = Vec::new();
    for start in 0..saddles.len() {
        if seen[start] {
            continue;
        }
        let mut grid = Grid::new();
        // Each saddle with its position and the directions that count up columns and rows there.
        let mut queue = VecDeque::from([(start, (0, 0), saddles[start].edges)]);
        seen[start] = true;
        while let Some((at, (i, j), [right, down])) = queue.pop_front() {
            grid.entry((i, j)).or_insert_with(|| Vector2::new(saddles[at].x, saddles[at].y));
            for (direction, step) in [(right, (1, 0)), (-right, (-1, 0)), (down, (0, 1)), (-down, (0, -1))] {
                let Some(next) = links[at].along(direction) else { continue };
                if seen[next] {
                    continue;
                }
                seen[next] = true;
                let edges = saddles[next].edges;
                let aligned = |axis: Vector2<f64>| {
                    let [a, b] = edges;
                    let edge = if a.dot(&axis).abs() > b.dot(&axis).abs() { a } else { b };
                    edge * edge.dot(&axis).signum()
                };
                queue.push_back((next, (i + step.0, j + step.1), [aligned(right), aligned(down)]));
            }
        }
        prune(&mut grid);
        if grid.len() >= 9 {
            grids.push(grid);
        }
    }
    grids.sort_by_key(|g| std::cmp::Reverse(g.len()));
    grids
}

/// Takes away what hangs on by one neighbour: on a board even the outermost corner has two, chance has chains.
fn prune(grid: &mut Grid) {
    loop {
        let loose: Vec<Cell> = grid
            .keys()
            .copied()
            .filter(|(i, j)| {
                let beside = [(1, 0), (-1, 0), (0, 1), (0, -1)];
                beside.iter().filter(|(di, dj)| grid.contains_key(&(i + di, j + dj))).count() < 2
            })
            .collect();
        if loose.is_empty() {
            return;
        }
        for cell in loose {
            grid.remove(&cell);
        }
    }
}

/// Whether a grid is the board asked for, in the place of it where it is the most even.
fn fit(smooth: &Gray, grid: &Grid, size: BoardSize) -> Found {
    let (w, h) = (size.columns as i32, size.rows as i32);
    let shapes = if w == h { vec![(w, h)] } else { vec![(w, h), (h, w)] };
    let wanted = size.columns * size.rows;
    let windows: Vec<(usize, Cell, (i32, i32))> = shapes.into_iter().flat_map(|s| windows(grid, s)).collect();
    let most = windows.iter().map(|(inside, _, _)| *inside).max().unwrap_or(0);
    if most * 2 < wanted {
        return other_size(grid);
    }
    // What hangs on at some places is the surroundings; a side that goes on is a larger board.
    let nearly = windows.into_iter().filter(|(inside, _, _)| (inside + wanted / 10) >= most);
    let ends: Vec<_> = nearly.filter(|(_, corner, shape)| !goes_on(grid, *corner, *shape)).collect();
    let boards =
        ends.iter().filter_map(|(_, corner, shape)| board_in(smooth, grid.clone(), (*corner, *shape), size));
    match boards.reduce(|a, b| if b.confidence > a.confidence { b } else { a }) {
        Some(board) => Found::Board(board),
        None if ends.is_empty() => other_size(grid),
        None => Found::Nothing,
    }
}

/// The board in a window of the grid; missing corners are looked for where they should be.
fn board_in(
    smooth: &Gray,
    mut grid: Grid,
    (corner, shape): (Cell, (i32, i32)),
    size: BoardSize,
) -> Option<Board> {
    grid.retain(|cell, _| in_window(*cell, corner, shape));
    if !complete(smooth, &mut grid, corner, shape) {
        return None;
    }
    let corners: Vec<Vector2<f64>> = grid_in_order(&grid, corner, shape);
    let spacing = spacing(&corners, shape);
    let reach = if spacing < 9.0 { 2 } else { 3 };
    let mut refined = Vec::with_capacity(corners.len());
    for c in &corners {
        match saddle::refine(smooth, c.x, c.y, reach) {
            Some((x, y)) if (x - c.x).hypot(y - c.y) < 1.5 => refined.push(Vector2::new(x, y)),
            _ => return None,
        }
    }
    let unevenness = unevenness(&refined, shape);
    if unevenness > 0.1 * spacing || !colours_alternate(smooth, &refined, shape) {
        return None;
    }
    let turns = turns(smooth, &refined, shape, size);
    if turns.is_empty() {
        return None;
    }
    Some(Board { turns, confidence: (1.0 / (1.0 + (unevenness / 0.25).powi(2))) as f32 })
}

/// All places of a shape: how many corners it covers, its first cell, and the shape.
fn windows(grid: &Grid, shape: (i32, i32)) -> Vec<(usize, Cell, (i32, i32))> {
    let Some([i, j]) = extents(grid) else { return vec![] };
    let rows = j[0]..=(j[1] - shape.1 + 1).max(j[0]);
    let starts = rows.flat_map(|j0| (i[0]..=(i[1] - shape.0 + 1).max(i[0])).map(move |i0| (i0, j0)));
    starts.map(|start| (grid.keys().filter(|c| in_window(**c, start, shape)).count(), start, shape)).collect()
}

/// Whether the grid goes on beyond a side of the window as evenly as within it, at half of the places or more.
fn goes_on(grid: &Grid, corner: Cell, (w, h): (i32, i32)) -> bool {
    // A side: its first cell, the step along it, how many cells it has, and the step outwards.
    let (left, top) = corner;
    let (right, bottom) = (left + w - 1, top + h - 1);
    let sides = [
        ((left, top), (0, 1), h, (-1, 0)),
        ((right, top), (0, 1), h, (1, 0)),
        ((left, top), (1, 0), w, (0, -1)),
        ((left, bottom), (1, 0), w, (0, 1)),
    ];
    sides.into_iter().any(|(first, along, count, out)| {
        let goes_on = (0..count).filter(|k| {
            let at =
                |n: i32| grid.get(&(first.0 + k * along.0 + n * out.0, first.1 + k * along.1 + n * out.1));
            let (Some(inner), Some(border), Some(outer)) = (at(-1), at(0), at(1)) else { return false };
            let step = border - inner;
            (outer - border - step).norm() < EVEN * step.norm()
        });
        2 * goes_on.count() as i32 > count
    })
}

fn extents(grid: &Grid) -> Option<[[i32; 2]; 2]> {
    let of = |pick: fn(&Cell) -> i32| Some([grid.keys().map(pick).min()?, grid.keys().map(pick).max()?]);
    Some([of(|c| c.0)?, of(|c| c.1)?])
}

fn in_window(cell: Cell, corner: Cell, shape: (i32, i32)) -> bool {
    (0..shape.0).contains(&(cell.0 - corner.0)) && (0..shape.1).contains(&(cell.1 - corner.1))
}

/// What a grid is that is not the board: another board where it is full, or nothing.
fn other_size(grid: &Grid) -> Found {
    let Some([i, j]) = extents(grid) else { return Found::Nothing };
    let (w, h) = ((i[1] - i[0] + 1) as usize, (j[1] - j[0] + 1) as usize);
    if w.min(h) >= 3 && grid.len() >= 12 && grid.len() * 20 >= w * h * 19 {
        Found::Other(w.min(h), w.max(h))
    } else {
        Found::Nothing
    }
}

/// Fills cells without a corner from their neighbours, as long as there is a saddle where they should be.
fn complete(smooth: &Gray, grid: &mut Grid, corner: Cell, shape: (i32, i32)) -> bool {
    let cells: Vec<Cell> =
        (0..shape.1).flat_map(|j| (0..shape.0).map(move |i| (corner.0 + i, corner.1 + j))).collect();
    loop {
        let missing: Vec<Cell> = cells.iter().copied().filter(|c| !grid.contains_key(c)).collect();
        if missing.is_empty() {
            return true;
        }
        let before = grid.len();
        for (i, j) in missing {
            let at = |di: i32, dj: i32| grid.get(&(i + di, j + dj));
            let beyond = [(1, 0), (-1, 0), (0, 1), (0, -1)].into_iter().filter_map(|(di, dj)| {
                let (near, far) = (at(di, dj)?, at(2 * di, 2 * dj)?);
                Some((near * 2.0 - far, (near - far).norm()))
            });
            let between = [(1, 0), (0, 1)].into_iter().filter_map(|(di, dj)| {
                let (one, two) = (at(di, dj)?, at(-di, -dj)?);
                Some(((one + two) * 0.5, (one - two).norm() / 2.0))
            });
            let guesses: Vec<(Vector2<f64>, f64)> = between.chain(beyond).collect();
            let Some((_, step)) = guesses.first().copied() else { continue };
            let guess = guesses.iter().map(|g| g.0).sum::<Vector2<f64>>() / guesses.len() as f64;
            let Some((x, y)) = saddle::refine(smooth, guess.x, guess.y, 3) else { continue };
            if (x - guess.x).hypot(y - guess.y) < 0.3 * step {
                grid.insert((i, j), Vector2::new(x, y));
            }
        }
        if grid.len() == before {
            return false;
        }
    }
}

fn grid_in_order(grid: &Grid, corner: Cell, shape: (i32, i32)) -> Vec<Vector2<f64>> {
    (0..shape.1)
        .flat_map(|j| (0..shape.0).filter_map(move |i| grid.get(&(corner.0 + i, corner.1 + j)).copied()))
        .collect()
}

/// Shortest distance of neighbours.
fn spacing(corners: &[Vector2<f64>], (w, h): (i32, i32)) -> f64 {
    runs(w, h, 2).map(|run| (corners[run[1]] - corners[run[0]]).norm()).fold(f64::MAX, f64::min)
}

/// How far corners are from a smooth grid: third differences along rows and columns, scaled to one corner's error.
fn unevenness(corners: &[Vector2<f64>], (w, h): (i32, i32)) -> f64 {
    let mut count = 0;
    let mut sum = 0.0;
    for run in runs(w, h, 4) {
        let [a, b, c, d] = [corners[run[0]], corners[run[1]], corners[run[2]], corners[run[3]]];
        sum += (a - b * 3.0 + c * 3.0 - d).norm_squared();
        count += 1;
    }
    // 1 + 9 + 9 + 1 errors of two coordinates each.
    if count == 0 { 0.0 } else { (sum / f64::from(count) / 20.0).sqrt() }
}

/// Indices of `n` corners in a row or column.
fn runs(w: i32, h: i32, n: i32) -> impl Iterator<Item = Vec<usize>> {
    let index = move |i: i32, j: i32| (j * w + i) as usize;
    let across = (0..h)
        .flat_map(move |j| (0..=w - n).map(move |i| (0..n).map(|k| index(i + k, j)).collect::<Vec<_>>()));
    let down = (0..w)
        .flat_map(move |i| (0..=h - n).map(move |j| (0..n).map(|k| index(i, j + k)).collect::<Vec<_>>()));
    across.chain(down)
}

/// Brightness in the middle of the inner squares, and the parity of their position.
fn squares(smooth: &Gray, corners: &[Vector2<f64>], (w, h): (i32, i32)) -> Option<Vec<(i32, f32)>> {
    let mut squares = Vec::new();
    for j in 0..h - 1 {
        for i in 0..w - 1 {
            let at = |di: i32, dj: i32| corners[((j + dj) * w + i + di) as usize];
            let middle = (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1)) / 4.0;
            squares.push(((i + j) % 2, smooth.sample(middle.x, middle.y)?));
        }
    }
    Some(squares)
}

fn mean_of(squares: &[(i32, f32)], parity: i32) -> f32 {
    let values: Vec<f32> = squares.iter().filter(|s| s.0 == parity).map(|s| s.1).collect();
    values.iter().sum::<f32>() / values.len().max(1) as f32
}

/// Whether squares of one parity are dark and the others bright, as far as a shadow or a highlight lets them.
fn colours_alternate(smooth: &Gray, corners: &[Vector2<f64>], shape: (i32, i32)) -> bool {
    let Some(squares) = squares(smooth, corners, shape) else { return false };
    let (even, odd) = (mean_of(&squares, 0), mean_of(&squares, 1));
    let middle = (even + odd) / 2.0;
    let wrong =
        squares.iter().filter(|(parity, v)| ((*v > middle) == (even > odd)) != (*parity == 0)).count();
    (even - odd).abs() > 10.0 && wrong * 10 <= squares.len()
}

/// The ways to name the corners that keep the board's printed side up and, where they can tell, its colours in place.
fn turns(smooth: &Gray, corners: &[Vector2<f64>], shape: (i32, i32), size: BoardSize) -> Vec<Vec<Pixel>> {
    let (columns, rows) = (size.columns as i32, size.rows as i32);
    let (w, h) = shape;
    let mut all: Vec<(bool, Vec<Vector2<f64>>)> = Vec::new();
    for transposed in [false, true] {
        if (if transposed { (h, w) } else { (w, h) }) != (columns, rows) {
            continue;
        }
        for (flip_i, flip_j) in [(false, false), (true, true), (true, false), (false, true)] {
            let pick = |c: i32, r: i32| {
                let (i, j) = if transposed { (r, c) } else { (c, r) };
                let (i, j) = (if flip_i { w - 1 - i } else { i }, if flip_j { h - 1 - j } else { j });
                corners[(j * w + i) as usize]
            };
            let (right, down) = (pick(columns - 1, 0) - pick(0, 0), pick(0, rows - 1) - pick(0, 0));
            if right.x * down.y - right.y * down.x <= 0.0 {
                continue; // seen in a mirror
            }
            let named: Vec<_> =
                (0..rows).flat_map(|r| (0..columns).map(move |c| (c, r))).map(|(c, r)| pick(c, r)).collect();
            let Some(squares) = squares(smooth, &named, (columns, rows)) else { continue };
            all.push((mean_of(&squares, 0) < mean_of(&squares, 1), named));
        }
    }
    if all.iter().any(|(dark_first, _)| *dark_first) {
        all.retain(|(dark_first, _)| *dark_first);
    }
    all.into_iter().map(|(_, named)| named.iter().map(|p| Pixel::new(p.x, p.y)).collect()).collect()
}

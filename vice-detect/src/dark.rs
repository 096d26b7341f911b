//! What is dark against its surroundings: the first look for a tag's border.

use crate::gray::Gray;

/// Side of the finest tiles, pixels; each coarser level has tiles of four times that side.
const TILE: usize = 4;
/// Tiles that differ less than this within have no say, gray levels.
const LEAST_RANGE: f32 = 20.0;
/// A tile decides for itself if it spans this part of what the coarser ones around it span.
const DECIDES: f32 = 0.4;
/// Where dark ends, from the darkest to the brightest. Below the middle: where the squares of an AprilGrid touch the
/// corners of its tags the picture is half way between, and they must fall apart.
const SPLIT: f32 = 0.33;

/// Darkest and brightest value of tiles and their eight neighbours.
struct Level {
    columns: usize,
    rows: usize,
    ranges: Vec<(f32, f32)>,
}

impl Level {
    fn widened(columns: usize, rows: usize, tiles: &[(f32, f32)]) -> Self {
        let mut ranges = Vec::with_capacity(tiles.len());
        for row in 0..rows {
            for column in 0..columns {
                let mut range = (f32::MAX, f32::MIN);
                for r in row.saturating_sub(1)..(row + 2).min(rows) {
                    for c in column.saturating_sub(1)..(column + 2).min(columns) {
                        let tile = tiles[r * columns + c];
                        range = (range.0.min(tile.0), range.1.max(tile.1));
                    }
                }
                ranges.push(range);
            }
        }
        Self { columns, rows, ranges }
    }

    fn at(&self, column: usize, row: usize) -> (f32, f32) {
        self.ranges[row.min(self.rows - 1) * self.columns + column.min(self.columns - 1)]
    }
}

/// Whether each pixel is dark, row by row.
pub(crate) fn dark(gray: &Gray) -> Vec<bool> {
    let (w, h) = (gray.width, gray.height);
    let (mut columns, mut rows) = (w.div_ceil(TILE), h.div_ceil(TILE));
    let mut tiles = vec![(f32::MAX, f32::MIN); columns * rows];
    for (y, row) in gray.data.chunks_exact(w).enumerate() {
        let line = &mut tiles[y / TILE * columns..(y / TILE + 1) * columns];
        for (tile, values) in line.iter_mut().zip(row.chunks(TILE)) {
            for v in values {
                // Values are numbers: `min` would ask.
                *tile = (if *v < tile.0 { *v } else { tile.0 }, if *v > tile.1 { *v } else { tile.1 });
            }
        }
    }
    let mut levels = vec![Level::widened(columns, rows, &tiles)];
    for _ in 0..2 {
        let (wide, high) = (columns.div_ceil(4), rows.div_ceil(4));
        let mut coarse = vec![(f32::MAX, f32::MIN); wide * high];
        for (i, tile) in tiles.iter().enumerate() {
            let into = &mut coarse[i / columns / 4 * wide + i % columns / 4];
            *into = (into.0.min(tile.0), into.1.max(tile.1));
        }
        (columns, rows, tiles) = (wide, high, coarse);
        levels.push(Level::widened(columns, rows, &tiles));
    }
    let threshold = |column: usize, row: usize| {
        let ranges = [
            levels[0].at(column, row),
            levels[1].at(column / 4, row / 4),
            levels[2].at(column / 16, row / 16),
        ];
        let span = |r: (f32, f32)| r.1 - r.0;
        let decides = |fine: usize| {
            span(ranges[fine]) >= LEAST_RANGE
                && ranges[fine + 1..].iter().all(|r| span(ranges[fine]) >= DECIDES * span(*r))
        };
        let (low, high) = ranges[(0..2).find(|level| decides(*level)).unwrap_or(2)];
        if high - low < LEAST_RANGE { f32::MIN } else { low + SPLIT * (high - low) }
    };
    let columns = w.div_ceil(TILE);
    let thresholds: Vec<f32> = (0..h.div_ceil(TILE))
        .flat_map(|row| (0..columns).map(move |column| (column, row)))
        .map(|(c, r)| threshold(c, r))
        .collect();
    let mut mask = vec![false; w * h];
    let mut limits = vec![0.0; columns * TILE];
    for (y, (row, mask)) in gray.data.chunks_exact(w).zip(mask.chunks_exact_mut(w)).enumerate() {
        if y % TILE == 0 {
            let line = &thresholds[y / TILE * columns..(y / TILE + 1) * columns];
            for (limits, t) in limits.chunks_exact_mut(TILE).zip(line) {
                limits.fill(*t);
            }
        }
        for ((dark, v), limit) in mask.iter_mut().zip(row).zip(&limits) {
            *dark = v < limit;
        }
    }
    mask
}

//! The means of the pass: one column for the residuals and each derivative, number by number of the state, so that a register
//! holds the same number of several columns.

/// Columns are padded to this many: the widest register.
pub(super) const COLUMNS: usize = 8;

/// One mean for each column.
pub(super) struct Means {
    /// Columns, padded.
    width: usize,
    values: Vec<f64>,
}

impl Means {
    /// Of a state of so many numbers.
    pub(super) fn new(numbers: usize, columns: usize) -> Self {
        let width = columns.next_multiple_of(COLUMNS);
        Self { width, values: vec![0.0; numbers * width] }
    }

    #[inline(always)]
    pub(super) const fn width(&self) -> usize {
        self.width
    }

    /// Twice as many columns; the new ones are zero.
    pub(super) fn widen(&mut self) {
        let mut wider = vec![0.0; 2 * self.values.len()];
        for (to, from) in wider.chunks_exact_mut(2 * self.width).zip(self.values.chunks_exact(self.width)) {
            to[..self.width].copy_from_slice(from);
        }
        (self.width, self.values) = (2 * self.width, wider);
    }

    /// A number of the state, in all columns.
    #[cfg(test)]
    pub(super) fn row(&self, number: usize) -> &[f64] {
        &self.values[number * self.width..(number + 1) * self.width]
    }

    #[inline(always)]
    fn row_mut(&mut self, number: usize) -> &mut [f64] {
        &mut self.values[number * self.width..(number + 1) * self.width]
    }

    /// Some numbers of the state, in all columns.
    #[inline(always)]
    pub(super) fn rows_mut(&mut self, count: usize) -> &mut [f64] {
        &mut self.values[..count * self.width]
    }

    /// `mean[to] += times · mean[from]`.
    #[inline(always)]
    pub(super) fn add(&mut self, to: usize, from: usize, times: f64) {
        let (to, from) = (to * self.width, from * self.width);
        for c in 0..self.width {
            self.values[to + c] += times * self.values[from + c];
        }
    }

    /// Makes a number of the state zero in all columns.
    #[inline(always)]
    pub(super) fn clear(&mut self, at: usize) {
        for value in self.row_mut(at) {
            *value = 0.0;
        }
    }

    #[inline(always)]
    pub(super) fn scale(&mut self, at: usize, times: f64) {
        for value in self.row_mut(at) {
            *value *= times;
        }
    }

    /// Copies so many numbers of the state from one place to another.
    #[inline(always)]
    pub(super) fn copy(&mut self, from: usize, to: usize, count: usize) {
        let w = self.width;
        self.values.copy_within(from * w..(from + count) * w, to * w);
    }

    pub(super) fn set(&mut self, number: usize, column: usize, value: f64) {
        self.values[number * self.width + column] = value;
    }

    /// Makes a column zero.
    pub(super) fn clear_column(&mut self, column: usize) {
        self.values.iter_mut().skip(column).step_by(self.width).for_each(|value| *value = 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wider_means_hold_what_they_held() {
        let mut means = Means::new(3, 5);
        assert_eq!(means.width(), 8);
        means.set(1, 4, 2.0);
        means.set(2, 7, 3.0);
        means.widen();
        assert_eq!((means.width(), means.row(1)[4], means.row(2)[7]), (16, 2.0, 3.0));
        means.set(2, 15, 4.0);
        means.add(0, 2, 0.5);
        assert_eq!((means.row(0)[7], means.row(0)[15]), (1.5, 2.0));
        means.copy(1, 0, 2);
        assert_eq!((means.row(0)[4], means.row(1)[15]), (2.0, 4.0));
        means.clear_column(15);
        means.scale(1, 2.0);
        assert_eq!((means.row(1)[15], means.row(1)[7], means.rows_mut(1)[4]), (0.0, 6.0, 2.0));
    }
}

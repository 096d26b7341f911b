//! Labels that take part, as runs: consecutive labels in consecutive frames, which is how they mostly are.

/// Consecutive labels of a point in consecutive frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Run {
    /// Place of the first label among those of the point.
    pub(super) label: u32,
    /// Place of its frame: among the camera's while labels are chosen, among the selected ones from then on.
    pub(super) frame: u32,
    pub(super) count: u32,
}

impl Run {
    /// Labels and frames, one by one.
    pub(super) fn pairs(self) -> impl ExactSizeIterator<Item = (usize, usize)> {
        (0..self.count as usize).map(move |i| (self.label as usize + i, self.frame as usize + i))
    }
}

/// Adds a label to the runs from `first` on.
#[inline]
pub(super) fn add(runs: &mut Vec<Run>, first: usize, label: usize, frame: usize) {
    add_run(runs, first, Run { label: index(label), frame: index(frame), count: 1 });
}

/// Adds some.
#[inline]
pub(super) fn add_run(runs: &mut Vec<Run>, first: usize, run: Run) {
    if runs.len() > first
        && let Some(last) = runs.last_mut()
        && (last.label + last.count, last.frame + last.count) == (run.label, run.frame)
    {
        last.count += run.count;
        return;
    }
    runs.push(run);
}

/// A place as it is kept.
pub(super) fn index(at: usize) -> u32 {
    u32::try_from(at).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_on_is_one_run() {
        let mut runs = Vec::new();
        for (label, frame) in [(3, 10), (4, 11), (5, 13), (6, 14), (8, 15)] {
            add(&mut runs, 0, label, frame);
        }
        let first = runs.len();
        add(&mut runs, first, 9, 16);
        let pairs: Vec<_> = runs.iter().flat_map(|r| r.pairs()).collect();
        assert_eq!(pairs, [(3, 10), (4, 11), (5, 13), (6, 14), (8, 15), (9, 16)]);
        assert_eq!(runs.iter().map(|r| r.count).collect::<Vec<_>>(), [2, 2, 1, 1]);
    }
}

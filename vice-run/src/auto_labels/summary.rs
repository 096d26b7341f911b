//! How labels came about, in words.

use super::Tracked;

impl Tracked {
    /// Share of the possible labels that are there, percent.
    pub fn coverage_percent(&self) -> f64 {
        100.0 * self.report.made as f64 / self.report.possible.max(1) as f64
    }

    /// A few lines: how much is labelled, what became of the points, and how well they agree.
    pub fn summary(&self) -> String {
        let report = &self.report;
        let ends = &report.ends;
        let mut text = format!(
            "{} frames, {} points, {}: {} of {} labels ({:.0} %) in {} segments\n",
            self.frames,
            self.points,
            self.ground,
            report.made,
            report.possible,
            self.coverage_percent(),
            report.segments
        );
        text += &format!(
            "{} points followed: {} left the image, {} lost, {} doubtful, {} did not lead back; {} cuts where one moved apart\n",
            report.followed, ends.left, ends.lost, ends.doubtful, ends.no_way_back, ends.apart
        );
        text += &match report.agreement {
            Some([median, least]) => format!(
                "{:.0} % of the points move as one scene ({:.0} % at worst, {} pairs of frames",
                100.0 * median,
                100.0 * least,
                report.pairs
            ),
            None => format!(
                "no two frames have enough points to hold them against each other ({} pairs",
                report.pairs
            ),
        };
        match report.pairs_unchecked {
            0 => text + ")\n",
            few => text + &format!(", {few} with too few)\n"),
        }
    }
}

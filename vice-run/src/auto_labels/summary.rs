//! How labels came about, for who asks.

use super::Tracked;
use crate::tracking_summary::{Ended, OneMotion, TrackingSummary};

impl Tracked {
    /// How it went.
    pub fn summary(&self) -> TrackingSummary {
        let report = &self.report;
        let ends = &report.ends;
        TrackingSummary {
            frames: self.frames,
            points: self.points,
            ground: self.ground.clone(),
            labels: report.made,
            labels_possible: report.possible,
            coverage_percent: 100.0 * report.made as f64 / report.possible.max(1) as f64,
            segments: report.segments,
            followed: report.followed,
            ended: Ended {
                left_image: ends.left,
                lost: ends.lost,
                doubtful: ends.doubtful,
                no_way_back: ends.no_way_back,
                moved_apart: ends.apart,
            },
            one_motion: report.agreement.map(|[median, least]| OneMotion {
                median_percent: 100.0 * median,
                least_percent: 100.0 * least,
            }),
            pairs: report.pairs,
            pairs_unchecked: report.pairs_unchecked,
            frames_undecoded: report.undecoded.len(),
            frames_groundless: report.groundless.len(),
        }
    }
}

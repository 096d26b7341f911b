//! How automatic labels came about: what a result document keeps of it, and the same in words.

use serde::{Deserialize, Serialize};

use crate::text::printable;

/// What was followed, and what became of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TrackingSummary {
    /// Frames that are labelled.
    pub frames: usize,
    /// Points at any time.
    pub points: usize,
    /// Where labels may start.
    pub ground: String,
    /// Labels that there are.
    pub labels: usize,
    /// Labels that there could be: a label a point and frame.
    pub labels_possible: usize,
    /// Share of these that there are, percent.
    pub coverage_percent: f64,
    /// Segments that the labels lie in.
    pub segments: usize,
    /// Points that were followed, for a while each.
    pub followed: usize,
    /// How many of them ended, and why.
    pub ended: Ended,
    /// Share of the points that follow one motion, percent; `None` where no two frames have enough points to tell.
    pub one_motion: Option<OneMotion>,
    /// Pairs of frames whose points were held against each other.
    pub pairs: usize,
    /// Pairs of frames with too few points for that.
    pub pairs_unchecked: usize,
    /// Frames that could not be decoded.
    pub frames_undecoded: usize,
    /// Frames of which nothing could be said where labels may start.
    pub frames_groundless: usize,
}

/// Points that were dropped, by reason.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ended {
    /// It left the image.
    pub left_image: usize,
    /// It was not found again.
    pub lost: usize,
    /// The tracker was no longer sure.
    pub doubtful: usize,
    /// Followed back again, it did not come to where it had started.
    pub no_way_back: usize,
    /// It moved apart from the others: cut there, it may go on behind the cut.
    pub moved_apart: usize,
}

/// Share of the points that follow one motion, over pairs of frames.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OneMotion {
    /// Half of the pairs have more, percent.
    pub median_percent: f64,
    /// The pair with the fewest, percent.
    pub least_percent: f64,
}

impl TrackingSummary {
    /// A few lines: how much is labelled, what became of the points, and how well they agree.
    pub fn text(&self) -> String {
        let ended = &self.ended;
        let mut text = format!(
            "{} frames, {} points, {}: {} of {} labels ({:.0} %) in {} segments\n",
            self.frames,
            self.points,
            printable(&self.ground),
            self.labels,
            self.labels_possible,
            self.coverage_percent,
            self.segments
        );
        text += &format!(
            "{} points followed: {} left the image, {} lost, {} doubtful, {} did not lead back; {} cuts where one moved apart\n",
            self.followed, ended.left_image, ended.lost, ended.doubtful, ended.no_way_back, ended.moved_apart
        );
        text += &match &self.one_motion {
            Some(OneMotion { median_percent, least_percent }) => format!(
                "{median_percent:.0} % of the points move as one scene ({least_percent:.0} % at worst, {} pairs of frames",
                self.pairs
            ),
            None => {
                format!(
                    "no two frames have enough points to hold them against each other ({} pairs",
                    self.pairs
                )
            }
        };
        text += &match self.pairs_unchecked {
            0 => ")\n".to_string(),
            few => format!(", {few} with too few)\n"),
        };
        for (count, what) in [
            (self.frames_undecoded, "could not be decoded"),
            (self.frames_groundless, "have no depth that can be read"),
        ] {
            if count > 0 {
                text += &format!("{count} frames {what}\n");
            }
        }
        text
    }
}

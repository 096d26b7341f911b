//! Labels without a hand: points are chosen, followed, checked against each other, and made into segments.
//!
//! No pose is asked, since poses are what the labels are to judge. What speaks for a place is in the images alone:
//! a point is followed there and back again, its looks are compared with those at its start, and all points together
//! have to move as one rigid scene ([`crate::two_view`]). Many more points are followed than are wanted, so that wrong
//! ones are outvoted; those that stay in view long and lie far apart become labels.
//!
//! | module | what |
//! | --- | --- |
//! | `timeline` | frames that are visited, those that are labelled, and where new points may start |
//! | `path` | one point and where it was seen |
//! | `sweep` | all points through all frames, a few frames in memory at a time |
//! | `agree` | paths against each other, cut where they stop to move as the scene does |
//! | `fill` | between and beyond what a person placed |
//! | `lanes` | from pieces of paths to points with segments |

mod agree;
mod fill;
mod lanes;
mod path;
mod sweep;
#[cfg(test)]
mod tests;
mod timeline;

use vice_core::camera::{Camera, Pixel};
use vice_core::dataset::Image;
use vice_core::error::DataResult;

pub use path::Ground;
pub use timeline::Timeline;

use path::{End, Path};
use sweep::{Start, Sweep};

/// How many points are followed for each that is wanted, and at least: enough to outvote wrong ones.
const POOL: (f64, usize) = (1.5, 60);

/// The pictures, and what is known of places in them.
pub trait Footage: Sync {
    /// The picture at a position of the timeline.
    ///
    /// # Errors
    /// [`vice_core::error::DataError`] if it cannot be decoded: the frame is left out, and counted.
    fn picture(&self, position: usize) -> DataResult<Image>;

    /// Whether labels may start at these places, in their order.
    ///
    /// # Errors
    /// [`vice_core::error::DataError`] if that cannot be told: no label starts in the frame then, and it is counted.
    fn ground(&self, position: usize, pixels: &[Pixel]) -> DataResult<Vec<Ground>>;
}

/// What a person placed of a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Given {
    /// Places, ascending by position; one a position.
    pub places: Vec<GivenPlace>,
    /// There are further places behind the timeline that belong to the last segment: nothing may start between.
    pub continues: bool,
}

/// One place that a person, or another tool, has said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenPlace {
    /// Position in the timeline.
    pub position: usize,
    /// Where.
    pub px: Pixel,
    /// It starts a segment.
    pub keyframe: bool,
    /// The point is hidden there: nothing is followed from it.
    pub occluded: bool,
}

/// What is asked for.
#[derive(Clone, Copy)]
pub struct AutoOptions<'a> {
    /// Points at any time, those that were given among them.
    pub points: usize,
    /// What a person placed: kept as it is, and gone on from.
    pub given: &'a [Given],
    /// Called with frames done and in all.
    pub progress: &'a (dyn Fn(usize, usize) + Sync),
}

/// A label.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AutoLabel {
    /// Position in the timeline.
    pub position: usize,
    /// Where the point is.
    pub px: Pixel,
    /// How sure that is, 0 to 1.
    pub confidence: f64,
    /// It starts a segment.
    pub keyframe: bool,
}

/// What was followed, and what became of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AutoReport {
    /// Positions of frames that could not be decoded, with the reason.
    pub undecoded: Vec<(usize, String)>,
    /// Positions where nothing could be said of the ground, with the reason.
    pub groundless: Vec<(usize, String)>,
    /// Points that were followed.
    pub followed: usize,
    /// Of those, how many ended so.
    pub ends: Ends,
    /// Pairs of frames in which the points were held against each other.
    pub pairs: usize,
    /// Pairs with too few points in common to do so.
    pub pairs_unchecked: usize,
    /// Share of points that follow one motion: the median over the pairs, and the least.
    pub agreement: Option<[f64; 2]>,
    /// Labels that could be made: points times labelled frames.
    pub possible: usize,
    /// Labels that are there, of the possible ones, those that were given among them.
    pub made: usize,
    /// Segments that the labels start.
    pub segments: usize,
}

/// How followed points ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ends {
    /// They left the image.
    pub left: usize,
    /// They were not found again.
    pub lost: usize,
    /// They were found, but looked too different.
    pub doubtful: usize,
    /// The way back did not lead where they came from.
    pub no_way_back: usize,
    /// They did not move as the others do: cuts, of which one point can have several.
    pub apart: usize,
}

/// The labels of each point, those that were given first, and how they came about.
#[derive(Clone, Debug, PartialEq)]
pub struct Auto {
    /// New labels by point: for each given one, then the others. What was given is not repeated.
    pub points: Vec<Vec<AutoLabel>>,
    /// How it went.
    pub report: AutoReport,
}

/// Follows points through the frames of a timeline and makes labels of them.
///
/// Frames are decoded and points followed on all threads, a few frames in memory at a time; the result does not depend on
/// the number of threads.
///
/// # Errors
/// [`vice_core::error::DataError`] if no frame can be decoded.
pub fn auto_labels(
    footage: &dyn Footage,
    camera: &Camera,
    timeline: &Timeline,
    options: &AutoOptions<'_>,
) -> DataResult<Auto> {
    let wanted = options.points.max(options.given.len());
    let pool = ((POOL.0 * wanted as f64).ceil() as usize).max(POOL.1);
    let backward = fill::starts(options.given, timeline, true);
    let ways = 1 + usize::from(!backward.is_empty());
    let total = ways * timeline.len();
    let sweep = |starts: &[Start], pool, backward, before| {
        let progress = |done: usize| (options.progress)(before + done, total);
        Sweep { footage, timeline, pool, backward, progress: &progress }.run(starts)
    };
    let forward = fill::starts(options.given, timeline, false);
    let mut swept = sweep(&forward, pool, false, 0)?;
    let mut report = AutoReport::default();
    let checked = agree::check(&swept.paths, camera, timeline);
    report.agreement = checked.agreement();
    (report.pairs, report.pairs_unchecked) = (checked.pairs, checked.unchecked);
    let mut pieces = agree::pieces(&swept.paths, &checked, timeline, &mut report.ends.apart);
    let first_back = swept.paths.len();
    if !backward.is_empty() {
        let back = sweep(&backward, 0, true, timeline.len())?;
        // Too few points go backwards to be held against each other: what they say of a frame is held against what was
        // followed forwards, where it was.
        swept.paths.extend(back.paths.into_iter().map(|p| p.turned(timeline.len())));
        pieces.extend(agree::whole(&swept.paths[first_back..], first_back));
    }
    report.followed = swept.paths.len();
    count_ends(&swept.paths, &mut report.ends);
    (report.undecoded, report.groundless) = (swept.undecoded, swept.groundless);
    let filled = fill::fill(options.given, &swept.paths, &pieces, timeline);
    let points = lanes::assemble(wanted, options.given, filled, &swept.paths, &pieces, timeline);
    report.possible = wanted * timeline.chosen_count();
    report.made = points.iter().map(Vec::len).sum::<usize>() + fill::given_count(options.given, timeline);
    let starts = |labels: &Vec<AutoLabel>| labels.iter().filter(|l| l.keyframe).count();
    report.segments = points.iter().map(starts).sum();
    Ok(Auto { points, report })
}

fn count_ends(paths: &[Path], ends: &mut Ends) {
    for path in paths {
        match path.end {
            End::Open => {}
            End::Left => ends.left += 1,
            End::Lost => ends.lost += 1,
            End::Doubtful => ends.doubtful += 1,
            End::NoWayBack => ends.no_way_back += 1,
        }
    }
}

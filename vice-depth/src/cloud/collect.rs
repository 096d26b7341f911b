//! Gathers the points of a scan within a limit of memory, thinned on the way if asked for.

use rayon::prelude::*;
use vice_core::error::{DataError, DataResult};

use super::memory::shown;
use super::{BYTES_PER_POINT, CloudOptions, ScanPoints, memory};
use crate::ply::PointSink;

/// Smallest cube that thinning may use, metres.
const MIN_VOXEL_M: f64 = 1e-6;

/// Points that a buffer holds at least, so that small scans do not grow it again and again.
const MIN_CAPACITY: usize = 1 << 16;

/// Points on their way into a cloud.
pub(super) struct Collector {
    points: Vec<[f32; 3]>,
    /// Added to each point: coordinates in the millions do not fit single precision.
    origin_m: [f64; 3],
    /// Points offered so far.
    offered: u64,
    /// Of these, how many were not finite.
    left_out: u64,
    /// Position in the file of the first of those.
    first_left_out: Option<u64>,
    promised: u64,
    max_bytes: u64,
    voxel_m: Option<f64>,
}

impl Collector {
    pub(super) fn new(options: &CloudOptions) -> DataResult<Self> {
        if let Some(edge) = options.voxel_m
            && !(edge.is_finite() && edge >= MIN_VOXEL_M)
        {
            return Err(DataError::new(format!("a voxel of {edge} m cannot thin a cloud"))
                .hint("give its edge in metres, such as 0.01"));
        }
        Ok(Self {
            points: Vec::new(),
            origin_m: [0.0; 3],
            offered: 0,
            left_out: 0,
            first_left_out: None,
            promised: 0,
            max_bytes: options.max_bytes.unwrap_or_else(memory::available_bytes),
            voxel_m: options.voxel_m,
        })
    }

    /// What has been gathered, thinned to the end.
    pub(super) fn finish(mut self, name: &str) -> DataResult<ScanPoints> {
        let Self { offered, left_out, origin_m, .. } = self;
        if let Some(edge) = self.voxel_m {
            thin(&mut self.points, edge);
        }
        self.points.shrink_to_fit();
        if self.points.is_empty() {
            let problem = match offered {
                0 => "there are no points".to_string(),
                _ => format!("none of the {offered} points is finite"),
            };
            return Err(DataError::new(problem));
        }
        if let Some(first) = self.first_left_out {
            tracing::warn!(
                "{name}: {left_out} of {offered} points are not finite and were left out (the first is point {first})"
            );
        }
        Ok(ScanPoints { origin_m, points: self.points })
    }

    fn leave_out(&mut self) {
        self.first_left_out.get_or_insert(self.offered - 1);
        self.left_out += 1;
    }

    fn add(&mut self, point: [f32; 3]) -> DataResult<()> {
        if self.points.len() == self.points.capacity() {
            self.make_room()?;
        }
        self.points.push(point);
        Ok(())
    }

    /// Thins, and where that gives less than a third of the buffer back, grows it: by half while thinning, so that
    /// sorting pays, else by an eighth.
    #[cold]
    fn make_room(&mut self) -> DataResult<()> {
        let fits = usize::try_from(self.max_bytes / BYTES_PER_POINT).unwrap_or(usize::MAX);
        let capacity = self.points.capacity();
        let (grown, least) = match self.voxel_m {
            Some(edge) => {
                thin(&mut self.points, edge);
                let kept = self.points.len();
                if capacity > 0 && kept <= capacity / 3 * 2 {
                    return Ok(());
                }
                (kept + kept / 2, kept + kept / 16 + 1)
            }
            None => (capacity + capacity / 8, capacity + 1),
        };
        if fits < least {
            return Err(self.too_large(self.promised.max(self.offered)));
        }
        let grown = grown.max(MIN_CAPACITY).min(fits);
        self.points.reserve_exact(grown - self.points.len());
        Ok(())
    }

    fn too_large(&self, points: u64) -> DataError {
        let needed = points.saturating_mul(BYTES_PER_POINT);
        let hint = match self.voxel_m {
            Some(edge) => format!("thin it more than with voxels of {edge} m"),
            None => "thin it with `cloud-voxel` 0.01, or larger".to_string(),
        };
        DataError::new(format!(
            "a scan of {points} points takes {}, and {} may be used",
            shown(needed),
            shown(self.max_bytes)
        ))
        .hint(hint)
    }
}

impl PointSink for Collector {
    fn expect(&mut self, promised: u64, at_most: Option<u64>) -> DataResult<()> {
        self.promised = promised;
        // Nothing is reserved for a promise that the file's length does not back.
        let Some(backed) = at_most.map(|rows| rows.min(promised)) else { return Ok(()) };
        if self.voxel_m.is_some() {
            return Ok(());
        }
        if backed.saturating_mul(BYTES_PER_POINT) > self.max_bytes {
            return Err(self.too_large(backed));
        }
        self.points.try_reserve_exact(backed as usize).map_err(|e| self.too_large(backed).because(e))
    }

    fn single(&mut self, point: [f32; 3]) -> DataResult<()> {
        self.offered += 1;
        // A sum is finite only where all its terms are, save for an overflow that no scan comes near.
        if !(point[0] + point[1] + point[2]).is_finite() {
            self.leave_out();
            return Ok(());
        }
        self.add(point)
    }

    fn singles(&mut self, mut points: impl ExactSizeIterator<Item = [f32; 3]> + Clone) -> DataResult<()> {
        let (start, count) = (self.points.len(), points.len());
        if self.points.capacity() - start >= count {
            self.points.extend(points.clone());
            let added = self.points[start..].as_flattened();
            if !added.iter().fold(false, |any, v| any | !v.is_finite()) {
                self.offered += count as u64;
                return Ok(());
            }
            self.points.truncate(start);
        }
        points.try_for_each(|point| self.single(point))
    }

    fn double(&mut self, point: [f64; 3]) -> DataResult<()> {
        if self.points.is_empty() && point.iter().all(|v| v.is_finite()) {
            self.origin_m = point.map(f64::round);
        }
        let origin = self.origin_m;
        self.single(std::array::from_fn(|i| (point[i] - origin[i]) as f32))
    }
}

/// Keeps one point of each cube of space: the one nearest to its centre, whatever order they came in.
fn thin(points: &mut Vec<[f32; 3]>, edge_m: f64) {
    let cell = |p: &[f32; 3]| p.map(|v| (f64::from(v) / edge_m).floor());
    let off_centre = |p: &[f32; 3], c: &[f64; 3]| -> f64 {
        (0..3).map(|i| f64::from(p[i]) / edge_m - c[i] - 0.5).map(|d| d * d).sum()
    };
    points.par_sort_unstable_by(|a, b| {
        let (ca, cb) = (cell(a), cell(b));
        let by_cell = ca[0].total_cmp(&cb[0]).then(ca[1].total_cmp(&cb[1])).then(ca[2].total_cmp(&cb[2]));
        by_cell
            .then_with(|| off_centre(a, &ca).total_cmp(&off_centre(b, &cb)))
            .then_with(|| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2])))
    });
    points.dedup_by(|b, a| cell(a) == cell(b));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options(voxel_m: Option<f64>, max_bytes: u64) -> CloudOptions {
        CloudOptions { voxel_m, max_bytes: Some(max_bytes) }
    }

    #[test]
    fn one_point_a_voxel_whatever_the_order() {
        let grid = |i: u64| [i % 100, i / 100 % 100, i / 10_000].map(|v| v as f32 * 0.001 + 0.0005);
        let collect = |order: &dyn Fn(u64) -> u64| {
            // Room for a third of the points: thinning has to happen on the way.
            let mut collector = Collector::new(&options(Some(0.01), 330_000 * BYTES_PER_POINT)).unwrap();
            for i in 0..1_000_000 {
                collector.single(grid(order(i))).unwrap();
            }
            assert_eq!(collector.offered, 1_000_000);
            collector.finish("test").unwrap().points
        };
        let forward = collect(&|i| i);
        assert_eq!(forward.len(), 1000);
        assert!(collect(&|i| (i * 7919) % 1_000_000) == forward);
        assert!(Collector::new(&options(Some(0.0), 1)).is_err());
        assert!(Collector::new(&options(Some(f64::NAN), 1)).is_err());
    }

    #[test]
    fn a_scan_that_does_not_fit_is_refused_with_the_numbers() {
        let mut collector = Collector::new(&options(None, 1_000_000)).unwrap();
        let error = collector.expect(50_000_000, Some(50_000_000)).unwrap_err().to_string();
        assert!(error.starts_with("a scan of 50000000 points takes 7"), "{error}");
        assert!(error.contains("1.0 MB may be used") && error.contains("`cloud-voxel`"), "{error}");
        // A text file's promise is not backed by its length: the points themselves must not run over the limit.
        let mut collector = Collector::new(&options(None, 1_000_000)).unwrap();
        collector.expect(u64::MAX, None).unwrap();
        let stored = (0..).take_while(|i| collector.single([*i as f32; 3]).is_ok()).count() as u64;
        assert_eq!(stored, 1_000_000 / BYTES_PER_POINT);
        assert_eq!(collector.points.capacity() as u64, stored);
    }

    #[test]
    fn blocks_of_points_are_stored_as_single_ones_are() {
        let block = |bad: usize| {
            (0..100_000_usize).map(move |i| if i == bad { [1.0, f32::INFINITY, 2.0] } else { [i as f32; 3] })
        };
        let (mut blocks, mut singles) =
            [(); 2].map(|()| Collector::new(&options(None, 100_000_000)).unwrap()).into();
        blocks.expect(250_000, Some(250_000)).unwrap();
        for bad in [usize::MAX, 99_999, 7] {
            blocks.singles(block(bad)).unwrap();
            block(bad).for_each(|p| singles.single(p).unwrap());
        }
        assert!(blocks.points == singles.points && blocks.points.len() == 299_998);
        let counts = |c: &Collector| (c.offered, c.left_out, c.first_left_out);
        assert_eq!(
            (counts(&blocks), counts(&singles)),
            ((300_000, 2, Some(199_999)), (300_000, 2, Some(199_999)))
        );
    }

    #[test]
    fn what_is_not_finite_is_counted() {
        let mut collector = Collector::new(&options(None, 1_000_000)).unwrap();
        collector.double([1e6, 2e6, 30.0]).unwrap();
        collector.double([1e6 + 0.125, f64::NAN, 30.0]).unwrap();
        collector.double([1e6 + 0.125, 2e6, f64::MAX]).unwrap();
        collector.double([1e6 + 0.125, 2e6, 30.0]).unwrap();
        assert_eq!((collector.left_out, collector.first_left_out), (2, Some(1)));
        assert_eq!((collector.origin_m, &collector.points[1]), ([1e6, 2e6, 30.0], &[0.125, 0.0, 0.0]));
    }
}

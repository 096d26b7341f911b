//! A scan of the scene in memory, indexed.
//!
//! Points are kept in single precision, as scanners store them; a scan in double precision is kept relative to its
//! first point, so that coordinates in the millions lose nothing that matters. They are indexed once, when they are
//! loaded, by putting them in order where they are.
//!
//! Memory: 12 bytes a point and a tenth of that for the index, and never more than 1.5 times the coordinates kept,
//! reading and thinning included.

mod collect;
mod memory;
mod tree;

use std::path::Path;
use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use vice_core::dataset::{CloudRef, CloudSource};
use vice_core::error::{DataError, DataResult};
use vice_core::suspicion::{Suspicion, Suspicions};

use crate::ply::PointSink;
use crate::scan_file;
use collect::Collector;
use tree::Tree;
pub(crate) use tree::{Bounds, Leaf, Overlap, Patch};

/// Bytes a point takes, its share of the index included.
const BYTES_PER_POINT: u64 = 15;

/// A scene that is wider than this is suspected to be in millimetres.
const SUSPICIOUS_EXTENT_M: f32 = 1000.0;

/// How a scan is read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CloudOptions {
    /// Keep at most one point in each cube of this edge, metres: the one nearest to its centre.
    pub voxel_m: Option<f64>,
    /// Most memory that the points and their index may take, bytes; by default 80 % of what the machine has free.
    pub max_bytes: Option<u64>,
}

/// Points of a scan before they are indexed, in the order of the file, at least one.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanPoints {
    /// Added to each point, metres; zero for a file in single precision.
    pub origin_m: [f64; 3],
    /// Metres, all finite.
    pub points: Vec<[f32; 3]>,
    /// What was left out, and what looks wrong.
    pub suspicions: Suspicions,
}

/// Reads the points of a PLY, PCD, LAS or LAZ file: text, binary or compressed, any order and type of properties. Faces are
/// not looked at. LAS and LAZ take the feature `las`.
///
/// Points that are not finite are left out, which a suspicion says.
///
/// # Errors
/// [`DataError`] with the byte or line if the file cannot be used, ends too early, has no finite point, or does not
/// fit in memory.
pub fn read_scan_points(path: impl AsRef<Path>, options: &CloudOptions) -> DataResult<ScanPoints> {
    let path = path.as_ref();
    let mut collector = Collector::new(options)?;
    scan_file::read_points(path, &mut collector)?;
    collector.finish(&path.display().to_string()).map_err(|e| e.at(path))
}

/// The points of a scan, metres, in the frame of the scan.
///
/// What looks wrong is in [`Cloud::suspicions`], and logged: a cloud that is kilometres wide may be in millimetres, and
/// coordinates of a map do not fit single precision.
#[derive(Clone, Debug)]
pub struct Cloud {
    points: Vec<[f32; 3]>,
    origin_m: Vector3<f64>,
    tree: Tree,
    suspicions: Suspicions,
}

impl Cloud {
    /// Reads a file, as [`read_scan_points`] does, and indexes it.
    ///
    /// # Errors
    /// As [`read_scan_points`].
    pub fn read(path: impl AsRef<Path>, options: &CloudOptions) -> DataResult<Self> {
        let path = path.as_ref();
        Ok(Self::indexed(read_scan_points(path, options)?, &path.display().to_string()))
    }

    /// A scan from points in memory, metres.
    ///
    /// # Errors
    /// [`DataError`] if there is no point that is finite, or they do not fit in memory a second time.
    pub fn from_points(
        points: impl IntoIterator<Item = Point3<f32>>,
        options: &CloudOptions,
    ) -> DataResult<Self> {
        let mut collector = Collector::new(options)?;
        let points = points.into_iter();
        let least = points.size_hint().0 as u64;
        collector.expect(least, Some(least))?;
        for p in points {
            collector.single([p.x, p.y, p.z])?;
        }
        Ok(Self::indexed(collector.finish("the cloud")?, "the cloud"))
    }

    fn indexed(points: ScanPoints, name: &str) -> Self {
        let ScanPoints { origin_m, mut points, mut suspicions } = points;
        let tree = Tree::build(&mut points);
        let extent = tree.bounds().size().into_iter().fold(0.0, f32::max);
        if extent > SUSPICIOUS_EXTENT_M {
            suspicions.add(
                Suspicion::new("cloud-extent", name, format!("the points are spread over {extent:.0} m"))
                    .advice("is the scan in millimetres?"),
            );
        }
        Self { points, origin_m: origin_m.into(), tree, suspicions }
    }

    /// What was left out of the scan, and what looks wrong with it.
    pub const fn suspicions(&self) -> &Suspicions {
        &self.suspicions
    }

    /// Number of points, at least 1.
    #[expect(clippy::len_without_is_empty, reason = "a cloud is never empty")]
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// The points, metres, in the order of the index.
    pub fn points(&self) -> impl ExactSizeIterator<Item = Point3<f64>> + '_ {
        self.points.iter().map(|p| self.in_scan(p))
    }

    /// Corners of the box around all points, metres.
    pub fn bounds_m(&self) -> [Point3<f64>; 2] {
        let bounds = self.tree.bounds();
        [self.in_scan(&bounds.low), self.in_scan(&bounds.high)]
    }

    /// Bytes that the points and their index take.
    pub fn bytes(&self) -> usize {
        self.points.capacity() * size_of::<[f32; 3]>() + self.tree.bytes()
    }

    /// What is added to [`Cloud::stored`] points, metres.
    pub(crate) const fn origin_m(&self) -> Vector3<f64> {
        self.origin_m
    }

    /// Points of a leaf as they are stored: relative to [`Cloud::origin_m`].
    pub(crate) fn stored(&self, leaf: &Leaf) -> &[[f32; 3]] {
        &self.points[leaf.start..leaf.end]
    }

    /// Patch of a leaf.
    pub(crate) fn patch(&self, leaf: u32) -> &Patch {
        self.tree.patch(leaf)
    }

    /// Box of a leaf, relative to [`Cloud::origin_m`].
    pub(crate) fn bounds_of(&self, leaf: &Leaf) -> &Bounds {
        self.tree.bounds_of(leaf)
    }

    /// Leaves whose boxes (relative to [`Cloud::origin_m`]) are not outside.
    pub(crate) fn leaves(&self, overlap: impl Fn(&Bounds) -> Overlap) -> Vec<Leaf> {
        self.tree.leaves(overlap)
    }

    fn in_scan(&self, p: &[f32; 3]) -> Point3<f64> {
        Point3::from(Point3::from(*p).cast::<f64>().coords + self.origin_m)
    }
}

/// Reads or copies the points that a data set refers to.
///
/// # Errors
/// As [`Cloud::read`] and [`Cloud::from_points`].
pub fn load_cloud(cloud: &CloudRef, options: &CloudOptions) -> DataResult<Arc<Cloud>> {
    let cloud = match &cloud.source {
        CloudSource::File(path) => Cloud::read(path, options)?,
        CloudSource::Points(points) => Cloud::from_points(points.iter().copied(), options)?,
        _ => return Err(DataError::new("a cloud of this kind cannot be read")),
    };
    Ok(Arc::new(cloud))
}

//! `sensor_msgs/PointCloud2`: the sweeps of a scanner, put together in the world as a scan of the scene.
//!
//! Each sweep is placed by the pose of a stream at its stamp and by tf; one that is in the world's frame already is taken
//! as it is. The points of a sweep are taken as seen at once: a scanner that turns while the robot moves bends them.

use nalgebra::{Point3, Vector3};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::frames::{BodyFromCamera, WorldFromCamera};
use vice_core::suspicion::Suspicion;
use vice_core::time::Span;
use vice_core::trajectory::Trajectory;

use crate::container::{Message, Recording, Topic};
use crate::doubts::{Doubts, LEFT_OUT};
use crate::index::Only;
use crate::settings::Stamps;
use crate::tf::TfTree;
use crate::wire::{Header, Reader, WireError, WireResult};

/// The type of their messages.
pub(crate) const KIND: &str = "sensor_msgs/PointCloud2";

/// Points that are kept at most: of a longer recording every so many sweeps are taken.
const MOST_POINTS: u64 = 20_000_000;
/// Widest gap between two poses that is interpolated.
const MAX_GAP: Span = Span::from_millis(200);

/// What places the sweeps in the world.
pub(crate) struct Placed<'a> {
    pub(crate) trajectory: &'a Trajectory,
    /// Name of its stream.
    pub(crate) stream: &'a str,
    /// The frame whose sweeps are in the world as they are.
    pub(crate) world: Option<&'a str>,
    pub(crate) tf: &'a TfTree,
    pub(crate) base: &'a str,
    pub(crate) stamps: Stamps,
}

/// A coordinate's place in a point.
#[derive(Clone, Copy)]
struct Field {
    offset: usize,
    double: bool,
}

/// The points of a message, before they are read.
struct Sweep<'a> {
    header: Header<'a>,
    axes: [Field; 3],
    big_endian: bool,
    count: usize,
    width: usize,
    point_step: usize,
    row_step: usize,
    data: &'a [u8],
}

fn sweep<'a>(r: &mut Reader<'a>) -> WireResult<Sweep<'a>> {
    let header = r.header()?;
    let (height, width) = (r.u32()? as usize, r.u32()? as usize);
    let mut axes = [None; 3];
    let mut names = Vec::new();
    for _ in 0..r.count(13)? {
        let (name, offset, kind) = (r.str()?, r.u32()? as usize, r.u8()?);
        r.u32()?;
        names.push(name);
        let Some(axis) = ["x", "y", "z"].iter().position(|axis| *axis == name) else { continue };
        let double = match kind {
            7 => false,
            8 => true,
            other => {
                return Err(WireError(format!("the field {name} has the datatype {other}, not a float")));
            }
        };
        axes[axis] = Some(Field { offset, double });
    }
    let [Some(x), Some(y), Some(z)] = axes else {
        return Err(WireError(format!(
            "the points have no fields x, y and z; they have {}",
            names.join(", ")
        )));
    };
    let big_endian = r.u8()? != 0;
    let (point_step, row_step) = (r.u32()? as usize, r.u32()? as usize);
    let data = r.bytes()?;
    let axes = [x, y, z];
    let ends = axes.iter().map(|f| f.offset.saturating_add(if f.double { 8 } else { 4 })).max().unwrap_or(0);
    let count = height.saturating_mul(width);
    let fits = ends <= point_step
        && width.saturating_mul(point_step) <= row_step
        && height.saturating_mul(row_step) <= data.len();
    if count > 0 && !fits {
        return Err(WireError(format!(
            "{height} rows of {width} points of {point_step} bytes do not fit in {} bytes",
            data.len()
        )));
    }
    Ok(Sweep { header, axes, big_endian, count, width, point_step, row_step, data })
}

impl Sweep<'_> {
    fn point(&self, i: usize) -> Point3<f64> {
        let (row, column) = (i / self.width, i % self.width);
        let start = row * self.row_step + column * self.point_step;
        let value = |field: &Field| {
            let at = start + field.offset;
            let mut bytes = [0_u8; 8];
            let n = if field.double { 8 } else { 4 };
            bytes[..n].copy_from_slice(&self.data[at..at + n]);
            if self.big_endian {
                bytes[..n].reverse();
            }
            let bits = u64::from_le_bytes(bytes);
            if field.double { f64::from_bits(bits) } else { f64::from(f32::from_bits(bits as u32)) }
        };
        Point3::new(value(&self.axes[0]), value(&self.axes[1]), value(&self.axes[2]))
    }
}

/// A scan in the world, metres: its points are relative to an origin, so that a map's coordinates fit single precision.
#[derive(Debug)]
pub(crate) struct Scan {
    pub(crate) origin_m: Vector3<f64>,
    pub(crate) points: Vec<Point3<f32>>,
}

/// The points of a topic in the world.
///
/// # Errors
/// [`DataError`] if a message cannot be decoded, tf does not place its frame in the body, or no sweep has a pose.
pub(crate) fn read(
    recording: &Recording,
    topic: &Topic,
    placed: &Placed<'_>,
    doubts: &Doubts,
) -> DataResult<Scan> {
    let mut points: Vec<Point3<f32>> = Vec::new();
    let mut origin_m: Option<Vector3<f64>> = None;
    let mut problem: Option<DataError> = None;
    let (mut seen, mut every, mut taken) = (0_u64, 1_u64, 0_u64);
    let (mut unplaced, mut not_finite) = (0_u64, 0_u64);
    let mut pass = Only {
        wanted: |info: &Topic| info.name == topic.name && info.kind == KIND,
        each: |message: &Message<'_>| {
            if problem.is_some() {
                return;
            }
            let reader = Reader::new(message.bytes, message.encoding);
            let found = reader.and_then(|mut r| sweep(&mut r)).map_err(|e| DataError::new(e.to_string()));
            let read = found.and_then(|sweep| {
                if seen == 0 {
                    every = (sweep.count as u64).saturating_mul(topic.count).div_ceil(MOST_POINTS).max(1);
                }
                seen += 1;
                if (seen - 1) % every != 0 {
                    return Ok(());
                }
                let Some(world_from_sensor) = place(&sweep, placed, message)? else {
                    unplaced += 1;
                    return Ok(());
                };
                taken += 1;
                for i in 0..sweep.count {
                    let own = sweep.point(i);
                    match own.coords.iter().all(|v| v.is_finite()) {
                        true => {
                            let in_world = world_from_sensor.transform_point(&own);
                            let origin_m = origin_m.get_or_insert_with(|| in_world.coords.map(f64::round));
                            points.push((in_world - *origin_m).cast::<f32>());
                        }
                        false => not_finite += 1,
                    }
                    if points.len() as u64 > 2 * MOST_POINTS {
                        return Err(DataError::new("the sweeps grow: too many points")
                            .hint("write them to a PCD or LAZ file, and give it with `cloud`"));
                    }
                }
                Ok(())
            });
            problem = read.err().map(|e| recording.place(&message.locator, e));
        },
    };
    recording.scan(&mut pass)?;
    if let Some(problem) = problem {
        return Err(problem);
    }
    let about = format!("topic {}", topic.name);
    if every > 1 {
        let message =
            format!("one of {every} sweeps is taken, so that no more than 20 million points are held");
        doubts.say(Suspicion::new("sweeps-thinned", about.as_str(), message));
    }
    if unplaced > 0 {
        let message = format!("{unplaced} sweeps at stamps without a pose of {} are left out", placed.stream);
        doubts.say(Suspicion::new(LEFT_OUT, about.as_str(), message).times(unplaced));
    }
    if not_finite > 0 && points.is_empty() {
        return Err(DataError::new(format!("none of {not_finite} points is finite")));
    }
    if points.is_empty() {
        return Err(DataError::of_kind(
            ErrorKind::Missing,
            format!(
                "no sweep has points and a pose of {}; {seen} were looked at, {taken} placed",
                placed.stream
            ),
        ));
    }
    Ok(Scan { origin_m: origin_m.unwrap_or_default(), points })
}

/// Where the sensor was in the world; `None` where the stream has no pose there.
fn place(
    sweep: &Sweep<'_>,
    placed: &Placed<'_>,
    message: &Message<'_>,
) -> DataResult<Option<WorldFromCamera>> {
    let frame = sweep.header.frame;
    if placed.world == Some(frame) {
        return Ok(Some(WorldFromCamera::identity()));
    }
    let stamp = if placed.stamps == Stamps::Record { message.recorded } else { sweep.header.stamp };
    let Ok(world_from_body) = placed.trajectory.pose_at(stamp, MAX_GAP) else { return Ok(None) };
    let body_from_sensor: BodyFromCamera = match frame == placed.base {
        true => BodyFromCamera::identity(),
        false => placed.tf.chain(placed.base, frame)?.at(stamp)?.reinterpret(),
    };
    Ok(Some(world_from_body * body_from_sensor))
}

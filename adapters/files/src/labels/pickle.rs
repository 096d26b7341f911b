//! The labels of the paper's authors: `{point: {frame index: (array([x, y]), is_keyframe)}}`, pickled by Python.

use vice_core::camera::Pixel;
use vice_core::error::{DataError, DataResult};
use vice_core::label::{LabelRow, LabelSet, Observation};
use vice_core::time::Stamp;

use super::labels_from;
use super::pickle_machine::unpickle;
use super::pickle_values::{Object, Unpickled, Value};

/// Reads a pickle of protocol 0 to 5, from NumPy 1 or 2. Nothing in it is executed.
///
/// `frame_stamps` are the stamps of the camera's frames, which the pickle counts from 0.
///
/// # Errors
/// [`DataError`] for a pickle that is broken or holds anything else, and for a frame that the camera does not have.
pub fn read_pickle(bytes: &[u8], frame_stamps: &[Stamp]) -> DataResult<LabelSet> {
    let unpickled = unpickle(bytes)?;
    let expected = "expected {point: {frame: (array([x, y]), is_keyframe)}}";
    let Some(Object::Dict(points)) = unpickled.object(unpickled.top) else {
        return Err(DataError::new("the pickle holds no dictionary").hint(expected));
    };
    let mut rows = Vec::new();
    for (key, frames) in points {
        let point = name_of(&unpickled, *key)
            .ok_or_else(|| DataError::new("a point is named by neither a number nor text").hint(expected))?;
        let Some(Object::Dict(frames)) = unpickled.object(*frames) else {
            return Err(DataError::new(format!("point {point} holds no dictionary of frames")).hint(expected));
        };
        for (frame, observation) in frames {
            // One dictionary may stand for many points: honest labels take more bytes than this.
            if rows.len() > bytes.len() {
                return Err(DataError::new("the pickle stands for more labels than it has bytes"));
            }
            let Value::Int(frame) = *frame else {
                return Err(DataError::new(format!("point {point}: a frame is no integer")).hint(expected));
            };
            let (px, keyframe) = observation_of(&unpickled, *observation).ok_or_else(|| {
                DataError::new(format!("point {point}, frame {frame}: no pixel with a key frame mark"))
                    .hint(expected)
            })?;
            let stamp = usize::try_from(frame).ok().and_then(|frame| frame_stamps.get(frame));
            let stamp = *stamp.ok_or_else(|| {
                DataError::new(format!(
                    "point {point}: frame {frame} is not among the camera's {} frames",
                    frame_stamps.len()
                ))
                .hint("is this the data set that was labelled?")
            })?;
            let observation = Observation { keyframe, ..Observation::manual(stamp, px) };
            rows.push(LabelRow { point: point.clone(), observation });
        }
    }
    labels_from(rows)
}

fn name_of(unpickled: &Unpickled, key: Value) -> Option<String> {
    match (key, unpickled.object(key)) {
        (Value::Int(number), _) => Some(number.to_string()),
        (_, Some(Object::Text(text))) => Some(text.clone()),
        (_, Some(Object::Bytes(bytes))) => String::from_utf8(bytes.clone()).ok(),
        _ => None,
    }
}

fn observation_of(unpickled: &Unpickled, value: Value) -> Option<(Pixel, bool)> {
    let (pixel, keyframe) = match unpickled.object(value)? {
        Object::Tuple(items) | Object::List(items) => match items[..] {
            [pixel, keyframe] => (pixel, keyframe),
            _ => return None,
        },
        _ => return None,
    };
    let keyframe = match keyframe {
        Value::Bool(keyframe) => keyframe,
        Value::Int(keyframe) => keyframe != 0,
        _ => return None,
    };
    let [u, v] = match unpickled.object(pixel)? {
        Object::Tuple(items) | Object::List(items) => match items[..] {
            [u, v] => [number(u)?, number(v)?],
            _ => return None,
        },
        _ => {
            let (dtype, data) = unpickled.array(pixel)?;
            if data.len() != 2 * dtype.size() {
                return None;
            }
            [dtype.float(data, 0)?, dtype.float(data, 1)?]
        }
    };
    Some((Pixel::new(u, v), keyframe))
}

fn number(value: Value) -> Option<f64> {
    match value {
        Value::Int(number) => Some(number as f64),
        Value::Float(number) => Some(number),
        _ => None,
    }
}

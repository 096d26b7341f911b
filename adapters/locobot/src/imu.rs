//! Inertial samples in the body frame.

use std::sync::Arc;

use nalgebra::Vector3;
use vice_core::error::{DataError, DataResult};
use vice_core::imu::ImuSample;
use vice_core::suspicion::Suspicion;

use crate::container::{Message, Recording, Topic};
use crate::doubts::{Doubts, LEFT_OUT, REPEATED, TWO_SOURCES};
use crate::index::Only;
use crate::message::imu;
use crate::settings::Stamps;
use crate::tf::{CLOCK_JUMP, TfTree, Transform};
use crate::to_and_fro;
use crate::wire::Reader;

/// Accelerations that differ by less are those of one sensor that shakes.
const SMALLEST_JUMP_M_S2: f64 = 3.0;

/// Reads the samples of a topic and turns them into the body frame by tf.
///
/// The lever arm is left out: it would need angular accelerations, which differences of noisy rates are not.
///
/// # Errors
/// [`DataError`] if samples cannot be decoded, the clock jumps back, or tf does not connect the sensor to the body.
pub(crate) fn read(
    recording: &Recording,
    topic: &str,
    stamps: Stamps,
    tf: &TfTree,
    base: &str,
    doubts: &Doubts,
) -> DataResult<Arc<[ImuSample]>> {
    let mut samples: Vec<ImuSample> = Vec::new();
    let mut frame = String::new();
    let mut problem: Option<DataError> = None;
    let mut unstamped = 0_u64;
    let mut pass = Only {
        wanted: |info: &Topic| info.name == topic && info.kind == "sensor_msgs/Imu",
        each: |message: &Message<'_>| {
            if problem.is_some() {
                return;
            }
            match sample(message, stamps, &mut frame) {
                Ok(sample) if sample.stamp.as_nanos() == 0 => unstamped += 1,
                Ok(sample) => match samples.last() {
                    Some(last) if last.stamp.since(sample.stamp) >= CLOCK_JUMP => {
                        let text =
                            format!("the clock jumps back from {} ns to {} ns", last.stamp, sample.stamp);
                        problem = Some(recording.place(&message.locator, DataError::new(text)));
                    }
                    _ => samples.push(sample),
                },
                Err(text) => problem = Some(recording.place(&message.locator, DataError::new(text))),
            }
        },
    };
    recording.scan(&mut pass)?;
    if let Some(problem) = problem {
        return Err(problem);
    }
    samples.sort_by_key(|s| s.stamp);
    let n = samples.len();
    let about = format!("topic {topic}");
    let apart_m_s2 = |a: usize, b: usize| (samples[a].accel_m_s2 - samples[b].accel_m_s2).norm();
    if let Some(found) = to_and_fro::find(n, SMALLEST_JUMP_M_S2, apart_m_s2) {
        let message = "the accelerations jump to and fro, as where two sensors publish them";
        doubts.say(
            Suspicion::new(TWO_SOURCES, about.as_str(), message)
                .evidence(format!("{} jumps of about {:.1} m/s² that come back", found.times, found.middle))
                .advice("set imu_topic to a topic of one sensor"),
        );
    }
    if unstamped > 0 {
        let message = format!("{unstamped} samples with a zero stamp are left out");
        doubts.say(Suspicion::new(LEFT_OUT, about.as_str(), message).times(unstamped));
        if samples.is_empty() {
            return Err(DataError::new(format!("all {unstamped} stamps are zero"))
                .hint("`set` stamps=record takes the time of recording"));
        }
    }
    samples.dedup_by_key(|s| s.stamp);
    if samples.len() < n {
        let again = (n - samples.len()) as u64;
        let message = format!("{again} samples repeat a stamp: the first of each is kept");
        doubts.say(Suspicion::new(REPEATED, about.as_str(), message).times(again));
    }
    if !frame.is_empty() && frame != base {
        let chain = tf.chain(base, &frame)?;
        let fixed =
            if chain.is_fixed() { samples.first().map(|s| chain.at(s.stamp)).transpose()? } else { None };
        for sample in &mut samples {
            let body_from_sensor: Transform = match fixed {
                Some(fixed) => fixed,
                None => chain.at(sample.stamp)?,
            };
            sample.gyro_rad_s = body_from_sensor.rotate(&sample.gyro_rad_s);
            sample.accel_m_s2 = body_from_sensor.rotate(&sample.accel_m_s2);
        }
    }
    Ok(Arc::from(samples))
}

fn sample(message: &Message<'_>, stamps: Stamps, frame: &mut String) -> Result<ImuSample, String> {
    let mut reader = Reader::new(message.bytes, message.encoding).map_err(|e| e.to_string())?;
    let imu = imu(&mut reader).map_err(|e| e.to_string())?;
    let (Some(gyro), Some(accel)) = (imu.gyro, imu.accel) else {
        return Err("the samples lack rates or accelerations".to_string());
    };
    if !gyro.iter().chain(&accel).all(|v| v.is_finite()) {
        return Err("a sample is not finite".to_string());
    }
    if frame.is_empty() {
        *frame = imu.header.frame.to_string();
    } else if frame != imu.header.frame {
        return Err(format!("the samples are in two frames, {frame} and {}", imu.header.frame));
    }
    let stamp = if stamps == Stamps::Record { message.recorded } else { imu.header.stamp };
    let (gyro_rad_s, accel_m_s2) = (Vector3::from(gyro), Vector3::from(accel));
    Ok(ImuSample { stamp, gyro_rad_s, accel_m_s2 })
}

//! Depth images of a frame from each source, as numbers and as pictures.

use vice_core::dataset::DepthImage;
use vice_core::depth::DepthMiss;
use vice_core::statistics::{median, quantile, sorted};
use vice_core::suspicion::Suspicions;
use vice_depth::{DepthMap, depth_image};
use vice_files::image_file::{encode_depth_png, encode_png};

use crate::error::{RunError, RunResult};
use crate::progress::Progress;
use crate::report::depth_picture::{common_range, depth_picture, difference_picture};
use crate::report::{npy, table};
use crate::request::DepthSpec;
use crate::scene::Scene;

/// Files by name, and what they hold in words.
pub struct DepthImages {
    /// Names and bytes of the files.
    pub files: Vec<(String, Vec<u8>)>,
    /// The table.
    pub text: String,
    /// What looks wrong in the data.
    pub suspicions: Suspicions,
}

/// Asks each source for each pixel of a frame.
///
/// # Errors
/// [`RunError`] if a source answers no pixel at all, or something cannot be read.
pub fn depth_images(
    scene: &Scene,
    depth: &DepthSpec,
    at: &str,
    progress: &Progress<'_>,
) -> RunResult<DepthImages> {
    depth.check_of_frames()?;
    let opened = &scene.opened;
    let frame = scene.frame_at(at)?;
    let keyframe = scene.keyframe(frame)?;
    let sources = depth.make_all(opened)?;
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    let mut grid = vec![["source", "answered", "median m", "not answered"].map(String::from).to_vec()];
    let mut maps: Vec<(String, DepthMap)> = Vec::new();
    let mut images: Vec<(String, DepthImage)> = Vec::new();
    for (done, source) in sources.iter().enumerate() {
        progress("depth", done, sources.len());
        let map = depth_image(source.as_ref(), &keyframe)?;
        if map.answered() == 0 {
            // One reason for every pixel is a reason to fail, not a picture.
            let reason = map.misses().first().map_or(DepthMiss::NoDepth, |(miss, _)| *miss);
            return Err(RunError::missing(format!(
                "{} gives no depth at {} ns: {reason}",
                source.name(),
                keyframe.stamp
            )));
        }
        let image = map.to_image(&keyframe)?;
        grid.push(summary(source.name(), &map));
        files.push((format!("{}.png", source.name()), millimetres(source.name(), &image)?));
        files.push((
            format!("{}.npy", source.name()),
            npy::encode_f32(image.height(), image.width(), image.z_m()),
        ));
        maps.push((source.name().to_string(), map));
        images.push((source.name().to_string(), image));
    }
    progress("depth", sources.len(), sources.len());
    let range_m = common_range(&images.iter().map(|(_, image)| image).collect::<Vec<_>>());
    for (name, image) in &images {
        files.push((format!("{name}_picture.png"), encode_png(&depth_picture(image, range_m)?)?));
    }
    let mut text = table::align(&grid);
    for (i, (first, a)) in maps.iter().enumerate() {
        for (second, b) in &maps[i + 1..] {
            let difference: Vec<f32> = a.z_m().iter().zip(b.z_m()).map(|(x, y)| (x - y) as f32).collect();
            let picture = difference_picture(a.width(), a.height(), &difference)?;
            files.push((format!("{first}_minus_{second}.png"), encode_png(&picture)?));
            text.push_str(&percentiles(first, second, &difference));
        }
    }
    match opened.dataset.image(&opened.camera_name, frame) {
        Ok(image) => files.push(("image.png".to_string(), encode_png(&image)?)),
        // The depth does not need it: a film without a decoder still has its floor.
        Err(error) => tracing::warn!("the image beside the depth is left out: {error}"),
    }
    let mut suspicions: Suspicions = opened.dataset.suspicions().into_iter().collect();
    suspicions.extend(sources.iter().flat_map(|source| source.suspicions()));
    Ok(DepthImages { files, text, suspicions })
}

/// A 16-bit PNG in millimetres, which ends at 65.535 m: what is further has no depth there, and is said.
fn millimetres(name: &str, image: &DepthImage) -> RunResult<Vec<u8>> {
    const FURTHEST_M: f32 = 65.535;
    let beyond = image.z_m().iter().filter(|z| **z > FURTHEST_M).count();
    if beyond == 0 {
        return Ok(encode_depth_png(image, 0.001)?);
    }
    tracing::warn!(
        "{beyond} pixels of {name} are further than {FURTHEST_M} m and are left out of its 16-bit PNG; the .npy has them"
    );
    let z_m = image.z_m().iter().map(|z| if *z > FURTHEST_M { f32::NAN } else { *z }).collect();
    Ok(encode_depth_png(&DepthImage::new(image.stamp, image.width(), image.height(), z_m)?, 0.001)?)
}

fn summary(name: &str, map: &DepthMap) -> Vec<String> {
    let mut z: Vec<f64> = map.z_m().into_iter().filter(|z| z.is_finite()).collect();
    let share = 100.0 * map.answered() as f64 / map.pixels().len() as f64;
    let misses: Vec<String> = map.misses().iter().map(|(miss, n)| format!("{n}: {miss}")).collect();
    vec![
        name.to_string(),
        format!("{} ({share:.1} %)", map.answered()),
        median(&mut z).map_or_else(|| "-".to_string(), |z| format!("{z:.3}")),
        if misses.is_empty() { "-".to_string() } else { misses.join("; ") },
    ]
}

/// Percentiles of a difference over the pixels that both sources answer.
fn percentiles(first: &str, second: &str, difference: &[f32]) -> String {
    let metres = sorted(difference.iter().filter(|d| d.is_finite()).map(|d| f64::from(*d)).collect());
    let shares = [("5 %", 0.05), ("25 %", 0.25), ("median", 0.5), ("75 %", 0.75), ("95 %", 0.95)];
    let each = shares.iter().filter_map(|(name, share)| {
        quantile(&metres, *share).map(|metres| format!("{name} {:.1}", metres * 1000.0))
    });
    let each: Vec<String> = each.collect();
    if each.is_empty() {
        return format!("{first} and {second} answer no pixel together\n");
    }
    format!("{first} - {second} over {} pixels, mm: {}\n", metres.len(), each.join(", "))
}

#[cfg(test)]
mod tests {
    #[test]
    fn percentiles_leave_out_what_is_not_answered() {
        let text = super::percentiles("a", "b", &[f32::NAN, 0.001, 0.002, 0.003]);
        assert!(text.contains("over 3 pixels") && text.contains("median 2.0"), "{text}");
        assert!(super::percentiles("a", "b", &[f32::NAN]).contains("no pixel together"));
    }
}

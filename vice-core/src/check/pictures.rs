//! Pictures that show nothing, the same again, or little: a sample of neighbouring frames.

use super::Check;
use crate::dataset::{DepthImage, Image, PixelFormat};
use crate::finding::{Finding, State, short};
use crate::statistics::median;

/// What the check of images is.
pub const CHECK: Check = Check {
    name: "images",
    title: "images (with --images)",
    looks_at: "a sample of neighbouring frames: size against the calibration, repeated, black or white frames, jumps of exposure, blur",
    threshold: "wrong: images of another size than the calibration's; look: any frame that repeats the one before, black or white frames, brightness that jumps by a third, a fifth of the frames with less than a quarter of the usual sharpness",
    source: "what makes labels drift or trackers fail",
};

/// What the check of depth images is.
pub const DEPTH: Check = Check {
    name: "depth",
    title: "depth images and floor (with --images)",
    looks_at: "share of valid depths, their unit, edges of depth against edges of the image, the floor plane against depth and cloud, depth images against the cloud",
    threshold: "wrong: a unit that no depth camera has, depths that are all 20 % off those of the cloud, a unit or place of the cloud that makes both agree; look: 4 %, surfaces that do not agree, less than 20 % valid, depth edges that fit best 4 px or more beside the image's, a floor 5 cm or 3 degrees off the one that is fitted",
    source: "REP 118; registration to the colour camera; vice floor fit",
};

/// Means below or above these are black or white.
const BLACK: f64 = 4.0;
const WHITE: f64 = 251.0;
/// Brightness of neighbours may differ by this factor.
const EXPOSURE: f64 = 1.33;
/// Less than this share of the usual sharpness is blurred.
const BLURRED: f64 = 0.25;
const BLURRED_SHARE: f64 = 0.2;
/// Less valid depth than this is worth a look.
const VALID: f64 = 0.2;
/// Edges are tried at shifts up to this, pixels of the image.
const SHIFTS_PX: i32 = 8;
/// Shifts from here on are worth a look, pixels.
const SHIFTED_PX: f64 = 4.0;
/// A step between neighbouring depths that is an edge, a share of the depth.
const STEP_SHARE: f64 = 0.08;
/// So many edges must be there.
const FEWEST_EDGES: usize = 400;
/// Edges at the best shift must beat those at none by this.
const BETTER: f64 = 1.15;

/// What is kept of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Index of the frame.
    pub frame: usize,
    /// Columns and rows.
    pub size: (u32, u32),
    /// Mean brightness, 0 to 255.
    pub mean: f64,
    /// Mean square of the second difference of brightness, over its variance: how sharp it is.
    pub sharpness: f64,
    /// A sum over all bytes.
    pub hash: u64,
}

impl Seen {
    /// What is kept of a frame.
    pub fn of(frame: usize, image: &Image) -> Self {
        let gray = gray(image);
        let (w, h) = (image.width() as usize, image.height() as usize);
        let mean = gray.iter().sum::<f64>() / gray.len().max(1) as f64;
        let variance = gray.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / gray.len().max(1) as f64;
        let (mut sum, mut count) = (0.0, 0.0);
        for y in 1..h.saturating_sub(1) {
            for x in 1..w.saturating_sub(1) {
                let i = y * w + x;
                let second = gray[i - 1] + gray[i + 1] + gray[i - w] + gray[i + w] - 4.0 * gray[i];
                sum += second * second;
                count += 1.0;
            }
        }
        let sharpness = if variance > 1.0 && count > 0.0 { sum / count / variance } else { 0.0 };
        // FNV-1a.
        let hash = image
            .data()
            .iter()
            .fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0000_0100_0000_01b3));
        Self { frame, size: (image.width(), image.height()), mean, sharpness, hash }
    }
}

fn gray(image: &Image) -> Vec<f64> {
    match image.format() {
        PixelFormat::Gray8 => image.data().iter().map(|b| f64::from(*b)).collect(),
        PixelFormat::Rgb8 => image
            .data()
            .chunks_exact(3)
            .map(|p| 0.299 * f64::from(p[0]) + 0.587 * f64::from(p[1]) + 0.114 * f64::from(p[2]))
            .collect(),
    }
}

/// What a sample of frames is like; `calibrated` is the size that the calibration is of. Neighbours stand in pairs.
pub fn images(about: &str, pairs: &[[Option<Seen>; 2]], calibrated: Option<(u32, u32)>) -> Vec<Finding> {
    let all: Vec<Seen> = pairs.iter().flatten().flatten().copied().collect();
    let Some(first) = all.first() else {
        return vec![Finding::new(CHECK.name, about, State::Unknown, "there is no image to look at")];
    };
    let mut found = Vec::new();
    let mut say = |state, says: String, share: f64, mend: &str| {
        found.push(Finding::new(CHECK.name, about, state, says).number("share", share, "").mend(mend));
    };
    let share = |count: usize| count as f64 / all.len() as f64;
    if let Some(other) = calibrated.filter(|c| *c != first.size) {
        let ((w, h), (cw, ch)) = (first.size, other);
        let says = format!("the images are {w}x{h}, the calibration is of {cw}x{ch}");
        say(State::Wrong, says, 1.0, "`calibration` gives one of images of this size");
    }
    let both = || pairs.iter().filter_map(|[a, b]| Some((a.as_ref()?, b.as_ref()?)));
    let repeated: Vec<usize> = both().filter(|(a, b)| a.hash == b.hash).map(|(_, b)| b.frame).collect();
    if let Some(frame) = repeated.first() {
        let says = format!(
            "{} of {} neighbouring frames show the same again, such as frame {frame}",
            repeated.len(),
            both().count()
        );
        say(
            State::Look,
            says,
            repeated.len() as f64 / both().count() as f64,
            "a camera or a recorder that repeats frames: their stamps are not those of the light",
        );
    }
    let empty: Vec<usize> =
        all.iter().filter(|s| s.mean < BLACK || s.mean > WHITE).map(|s| s.frame).collect();
    if let Some(frame) = empty.first() {
        say(
            State::Look,
            format!("{} of {} frames are black or white, such as frame {frame}", empty.len(), all.len()),
            share(empty.len()),
            "nothing can be labelled there",
        );
    }
    let jumps: Vec<usize> = both()
        .filter(|(a, b)| {
            a.mean > BLACK && b.mean > BLACK && (a.mean / b.mean).max(b.mean / a.mean) > EXPOSURE
        })
        .map(|(_, b)| b.frame)
        .collect();
    if let Some(frame) = jumps.first() {
        let says = format!(
            "the brightness jumps by more than a third between {} of {} neighbours, such as before frame {frame}",
            jumps.len(),
            both().count()
        );
        say(
            State::Look,
            says,
            jumps.len() as f64 / both().count() as f64,
            "trackers of points lose them there: label by hand",
        );
    }
    let usual = median(&mut all.iter().map(|s| s.sharpness).collect::<Vec<_>>()).unwrap_or(0.0);
    let blurred: Vec<usize> = all.iter().filter(|s| s.sharpness < BLURRED * usual).map(|s| s.frame).collect();
    if let Some(frame) = blurred.first().filter(|_| share(blurred.len()) > BLURRED_SHARE) {
        let says = format!("{} of {} frames are blurred, such as frame {frame}", blurred.len(), all.len());
        say(State::Look, says, share(blurred.len()), "labels are less certain there");
    }
    if found.is_empty() {
        let says = format!("{} frames looked at: none is repeated, black or white", all.len());
        found.push(Finding::new(CHECK.name, about, State::Ok, says).number(
            "looked-at",
            all.len() as f64,
            "",
        ));
    }
    found
}

/// How far depth is registered beside the image: the shift of depth edges that lies best on edges of the image, and how much
/// better than none. `None` where there are too few edges, or the sizes differ.
pub fn registration(image: &Image, depth: &DepthImage) -> Option<Registration> {
    if (image.width(), image.height()) != (depth.width(), depth.height()) {
        return None;
    }
    let (w, h) = (image.width() as i32, image.height() as i32);
    let gray = gray(image);
    let at = |x: i32, y: i32| (y * w + x) as usize;
    let slope = |x: i32, y: i32| {
        let dx = gray[at(x + 1, y)] - gray[at(x - 1, y)];
        let dy = gray[at(x, y + 1)] - gray[at(x, y - 1)];
        dx.hypot(dy)
    };
    let z = depth.z_m();
    let margin = SHIFTS_PX + 2;
    let mut edges = Vec::new();
    for y in margin..h - margin {
        for x in margin..w - margin {
            let (a, b, c) = (z[at(x, y)], z[at(x + 1, y)], z[at(x, y + 1)]);
            let step = |b: f32| (f64::from(a) - f64::from(b)).abs() > STEP_SHARE * f64::from(a.min(b));
            // The nearer side bounds what is seen.
            if step(b) || step(c) {
                edges.push((x, y));
            }
        }
    }
    if edges.len() < FEWEST_EDGES {
        return None;
    }
    let every = (edges.len() / 20_000).max(1);
    let score = |dx: i32, dy: i32| -> f64 {
        let list = edges.iter().step_by(every);
        // Weak and strong edges count alike.
        let sum: f64 = list.clone().map(|(x, y)| slope(x + dx, y + dy).min(40.0)).sum();
        sum / list.count() as f64
    };
    let none = score(0, 0);
    let mut best = (none, 0, 0);
    for dy in -SHIFTS_PX..=SHIFTS_PX {
        for dx in -SHIFTS_PX..=SHIFTS_PX {
            let s = score(dx, dy);
            if s > best.0 {
                best = (s, dx, dy);
            }
        }
    }
    Some(Registration { shift_px: [best.1, best.2], better: best.0 / none.max(1e-9), edges: edges.len() })
}

/// Where depth edges lie best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Registration {
    /// Shift of the depth image that puts its edges on those of the image, pixels.
    pub shift_px: [i32; 2],
    /// How many times as strong the image's edges are there.
    pub better: f64,
    /// Depth edges.
    pub edges: usize,
}

/// What a sample of depth images is like: shares that are valid, and where their edges lie.
pub fn depths(about: &str, valid: &[f64], registrations: &[Registration]) -> Vec<Finding> {
    let Some(middle) = median(&mut valid.to_vec()) else {
        return vec![Finding::new(DEPTH.name, about, State::Unknown, "there is no depth image to look at")];
    };
    let mut found = Vec::new();
    let state = if middle < VALID { State::Look } else { State::Ok };
    let says =
        format!("{:.0} % of the depths are valid, in the middle of {} images", 100.0 * middle, valid.len());
    let finding = Finding::new(DEPTH.name, about, state, says).number("valid", middle, "");
    found.push(if state == State::Look {
        finding.mend("a scan (`depth` zmap) or the floor reaches where the camera sees no depth")
    } else {
        finding
    });
    let part = |axis: usize| {
        median(&mut registrations.iter().map(|r| f64::from(r.shift_px[axis])).collect::<Vec<_>>())
    };
    let better = median(&mut registrations.iter().map(|r| r.better).collect::<Vec<_>>());
    if let (Some(u), Some(v), Some(better)) = (part(0), part(1), better) {
        let agree = registrations
            .iter()
            .filter(|r| (f64::from(r.shift_px[0]) - u).hypot(f64::from(r.shift_px[1]) - v) <= 2.0)
            .count();
        let sure = 3 * agree >= 2 * registrations.len() && registrations.len() >= 3 && better > BETTER;
        let shift = u.hypot(v);
        let numbers =
            |f: Finding| f.number("shift-u", u, "px").number("shift-v", v, "px").number("better", better, "");
        if sure && shift >= SHIFTED_PX {
            let says = format!(
                "edges of depth lie best ({}, {}) px beside themselves: depth seems not to be registered to this camera",
                short(u),
                short(v)
            );
            found.push(
                numbers(Finding::new(DEPTH.name, about, State::Look, says))
                    .mend("register the depth to the colour camera, or name its own camera with `camera`"),
            );
        } else if sure || shift < SHIFTED_PX {
            found.push(numbers(Finding::new(
                DEPTH.name,
                about,
                State::Ok,
                "edges of depth lie on edges of the image",
            )));
        } else {
            found.push(numbers(Finding::new(
                DEPTH.name,
                about,
                State::Unknown,
                "edges of depth and of the image do not tell whether both are registered",
            )));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Stamp;

    /// A checkerboard of near and far squares whose depth is moved.
    fn scene(shift: i32, light: f64) -> (Image, DepthImage) {
        let near = |x: i32, y: i32| (x.div_euclid(40) + y.div_euclid(40)).rem_euclid(2) == 0;
        let (w, h) = (320, 240);
        let gray = (0..w * h).map(|i| {
            let v = if near(i % w, i / w) { 180.0 } else { 60.0 + f64::from((i * 7919) % 13) };
            (v * light) as u8
        });
        let z = (0..w * h).map(|i| if near(i % w + shift, i / w) { 1.0 } else { 2.0 }).collect();
        let image = Image::new(320, 240, PixelFormat::Gray8, gray.collect()).unwrap();
        (image, DepthImage::new(Stamp::from_nanos(0), 320, 240, z).unwrap())
    }

    #[test]
    fn depth_beside_the_image_is_noticed() {
        let straight = scene(0, 1.0);
        let found = registration(&straight.0, &straight.1).unwrap();
        assert!(found.shift_px.iter().all(|s| s.abs() <= 1), "{found:?}");
        let moved = scene(6, 1.0);
        let found = registration(&moved.0, &moved.1).unwrap();
        assert!((found.shift_px[0] - 6).abs() <= 1 && found.better > 1.5, "{found:?}");
        let said = depths("cam0", &[0.9, 0.8, 0.9], &[found; 3]);
        assert_eq!(said.iter().map(|f| f.state).collect::<Vec<_>>(), [State::Ok, State::Look]);
    }

    #[test]
    fn repeated_black_and_flickering_frames_are_told() {
        let seen = |frame, light| Some(Seen::of(frame, &scene(frame as i32, light).0));
        let fine: Vec<[Option<Seen>; 2]> = (0..5).map(|i| [seen(2 * i, 1.0), seen(2 * i, 0.98)]).collect();
        assert_eq!(images("cam0", &fine, Some((320, 240)))[0].state, State::Ok);
        assert_eq!(images("cam0", &fine, Some((640, 480)))[0].state, State::Wrong);
        let same = images("cam0", &[[seen(0, 1.0), seen(0, 1.0)]], None);
        assert!(same[0].says.contains("same again"), "{same:?}");
        let dark = images("cam0", &[[seen(0, 1.0), seen(1, 0.0)]], None);
        assert!(dark[0].says.contains("black or white"), "{dark:?}");
        let flicker = images("cam0", &[[seen(0, 1.0), seen(1, 0.6)]], None);
        assert!(flicker[0].says.contains("jumps"), "{flicker:?}");
    }
}

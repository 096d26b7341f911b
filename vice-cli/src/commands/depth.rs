//! `vice depth`: depth images of a frame from each source, as numbers and as pictures.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;
use vice_core::dataset::DepthImage;
use vice_core::depth::DepthMiss;
use vice_depth::{DepthMap, depth_image};
use vice_files::atomic::{self, Overwrite};
use vice_files::image_file::{encode_depth_png, encode_png};

use crate::commands::depth_compare;
use crate::inputs::{AnchorArgs, DatasetArgs, DepthArgs, Scene};
use crate::report::depth_picture::{common_range, depth_picture, difference_picture};
use crate::report::{npy, table};
use crate::terminal::{self, Outcome, Verbosity, usage};

/// Arguments of `vice depth`.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(after_help = "Examples:\n  \
    vice depth V1_01_easy --at 1403715280562142976 --source floor,zmap --out depth_out\n  \
    vice depth compare V1_01_easy --labels floor.csv --source floor,zmap")]
pub(crate) struct Args {
    // Before the subcommand, which is taken out of the matches when it is read.
    #[command(flatten)]
    images: WithoutCommand,
    #[command(subcommand)]
    command: Option<Command>,
}

/// The arguments of the images themselves, which a subcommand takes the place of. An `Option` would do, but clap finds
/// one empty that has flattened arguments of its own.
#[derive(Debug)]
struct WithoutCommand(Option<ImageArgs>);

impl clap::FromArgMatches for WithoutCommand {
    fn from_arg_matches(matches: &clap::ArgMatches) -> Result<Self, clap::Error> {
        match matches.subcommand_name() {
            Some(_) => Ok(Self(None)),
            None => ImageArgs::from_arg_matches(matches).map(|images| Self(Some(images))),
        }
    }

    fn update_from_arg_matches(&mut self, matches: &clap::ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl clap::Args for WithoutCommand {
    fn augment_args(command: clap::Command) -> clap::Command {
        ImageArgs::augment_args(command)
    }

    fn augment_args_for_update(command: clap::Command) -> clap::Command {
        ImageArgs::augment_args_for_update(command)
    }
}

/// What else can be done with depth.
#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Compare the depths of two or more sources at labelled key points, and what a difference costs in pixels.
    Compare(Box<depth_compare::Args>),
}

#[derive(Debug, clap::Args)]
struct ImageArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Frame: its index, or its stamp in nanoseconds.
    #[arg(long, value_name = "STAMP|INDEX")]
    at: String,
    /// Depth sources: floor, zmap, zcam, mesh, tag.
    #[arg(long, value_name = "SOURCE,...", required = true)]
    source: Vec<String>,
    /// Folder for the images; files of the same names are replaced.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    depth: DepthArgs,
    #[command(flatten)]
    anchor: AnchorArgs,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    match (&args.command, &args.images.0) {
        (Some(Command::Compare(compare)), _) => depth_compare::run(compare),
        (None, Some(images)) => write_images(images, verbosity),
        (None, None) => Err(usage("name a data set, or `vice depth compare`")),
    }
}

fn write_images(args: &ImageArgs, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    if args.out.is_file() {
        return Err(usage(format!("--out: {} is a file, not a folder", args.out.display())));
    }
    let scene = Scene::open(&args.dataset, &args.depth, &args.anchor)?;
    let frame = scene.frame_at(&args.at)?;
    let keyframe = scene.keyframe(frame)?;
    let sources = args.depth.sources("--source", &args.source, &scene.dataset, &scene.used.name)?;
    let bar = verbosity.progress("depth");
    bar.set_length(sources.len() as u64);
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    let mut grid = vec![["source", "answered", "median m", "not answered"].map(String::from).to_vec()];
    let mut maps: Vec<(String, DepthMap)> = Vec::new();
    let mut images: Vec<(String, DepthImage)> = Vec::new();
    for source in &sources {
        let map = depth_image(source.as_ref(), &keyframe)?;
        if map.answered() == 0 {
            // One reason for every pixel is a reason to fail, not a picture.
            let reason = map.misses().first().map_or(DepthMiss::NoDepth, |(miss, _)| *miss);
            anyhow::bail!("{} gives no depth at {} ns: {reason}", source.name(), keyframe.stamp);
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
        bar.inc(1);
    }
    bar.finish_and_clear();
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
    match scene.dataset.image(&scene.used.name, frame) {
        Ok(image) => files.push(("image.png".to_string(), encode_png(&image)?)),
        // The depth does not need it: a film without a decoder still has its floor.
        Err(error) => tracing::warn!("the image beside the depth is left out: {error}"),
    }
    fs::create_dir_all(&args.out)
        .with_context(|| format!("cannot make the folder {}", args.out.display()))?;
    for (name, bytes) in &files {
        write(&args.out, name, bytes)?;
    }
    let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
    text.push_str(&format!("wrote {} to {}\n", names.join(", "), args.out.display()));
    terminal::print(&text)?;
    Ok(Outcome::Done)
}

/// A 16-bit PNG in millimetres, which ends at 65.535 m: what is further has no depth there, and is said.
fn millimetres(name: &str, image: &DepthImage) -> anyhow::Result<Vec<u8>> {
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

fn write(folder: &Path, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
    Ok(atomic::write(folder.join(name), Overwrite::Replace, |out| out.write_all(bytes))?)
}

fn summary(name: &str, map: &DepthMap) -> Vec<String> {
    let mut z: Vec<f64> = map.z_m().into_iter().filter(|z| z.is_finite()).collect();
    z.sort_unstable_by(f64::total_cmp);
    let share = 100.0 * map.answered() as f64 / map.pixels().len() as f64;
    let misses: Vec<String> = map.misses().iter().map(|(miss, n)| format!("{n}: {miss}")).collect();
    vec![
        name.to_string(),
        format!("{} ({share:.1} %)", map.answered()),
        z.get(z.len() / 2).map_or_else(|| "-".to_string(), |z| format!("{z:.3}")),
        if misses.is_empty() { "-".to_string() } else { misses.join("; ") },
    ]
}

/// Percentiles of a difference over the pixels that both sources answer.
fn percentiles(first: &str, second: &str, difference: &[f32]) -> String {
    let mut metres: Vec<f32> = difference.iter().copied().filter(|d| d.is_finite()).collect();
    if metres.is_empty() {
        return format!("{first} and {second} answer no pixel together\n");
    }
    metres.sort_unstable_by(f32::total_cmp);
    let at = |p: f64| f64::from(metres[((metres.len() - 1) as f64 * p).round() as usize]) * 1000.0;
    format!(
        "{first} - {second} over {} pixels, mm: 5 % {:.1}, 25 % {:.1}, median {:.1}, 75 % {:.1}, 95 % {:.1}\n",
        metres.len(),
        at(0.05),
        at(0.25),
        at(0.5),
        at(0.75),
        at(0.95)
    )
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

//! Depth sources by name.

use std::sync::Arc;

use vice_core::dataset::Dataset;
use vice_core::depth::DepthSource;
use vice_depth::{CloudOptions, FloorDepth, ZMapDepth, ZMapOptions, load_cloud};

use crate::commands::evaluate::{DepthArgs, depth_names};
use crate::terminal::usage;

/// The depth sources that are asked for, in that order.
pub(crate) fn depth_sources(
    args: &DepthArgs,
    dataset: &Arc<dyn Dataset>,
    _camera: &str,
) -> anyhow::Result<Vec<Box<dyn DepthSource>>> {
    depth_names(args).iter().map(|name| depth_source(name, args, dataset)).collect()
}

fn depth_source(
    name: &str,
    args: &DepthArgs,
    dataset: &Arc<dyn Dataset>,
) -> anyhow::Result<Box<dyn DepthSource>> {
    match name {
        "floor" => Ok(Box::new(FloorDepth::new())),
        "zmap" => {
            let cloud = dataset.cloud()?.ok_or_else(|| {
                anyhow::anyhow!(
                    "{} has no point cloud for the depth source zmap (use --depth floor)",
                    dataset.name()
                )
            })?;
            let points = load_cloud(&cloud, &CloudOptions::default())?;
            let options = ZMapOptions { occlusion: args.zmap_occlusion, ..ZMapOptions::default() };
            Ok(Box::new(ZMapDepth::new(points, cloud.world_from_cloud, options)))
        }
        _ => Err(usage(format!("--depth: unknown depth source {name}; known: floor, zmap"))),
    }
}

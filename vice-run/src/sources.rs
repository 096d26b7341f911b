//! Depth sources: how each is made.

use std::sync::Arc;

use vice_core::dataset::{CloudRef, CloudSource, Dataset};
use vice_core::depth::DepthSource;
use vice_core::error::one_line;
use vice_core::evaluate::TriangulatedDepth;
use vice_core::suspicion::Suspicion;
use vice_depth::{
    Cloud, CloudOptions, FloorDepth, Mesh, MeshDepth, ZCamDepth, ZCamOptions, ZMapDepth, ZMapOptions,
    load_cloud,
};
use vice_detect::{TagDepth, TagOptions};
use vice_track::StereoDepth;

use crate::error::{RunError, RunResult};
use crate::open::Opened;
use crate::request::{DepthName, DepthSpec};

impl DepthSpec {
    /// The sources that are asked for, in that order.
    ///
    /// # Errors
    /// [`RunError`] if the data set has not what a source needs.
    pub fn make_all(&self, opened: &Opened) -> RunResult<Vec<Box<dyn DepthSource>>> {
        self.names().into_iter().map(|name| self.make(name, opened)).collect()
    }

    /// The sources that the depths at the key frames are compared with: what the recording has beside those that are
    /// asked for. One that cannot be made is a suspicion, since nothing is scored with it.
    pub fn make_checks(&self, opened: &Opened) -> (Vec<Box<dyn DepthSource>>, Vec<Suspicion>) {
        let (mut made, mut failed) = (Vec::new(), Vec::new());
        if self.compare == Some(false) || self.is_triangulated() {
            return (made, failed);
        }
        let asked = self.names();
        // A mesh is the same scan as the Z-map's cloud.
        let scanned = asked.contains(&DepthName::ZMap) || asked.contains(&DepthName::Mesh);
        let has_cloud = || !matches!(opened.dataset.cloud(), Ok(None));
        let there = [
            (
                DepthName::ZCam,
                !asked.contains(&DepthName::ZCam) && opened.dataset.has_depth(&opened.camera_name),
            ),
            (DepthName::ZMap, !scanned && has_cloud()),
        ];
        for (name, _) in there.into_iter().filter(|(_, there)| *there) {
            match self.make(name, opened) {
                Ok(source) => made.push(source),
                Err(error) => failed.push(
                    Suspicion::new(
                        "depth-not-compared",
                        name.name(),
                        "depths cannot be compared with this source",
                    )
                    .evidence(one_line(&error))
                    .advice("leave it out with `depth-check` off"),
                ),
            }
        }
        (made, failed)
    }

    /// One source.
    ///
    /// # Errors
    /// [`RunError`] if the data set has not what it needs.
    pub fn make(&self, name: DepthName, opened: &Opened) -> RunResult<Box<dyn DepthSource>> {
        let (dataset, camera) = (&opened.dataset, opened.camera_name.as_str());
        match name {
            DepthName::Floor => Ok(Box::new(FloorDepth::new())),
            DepthName::ZMap => {
                let (cloud, reference) = self.cloud(name, opened)?;
                let occlusion = self.zmap_occlusion.unwrap_or(true);
                let interpolation = self.zmap_interpolation.unwrap_or_default().into();
                let options = ZMapOptions { occlusion, interpolation, ..ZMapOptions::default() };
                Ok(Box::new(ZMapDepth::new(cloud, reference.world_from_cloud, options)))
            }
            DepthName::ZCam => {
                let range_m = self.zcam_range_m.unwrap_or(ZCamOptions::default().range_m);
                let options = ZCamOptions { range_m, ..ZCamOptions::default() };
                Ok(Box::new(ZCamDepth::new(Arc::clone(dataset), camera, options)?))
            }
            DepthName::Mesh => {
                let reference = mesh_of(dataset.as_ref())?;
                let CloudSource::File(path) = &reference.source else {
                    return Err(RunError::missing(format!(
                        "{}: the depth source mesh needs a PLY with faces",
                        dataset.name()
                    )));
                };
                Ok(Box::new(MeshDepth::new(Arc::new(Mesh::read(path)?), reference.world_from_cloud)))
            }
            DepthName::Stereo => {
                let second = self.second_camera(dataset.as_ref(), camera)?;
                Ok(Box::new(StereoDepth::new(Arc::clone(dataset), camera, &second)?))
            }
            DepthName::Triangulated => Ok(Box::new(TriangulatedDepth)),
            DepthName::Tag => {
                let size_m = self.tag_size_m.ok_or_else(|| {
                    RunError::usage("depth", "tag: how large the tags are is not known")
                        .advise("give `tag-size`")
                })?;
                let options = TagOptions { family: self.tag_family.unwrap_or_default(), border: None };
                Ok(Box::new(TagDepth::new(Arc::clone(dataset), camera, options, size_m)?))
            }
        }
    }

    /// The second camera of the pair.
    fn second_camera(&self, dataset: &dyn Dataset, first: &str) -> RunResult<String> {
        let others: Vec<String> = dataset.cameras().into_iter().filter(|name| name != first).collect();
        match (&self.stereo_camera, others.as_slice()) {
            (Some(name), _) => Ok(name.clone()),
            (None, [only]) => Ok(only.clone()),
            (None, []) => Err(RunError::missing(format!(
                "{} has one camera, and the depth source stereo needs two",
                dataset.name()
            ))),
            (None, several) => Err(RunError::usage(
                "stereo-camera",
                format!("could be {}; name the second camera of the pair", several.join(", ")),
            )),
        }
    }

    /// The data set's scan, read.
    ///
    /// # Errors
    /// [`RunError`] if it has none for this source, or it cannot be read.
    pub fn cloud(&self, source: DepthName, opened: &Opened) -> RunResult<(Arc<Cloud>, CloudRef)> {
        let reference = cloud_of(source, opened.dataset.as_ref())?;
        let options = CloudOptions { voxel_m: self.cloud_voxel_m, ..CloudOptions::default() };
        let cloud = match &opened.scans {
            Some(scans) => scans.load(&reference, &options)?,
            None => load_cloud(&reference, &options)?,
        };
        Ok((cloud, reference))
    }
}

fn mesh_of(dataset: &dyn Dataset) -> RunResult<CloudRef> {
    dataset.mesh()?.ok_or_else(|| {
        RunError::missing(format!("{} has no mesh for the depth source mesh", dataset.name()))
            .advise("give a PLY with faces with `mesh`, or use `depth` floor")
    })
}

fn cloud_of(source: DepthName, dataset: &dyn Dataset) -> RunResult<CloudRef> {
    dataset.cloud()?.ok_or_else(|| {
        RunError::missing(format!("{} has no point cloud for the depth source {source}", dataset.name()))
            .advise("give a PLY, PCD, LAS or LAZ file with `cloud`, or use `depth` floor")
    })
}

//! Labels of several cameras in one file.

use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::label::{LabelError, LabelSet, LabelSetBuilder};
use vice_core::suspicion::Suspicion;

use super::LabelFile;

/// Takes labels camera by camera; no name stands for a file, or a row of it, that names none.
#[derive(Default)]
pub(super) struct ByCamera {
    cameras: Vec<(String, LabelSetBuilder)>,
    last: usize,
}

impl ByCamera {
    /// The labels of a camera so far.
    pub(super) fn of(&mut self, camera: &str) -> &mut LabelSetBuilder {
        if self.cameras.get(self.last).is_none_or(|(name, _)| name != camera) {
            self.last = match self.cameras.iter().position(|(name, _)| name == camera) {
                Some(place) => place,
                None => {
                    self.cameras.push((camera.to_string(), LabelSetBuilder::default()));
                    self.cameras.len() - 1
                }
            };
        }
        &mut self.cameras[self.last].1
    }

    /// The labels, cameras by their names.
    ///
    /// # Errors
    /// [`DataError`] as `wrong` says it for labels that are none, and where only some of them name a camera.
    pub(super) fn finish(mut self, wrong: impl Fn(LabelError) -> DataError) -> DataResult<LabelFile> {
        self.cameras.sort_by(|a, b| a.0.cmp(&b.0));
        if let [(first, _), (second, _), ..] = self.cameras.as_slice()
            && first.is_empty()
        {
            let problem = format!("some labels are of camera {second}, and others name none");
            return Err(
                DataError::of_kind(ErrorKind::Contradictory, problem).hint("name the camera of all labels")
            );
        }
        let mut sets = Vec::with_capacity(self.cameras.len());
        for (camera, builder) in self.cameras {
            let mut labels = builder.finish().map_err(&wrong)?;
            labels.camera = Some(camera).filter(|name| !name.is_empty());
            sets.push(labels);
        }
        let mut sets = sets.into_iter();
        let mut file = LabelFile::of(sets.next().unwrap_or_default());
        file.of_other_cameras = sets.collect();
        Ok(file)
    }
}

impl LabelFile {
    /// Names of the cameras whose labels the file holds; none where it does not say.
    pub fn cameras(&self) -> Vec<&str> {
        self.sets().filter_map(|labels| labels.camera.as_deref()).collect()
    }

    fn sets(&self) -> impl Iterator<Item = &LabelSet> {
        std::iter::once(&self.labels).chain(&self.of_other_cameras)
    }

    /// With the labels of a camera alone, of a data set with the cameras `known`. A file that names no camera is of the one that is
    /// asked for. So is one of a single camera that the data set does not have at all, since the same camera has another name in
    /// each format; that is doubted.
    ///
    /// # Errors
    /// [`DataError`] with the cameras that there are, if it is none of them.
    pub fn of_camera(mut self, camera: &str, known: &[String]) -> DataResult<Self> {
        let is_it = |labels: &LabelSet| labels.camera.as_deref().is_none_or(|name| name == camera);
        let unknown = self.labels.camera.as_ref().filter(|name| !known.contains(name));
        if let (Some(name), true, false) = (unknown, self.of_other_cameras.is_empty(), is_it(&self.labels)) {
            let says =
                format!("the labels say that they are of a camera {name}, which the data set does not have");
            let doubt = Suspicion::new("labels-other-camera", "labels", says)
                .evidence(format!("they are taken as those of {camera}"))
                .advice("see whether they were made on this recording");
            self.suspicions.add(doubt);
        } else if !is_it(&self.labels) {
            let Some(place) = self.of_other_cameras.iter().position(is_it) else {
                let cameras = self.cameras();
                let problem = format!("holds labels of camera {}, not of {camera}", cameras.join(", "));
                let hint =
                    format!("choose it with `camera` {}", cameras.first().copied().unwrap_or_default());
                return Err(DataError::of_kind(ErrorKind::Contradictory, problem).hint(hint));
            };
            self.labels = self.of_other_cameras.swap_remove(place);
        }
        self.of_other_cameras.clear();
        Ok(self)
    }

    /// The labels, where they are of one camera.
    ///
    /// # Errors
    /// [`DataError`] with the cameras, where they are of several.
    pub fn of_one_camera(self) -> DataResult<LabelSet> {
        if self.of_other_cameras.is_empty() {
            return Ok(self.labels);
        }
        let problem = format!("holds labels of the cameras {}", self.cameras().join(", "));
        Err(DataError::of_kind(ErrorKind::Usage, problem).hint("choose one with `camera`"))
    }
}

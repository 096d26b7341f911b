//! A plugin of the tests: it panics where a file in the data set says so, and must never take the program with it.
#![allow(clippy::panic, clippy::indexing_slicing)] // That is what it is for.

use std::path::Path;
use std::sync::Arc;

use vice_core::camera::{Camera, Model};
use vice_core::dataset::{Dataset, DatasetFactory, FormatInfo, Image, OpenOptions, Probe};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::BodyFromCamera;
use vice_core::time::Stamp;
use vice_core::trajectory::Trajectory;

struct Panicking;

struct Run {
    at: String,
}

impl Run {
    fn here(&self, place: &str) {
        if self.at == place {
            panic!("panics in {place}");
        }
    }
}

impl DatasetFactory for Panicking {
    fn info(&self) -> FormatInfo {
        FormatInfo {
            name: "panicking".into(),
            description: "A plugin of the tests".into(),
            version: "1".into(),
            offers: vec![],
            settings: vec![],
        }
    }

    fn probe(&self, path: &Path) -> Probe {
        match std::fs::read_to_string(path.join("panic.txt")) {
            Ok(text) if text == "probe" => panic!("panics in probe"),
            Ok(_) => Probe::Yes,
            Err(_) => Probe::No,
        }
    }

    fn open(&self, path: &Path, _: &OpenOptions) -> DataResult<Box<dyn Dataset>> {
        let file = path.join("panic.txt");
        let at = std::fs::read_to_string(&file)
            .map_err(|e| DataError::new("cannot be read").at(&file).because(e))?;
        if at == "open" {
            panic!("panics in open");
        }
        Ok(Box::new(Run { at }))
    }
}

impl Dataset for Run {
    fn name(&self) -> &str {
        "a run"
    }

    fn format(&self) -> &str {
        "panicking"
    }

    fn cameras(&self) -> Vec<String> {
        self.here("cameras");
        vec!["cam".into()]
    }

    fn camera(&self, _: &str) -> DataResult<Camera> {
        Camera::new(8, 4, [6.0, 6.0, 3.5, 1.5], Model::Pinhole).map_err(DataError::of)
    }

    fn frames(&self, _: &str) -> DataResult<Arc<[Stamp]>> {
        self.here("frames");
        Ok(Arc::new([Stamp::from_nanos(1)]))
    }

    fn image(&self, _: &str, index: usize) -> DataResult<Image> {
        let none: [u8; 0] = [];
        // Out of bounds.
        Err(DataError::new(none[index].to_string()))
    }

    fn body_from_camera(&self, _: &str, _: Stamp) -> DataResult<BodyFromCamera> {
        Ok(BodyFromCamera::identity())
    }

    fn streams(&self) -> Vec<String> {
        vec![]
    }

    fn trajectory(&self, stream: &str) -> DataResult<Trajectory> {
        Err(DataError::new(format!("there is no stream {stream}")))
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        self.here("drop");
    }
}

vice_abi::export_plugin!(Panicking);

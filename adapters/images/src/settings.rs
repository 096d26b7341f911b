//! What `--set` may say of a folder of images.

use std::cell::Cell;

use vice_core::dataset::OpenOptions;
use vice_core::error::{DataError, DataResult, ErrorKind};

use crate::stamps::ASSUMED_FPS;

/// Keys and what they do.
pub(crate) const KEYS: [(&str, &str); 2] = [
    (
        "fps",
        "pictures a second, where the pictures are counted and nothing says when they were taken (default 30)",
    ),
    ("depth_scale", "counts a metre of the depth images (default: as the layout or vice.toml has it)"),
];

/// Settings, and which of them were asked for: one that changes nothing is refused.
#[derive(Debug, Default)]
pub(crate) struct Settings {
    fps: Option<f64>,
    depth_scale: Option<f64>,
    fps_used: Cell<bool>,
    depth_scale_used: Cell<bool>,
}

impl Settings {
    pub(crate) fn read(options: &OpenOptions) -> DataResult<Self> {
        let number = |key: &str| -> DataResult<Option<f64>> {
            let Some(text) = options.settings.get(key) else { return Ok(None) };
            match text.parse::<f64>() {
                Ok(value) if value.is_finite() && value > 0.0 => Ok(Some(value)),
                _ => Err(DataError::of_kind(
                    ErrorKind::Usage,
                    format!("{key} = {text} is no number above zero"),
                )),
            }
        };
        Ok(Self { fps: number("fps")?, depth_scale: number("depth_scale")?, ..Self::default() })
    }

    /// Pictures a second, where somebody said.
    pub(crate) fn fps(&self) -> Option<f64> {
        self.fps_used.set(true);
        self.fps
    }

    /// Pictures a second, or what is assumed.
    pub(crate) fn fps_or_assumed(&self) -> f64 {
        self.fps().unwrap_or(ASSUMED_FPS)
    }

    /// Metres a count, and where that is from.
    pub(crate) fn metres_per_count(&self, own_counts: f64, own: &str) -> (f64, String) {
        self.depth_scale_used.set(true);
        match self.depth_scale {
            Some(counts) => (1.0 / counts, "as set".to_string()),
            None => (1.0 / own_counts, own.to_string()),
        }
    }

    /// Refuses what nothing asked for.
    pub(crate) fn check_used(&self) -> DataResult<()> {
        let unused = [
            ("fps", self.fps.is_some() && !self.fps_used.get(), "the pictures have stamps of their own"),
            (
                "depth_scale",
                self.depth_scale.is_some() && !self.depth_scale_used.get(),
                "there are no depth images",
            ),
        ];
        match unused.into_iter().find(|(_, unused, _)| *unused) {
            Some((key, _, why)) => {
                Err(DataError::of_kind(ErrorKind::Usage, format!("the setting {key} changes nothing: {why}"))
                    .hint("leave it out"))
            }
            None => Ok(()),
        }
    }
}

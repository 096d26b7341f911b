//! Finding and opening flights.

use std::path::Path;

use vice_core::dataset::{Dataset, DatasetFactory, FormatInfo, OpenOptions, Probe, SettingInfo};
use vice_core::error::{DataError, DataResult};
use vice_video::Ffmpeg;

use crate::dataset::BlackbirdDataset;
use crate::{layout, ned};

/// Opens the format `blackbird`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Blackbird;

impl DatasetFactory for Blackbird {
    fn info(&self) -> FormatInfo {
        let settings = [
            ("environment", "the rendered environment (default: the first by name)"),
            (
                "initial-velocity",
                "x,y,z in m/s, NED as in the data set: velocity at the start of imu-euler (default: fitted to the \
                 ground truth)",
            ),
            ("ffmpeg", "the FFmpeg program (default: ffmpeg on the PATH)"),
        ];
        FormatInfo {
            name: "blackbird".to_string(),
            description: "flights of the MIT Blackbird data set, with rendered cameras".to_string(),
            version: env!("CARGO_PKG_VERSION").to_string(),
            offers: ["images", "ground truth", "imu", "depth images", "floor"].map(String::from).to_vec(),
            settings: settings
                .map(|(key, what)| SettingInfo { key: key.to_string(), description: what.to_string() })
                .to_vec(),
        }
    }

    fn probe(&self, path: &Path) -> Probe {
        if layout::is_flight(path) {
            return Probe::Yes;
        }
        let flights = layout::flights_below(path);
        if flights.is_empty() { Probe::No } else { Probe::Collection(flights) }
    }

    fn open(&self, path: &Path, options: &OpenOptions) -> DataResult<Box<dyn Dataset>> {
        if !layout::is_flight(path) {
            let error = DataError::new(format!("is no flight: it has no {}", layout::POSES)).at(path);
            return Err(match layout::flights_below(path).first() {
                Some(flight) => error.hint(format!("name one flight, such as {}", flight.display())),
                None => error,
            });
        }
        let setting = |key: &str| options.settings.get(key).map(String::as_str);
        let ffmpeg = setting("ffmpeg").map_or_else(Ffmpeg::default, Ffmpeg::new);
        let velocity = setting("initial-velocity").map(parse_velocity).transpose()?;
        Ok(Box::new(BlackbirdDataset::open(
            path,
            setting("environment"),
            velocity.map(ned::direction),
            ffmpeg,
        )?))
    }
}

/// `x,y,z` in m/s.
fn parse_velocity(text: &str) -> DataResult<[f64; 3]> {
    let numbers: Vec<f64> =
        text.split(',').filter_map(|part| part.trim().parse().ok()).filter(|v: &f64| v.is_finite()).collect();
    match (<[f64; 3]>::try_from(numbers), text.split(',').count()) {
        (Ok(velocity), 3) => Ok(velocity),
        _ => Err(DataError::new(format!("initial-velocity `{text}` is not three numbers"))
            .hint("give it as x,y,z in m/s: north, east, down")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_velocity_is_three_finite_numbers() {
        assert_eq!(parse_velocity("1, -2,0.5").unwrap(), [1.0, -2.0, 0.5]);
        for bad in ["", "1,2", "1,2,3,4", "1,2,x", "1,2,nan", "1,2,3,x"] {
            assert!(parse_velocity(bad).unwrap_err().to_string().contains("north, east, down"), "{bad}");
        }
    }
}

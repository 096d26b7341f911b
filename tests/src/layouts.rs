//! Recordings of `oracles/layouts.json` as folders.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use vice_core::dataset::{DepthImage, Image, PixelFormat};
use vice_core::time::Stamp;
use vice_files::image_file;

use crate::root;

/// The recordings, as the oracle has them.
pub fn recordings() -> Vec<Value> {
    let text = fs::read_to_string(root().join("tests/oracles/layouts.json")).expect("the oracle is there");
    let oracle: Value = serde_json::from_str(&text).expect("the oracle is JSON");
    oracle["recordings"].as_array().expect("a list").clone()
}

/// Writes a recording below a folder and gives the folder that is opened.
pub fn write(recording: &Value, below: &Path) -> PathBuf {
    let name = recording["folder"].as_str().expect("a name");
    // Some layouts have files outside of the folder that is opened.
    let outside = recording["outside"].as_bool().unwrap_or(false);
    let base = if outside { below.to_path_buf() } else { below.join(name) };
    let invalid = recording["invalid_depth_count"].as_u64();
    for (path, what) in recording["files"].as_object().expect("files") {
        let path = base.join(path);
        fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        fs::write(&path, bytes(what, invalid)).expect("written");
    }
    below.join(name)
}

fn bytes(what: &Value, invalid: Option<u64>) -> Vec<u8> {
    if let Some(text) = what["text"].as_str() {
        return text.as_bytes().to_vec();
    }
    if let Some(hex) = what["hex"].as_str() {
        let byte = |i: usize| u8::from_str_radix(&hex[i..i + 2], 16).expect("two digits");
        return (0..hex.len()).step_by(2).map(byte).collect();
    }
    let side = |key: &str, i: usize| what[key][i].as_u64().expect("a side") as u32;
    if what["png"].is_array() {
        let (w, h) = (side("png", 0), side("png", 1));
        let image = Image::new(w, h, PixelFormat::Gray8, vec![0; (w * h) as usize]).expect("its bytes");
        return image_file::encode_png(&image).expect("a PNG");
    }
    let (w, h, count) = (side("depth", 0), side("depth", 1), side("depth", 2));
    let mut counts = vec![count as f32; (w * h) as usize];
    // The first pixel has no depth, the second says so by another count where the layout has one.
    counts[0] = 0.0;
    counts[1] = invalid.map_or(count as f32, |count| count as f32);
    let image = DepthImage::new(Stamp::default(), w, h, counts).expect("its values");
    image_file::encode_depth_png(&image, 1.0).expect("a PNG")
}

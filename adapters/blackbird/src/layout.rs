//! Folders of the data set: which are flights, which environments and cameras a flight has.

use std::path::{Path, PathBuf};

use vice_core::error::{DataError, DataResult};

/// The file that makes a folder a flight.
pub(crate) const POSES: &str = "groundTruthPoses.csv";
/// The stamps of a camera's frames.
pub(crate) const STAMPS: &str = "nSecTimestamps.txt";

/// Levels below a folder that are searched for flights: data set, trajectory, yaw, flight.
const SEARCH_DEPTH: usize = 4;
/// Folders that are looked into at most, so that probing a disk comes to an end; the whole data set has about 250.
const SEARCH_FOLDERS: usize = 2000;

/// Where a camera is mounted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Side {
    Left,
    Right,
    Down,
}

/// What a camera sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
    Gray,
    Rgb,
    Depth,
}

/// A camera's folder in an environment. Ordered as cameras are listed: gray before colour, left before right before down.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct CameraFolder {
    pub(crate) kind: Kind,
    pub(crate) side: Side,
    pub(crate) path: PathBuf,
}

impl CameraFolder {
    /// A folder by its name, `Camera_Left_Gray`; `None` for others, and for segmentations, which nobody tracks in.
    fn from_path(path: PathBuf) -> Option<Self> {
        let (side, kind) = path.file_name()?.to_str()?.strip_prefix("Camera_")?.split_once('_')?;
        let side = match side {
            "Left" => Side::Left,
            "Right" => Side::Right,
            "Down" => Side::Down,
            _ => return None,
        };
        let kind = match kind {
            "Gray" => Kind::Gray,
            "RGB" => Kind::Rgb,
            "Depth" => Kind::Depth,
            _ => return None,
        };
        path.is_dir().then_some(Self { kind, side, path })
    }

    /// The camera's name, `left_gray`.
    pub(crate) fn name(&self) -> String {
        let side = match self.side {
            Side::Left => "left",
            Side::Right => "right",
            Side::Down => "down",
        };
        let kind = match self.kind {
            Kind::Gray => "gray",
            Kind::Rgb => "rgb",
            Kind::Depth => "depth",
        };
        format!("{side}_{kind}")
    }
}

/// Whether a folder is a flight.
pub(crate) fn is_flight(path: &Path) -> bool {
    path.join(POSES).is_file()
}

/// Flights below a folder, sorted.
pub(crate) fn flights_below(path: &Path) -> Vec<PathBuf> {
    let mut flights = Vec::new();
    let mut level = vec![path.to_path_buf()];
    let mut looked_into = 0;
    for _ in 0..SEARCH_DEPTH {
        let mut next = Vec::new();
        for folder in level {
            looked_into += 1;
            if looked_into > SEARCH_FOLDERS {
                break;
            }
            let (found, others): (Vec<_>, Vec<_>) = folders(&folder).into_iter().partition(|f| is_flight(f));
            flights.extend(found);
            next.extend(others);
        }
        level = next;
    }
    flights.sort();
    flights
}

/// Environments of a flight by name, sorted.
pub(crate) fn environments(flight: &Path) -> Vec<String> {
    let with_cameras = folders(flight).into_iter().filter(|f| !cameras(f).is_empty());
    with_cameras.filter_map(|f| Some(f.file_name()?.to_str()?.to_string())).collect()
}

/// The environment that is asked for, else the first; `None` where the flight has none.
///
/// # Errors
/// [`DataError`] that lists the environments if there is no such one.
pub(crate) fn choose(flight: &Path, known: &[String], asked: Option<&str>) -> DataResult<Option<String>> {
    match asked {
        None => Ok(known.first().cloned()),
        Some(name) if known.iter().any(|k| k == name) => Ok(Some(name.to_string())),
        Some(name) => {
            let known = if known.is_empty() { "none".to_string() } else { known.join(", ") };
            Err(DataError::new(format!("the flight has no environment `{name}`"))
                .at(flight)
                .hint(format!("it has: {known}")))
        }
    }
}

/// Cameras of an environment in the order in which they are listed, depth cameras last.
pub(crate) fn cameras(environment: &Path) -> Vec<CameraFolder> {
    let mut cameras: Vec<_> = folders(environment).into_iter().filter_map(CameraFolder::from_path).collect();
    cameras.sort();
    cameras
}

/// Pictures in a folder in the order of their numbers; empty where there is no such folder.
///
/// Numbers are written with or without leading zeros, so shorter names go first.
pub(crate) fn pictures(folder: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let is_picture = |path: &PathBuf| {
        let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
        extension.is_some_and(|e| extensions.contains(&e.as_str()))
    };
    let mut pictures: Vec<_> = entries(folder).filter(is_picture).collect();
    pictures.sort_by_key(|p| (p.as_os_str().len(), p.clone()));
    pictures
}

/// Folders in a folder, sorted, without hidden ones.
fn folders(path: &Path) -> Vec<PathBuf> {
    let mut folders: Vec<_> = entries(path).filter(|p| p.is_dir()).collect();
    folders.sort();
    folders
}

fn entries(path: &Path) -> impl Iterator<Item = PathBuf> {
    let entries = std::fs::read_dir(path).into_iter().flatten().flatten();
    entries.filter(|e| !e.file_name().as_encoded_bytes().starts_with(b".")).map(|e| e.path())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn cameras_are_listed_gray_and_left_first() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["Down_Gray", "Left_RGB", "Left_Segmented", "Left_Depth", "Right_Gray", "Left_Gray", "x"]
        {
            fs::create_dir_all(folder.path().join("Room").join(format!("Camera_{name}"))).unwrap();
        }
        fs::create_dir_all(folder.path().join("csv")).unwrap();
        assert_eq!(environments(folder.path()), ["Room"]);
        let names: Vec<_> = cameras(&folder.path().join("Room")).iter().map(CameraFolder::name).collect();
        assert_eq!(names, ["left_gray", "right_gray", "down_gray", "left_rgb", "left_depth"]);
        let known = environments(folder.path());
        assert_eq!(choose(folder.path(), &known, None).unwrap().as_deref(), Some("Room"));
        let error = choose(folder.path(), &known, Some("Attic")).unwrap_err().to_string();
        assert!(error.contains("no environment `Attic` (it has: Room)"), "{error}");
        assert_eq!(choose(folder.path(), &[], None).unwrap(), None);
    }

    #[test]
    fn flights_are_found_at_their_depth_and_not_inside_each_other() {
        let folder = tempfile::tempdir().unwrap();
        let flight = |name: &str| {
            let path = folder.path().join(name);
            fs::create_dir_all(&path).unwrap();
            fs::write(path.join(POSES), b"").unwrap();
            path
        };
        let expected = [flight("oval/yawForward/maxSpeed1p0"), flight("star/yawConstant/maxSpeed2p0")];
        flight("star/yawConstant/maxSpeed2p0/copy");
        flight("a/b/c/d/e");
        flight(".hidden/yawConstant/maxSpeed2p0");
        assert_eq!(flights_below(folder.path()), expected);
        assert!(is_flight(&expected[0]) && !is_flight(folder.path()));
        #[cfg(unix)]
        {
            // A link to the root itself is walked into as deep as anything else, and no deeper.
            std::os::unix::fs::symlink(folder.path(), folder.path().join("loop")).unwrap();
            assert!(flights_below(folder.path()).len() >= 2);
        }
    }

    #[test]
    fn pictures_sort_by_number() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["10.png", "9.PNG", "notes.txt", ".9.png", "11.jpg"] {
            fs::write(folder.path().join(name), b"").unwrap();
        }
        let names = |extensions: &[&str]| -> Vec<String> {
            let pictures = pictures(folder.path(), extensions);
            pictures.iter().map(|p| p.file_name().unwrap().to_str().unwrap().to_string()).collect()
        };
        assert_eq!(names(&["png", "jpg"]), ["9.PNG", "10.png", "11.jpg"]);
        assert_eq!(names(&["png"]), ["9.PNG", "10.png"]);
        assert!(pictures(&folder.path().join("none"), &["png"]).is_empty());
    }
}

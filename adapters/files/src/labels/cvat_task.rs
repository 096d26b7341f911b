//! Which frame of the camera a frame number of CVAT is.
//!
//! A task need not hold all images: some were uploaded, or a video was taken from `start_frame` on with a step. CVAT
//! then writes the numbers of the video (`start_frame + step * k`); other exporters count the task's own. What the
//! task says of its size is compared with the camera: a number that is not the camera's would score other frames.

use std::collections::BTreeSet;

use roxmltree::Node;
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::suspicion::Suspicion;

/// What `<meta>` says of a task.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Task {
    id: String,
    name: String,
    /// Number of its frames.
    size: Option<usize>,
    start: usize,
    step: usize,
    /// Columns and rows of its images.
    pub(super) image_size_px: Option<[u32; 2]>,
}

/// How frame numbers become indices of the camera's frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FrameMap {
    /// They are the same.
    Same,
    /// The camera's frame `start + step * number`.
    Spread { start: usize, step: usize },
    /// The camera's frame `(number - start) / step`.
    Gathered { start: usize, step: usize },
}

impl FrameMap {
    /// The index of a frame number; `None` where it is none of the task's.
    pub(super) fn index(self, number: usize) -> Option<usize> {
        match self {
            Self::Same => Some(number),
            Self::Spread { start, step } => number.checked_mul(step)?.checked_add(start),
            Self::Gathered { start, step } => {
                let behind = number.checked_sub(start)?;
                (behind % step == 0).then_some(behind / step)
            }
        }
    }
}

/// The tasks of a file: one, or all those of a project.
pub(super) fn tasks(root: &Node<'_, '_>) -> DataResult<Vec<Task>> {
    let metas = root.children().filter(|n| n.has_tag_name("meta"));
    let nodes = metas.flat_map(|meta| meta.descendants()).filter(|n| {
        (n.has_tag_name("task") || n.has_tag_name("job"))
            && n.parent()
                .is_some_and(|p| p.has_tag_name("meta") || p.has_tag_name("tasks") || p.has_tag_name("jobs"))
    });
    nodes.map(|node| task(&node)).collect()
}

fn task(node: &Node<'_, '_>) -> DataResult<Task> {
    let text = |node: &Node<'_, '_>, name: &str| {
        let child = node.children().find(|n| n.has_tag_name(name))?;
        child.text().map(|t| t.trim().to_string()).filter(|t| !t.is_empty())
    };
    let number = |name: &str| -> DataResult<Option<usize>> {
        let Some(value) = text(node, name) else { return Ok(None) };
        value
            .parse()
            .map(Some)
            .map_err(|_| DataError::new(format!("<{name}> of the task is `{value}`, not a number")))
    };
    let filter = text(node, "frame_filter").unwrap_or_default();
    let step = match filter.split_once('=') {
        _ if filter.is_empty() => 1,
        Some((key, step)) if key.trim() == "step" => {
            step.trim().parse().ok().filter(|s| *s > 0).ok_or_else(|| {
                DataError::new(format!(
                    "<frame_filter> of the task is `{filter}`, not step=2 or another number"
                ))
            })?
        }
        _ => {
            return Err(DataError::of_kind(
                ErrorKind::Unsupported,
                format!("<frame_filter> of the task is `{filter}`: only step=N is read"),
            ));
        }
    };
    let side = |name: &str| {
        let size = node.children().find(|n| n.has_tag_name("original_size"))?;
        text(&size, name)?.parse::<u32>().ok()
    };
    Ok(Task {
        id: text(node, "id").unwrap_or_default(),
        name: text(node, "name").unwrap_or_default(),
        size: number("size")?,
        start: number("start_frame")?.unwrap_or(0),
        step,
        image_size_px: side("width").zip(side("height")).map(|(w, h)| [w, h]),
    })
}

/// The task that tracks belong to, by their `task_id`; `None` where the file describes none.
pub(super) fn used<'t>(tasks: &'t [Task], of_tracks: &BTreeSet<&str>) -> DataResult<Option<&'t Task>> {
    let named = |t: &&Task| of_tracks.is_empty() || of_tracks.contains(t.id.as_str());
    let found: Vec<&Task> = tasks.iter().filter(named).collect();
    match (found[..].first(), found.len().max(of_tracks.len())) {
        (None, _) => Ok(None),
        (Some(only), 1) => Ok(Some(only)),
        _ => {
            let names: Vec<String> = found.iter().map(|t| format!("`{}`", t.name)).collect();
            Err(DataError::of_kind(
                ErrorKind::Unsupported,
                format!(
                    "the tracks belong to {} tasks ({}), each of which counts its frames from 0",
                    found.len().max(of_tracks.len()),
                    names.join(", ")
                ),
            )
            .hint("export the task of this camera alone, not the project"))
        }
    }
}

/// How the task's numbers become the camera's, by the numbers that are used and how many frames the camera has.
pub(super) fn map(
    task: &Task,
    numbers: &BTreeSet<usize>,
    camera_frames: usize,
) -> DataResult<(FrameMap, Option<Suspicion>)> {
    let (start, step) = (task.start, task.step);
    let Some(size) = task.size.filter(|size| *size > 0) else { return Ok((FrameMap::Same, None)) };
    let mismatch = || {
        let stepped = match (start, step) {
            (0, 1) => String::new(),
            _ => format!(" (from frame {start} on, every {step})"),
        };
        let way = match camera_frames / size {
            n if n > 1 && camera_frames.div_ceil(n) == size && step == 1 => {
                format!(
                    "; where every {n}. image was uploaded, write <frame_filter>step={n}</frame_filter> into its <task>"
                )
            }
            _ => String::new(),
        };
        DataError::of_kind(
            ErrorKind::Contradictory,
            format!(
                "the task has {size} frames{stepped}, the camera {camera_frames}: its frame numbers are not the camera's"
            ),
        )
        .hint(format!("label a task of all images of the camera{way}"))
    };
    if start == 0 && step == 1 {
        return if size == camera_frames { Ok((FrameMap::Same, None)) } else { Err(mismatch()) };
    }
    let last = start + (size - 1) * step;
    let of_video = numbers.iter().all(|n| (start..=last).contains(n) && (n - start) % step == 0);
    let of_task = numbers.iter().all(|n| *n < size);
    let (all_images, task_only) = (last < camera_frames, size == camera_frames);
    match (of_video, of_task, all_images, task_only) {
        // The camera is the video.
        (true, in_doubt, true, _) => {
            let doubt = in_doubt.then(|| {
                Suspicion::new(
                    "frame-numbers",
                    "",
                    "frame numbers were taken for those of the video, not of the task",
                )
                .evidence(format!("start_frame {start}, step {step}; the numbers used fit both"))
            });
            Ok((FrameMap::Same, doubt.filter(|_| step > 1 || start > 0)))
        }
        (false, true, true, _) => Ok((FrameMap::Spread { start, step }, None)),
        // The camera has the task's frames only.
        (true, false, _, true) => Ok((FrameMap::Gathered { start, step }, None)),
        (false, true, _, true) => Ok((FrameMap::Same, None)),
        _ => Err(mismatch()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn task(size: usize, start: usize, step: usize) -> Task {
        Task { id: "1".into(), name: "t".into(), size: Some(size), start, step, image_size_px: None }
    }

    fn indices(task: &Task, numbers: &[usize], camera: usize) -> Result<Vec<usize>, String> {
        let set = numbers.iter().copied().collect();
        let (map, _) = map(task, &set, camera).map_err(|e| e.to_string())?;
        Ok(numbers.iter().map(|n| map.index(*n).unwrap()).collect())
    }

    #[test]
    fn numbers_are_those_of_the_video_or_of_the_task() {
        assert_eq!(indices(&task(20, 0, 1), &[0, 7, 19], 20).unwrap(), [0, 7, 19]);
        // CVAT writes the video's, others the task's.
        assert_eq!(indices(&task(10, 0, 2), &[0, 2, 18], 20).unwrap(), [0, 2, 18]);
        assert_eq!(indices(&task(10, 0, 2), &[0, 1, 9], 20).unwrap(), [0, 2, 18]);
        assert_eq!(indices(&task(5, 10, 2), &[10, 12, 18], 20).unwrap(), [10, 12, 18]);
        assert_eq!(indices(&task(5, 10, 2), &[0, 1, 4], 20).unwrap(), [10, 12, 18]);
        // The camera's frames are the task's.
        assert_eq!(indices(&task(5, 10, 2), &[10, 12, 18], 5).unwrap(), [0, 1, 4]);
        assert_eq!(indices(&task(10, 0, 3), &[0, 1, 9], 10).unwrap(), [0, 1, 9]);
        assert_eq!(indices(&task(10, 10, 1), &[10, 19], 20).unwrap(), [10, 19], "a job of a task");
    }

    #[test]
    fn other_numbers_of_frames_are_refused_with_both() {
        for (size, camera) in [(10, 20), (20, 10), (19, 20)] {
            let error = indices(&task(size, 0, 1), &[0, 5], camera).unwrap_err();
            assert!(error.contains(&format!("the task has {size} frames, the camera {camera}")), "{error}");
        }
        let error = indices(&task(10, 0, 1), &[0, 9], 20).unwrap_err();
        assert!(error.contains("<frame_filter>step=2</frame_filter>"), "{error}");
        assert!(indices(&task(10, 0, 2), &[0, 1, 18], 20).is_err(), "neither the video's nor the task's");
        assert!(indices(&task(10, 0, 3), &[0, 3], 20).is_err(), "the video has more frames than the camera");
    }
}

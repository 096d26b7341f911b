//! Undo and redo without limit.

use super::document::Cell;

/// What a change came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum By {
    /// A person's edit.
    Edit,
    /// The image tracker.
    Track,
    /// A detector of targets.
    Detect,
    /// A file that was read in.
    Import,
    /// Taking a step back.
    Undo,
    /// Taking it again.
    Redo,
}

/// One step that can be undone.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// What it was.
    pub label: String,
    /// The cells, in the order in which they were carried out.
    pub cells: Vec<Cell>,
    /// The job that it belongs to: what a job does in parts is one step.
    pub job: Option<u64>,
}

/// The steps that were made, and how many of them hold now.
#[derive(Clone, Debug, Default)]
pub struct History {
    steps: Vec<Step>,
    made: usize,
}

impl History {
    /// Adds a step; what was undone before it can no longer be redone. A part of the job whose step is the last one
    /// becomes part of that step.
    pub fn push(&mut self, step: Step) {
        self.steps.truncate(self.made);
        match self.steps.last_mut() {
            Some(last) if step.job.is_some() && last.job == step.job => last.cells.extend(step.cells),
            _ => self.steps.push(step),
        }
        self.made = self.steps.len();
    }

    /// The step that undo would take back.
    pub fn to_undo(&self) -> Option<&Step> {
        self.made.checked_sub(1).map(|i| &self.steps[i])
    }

    /// The step that redo would make again.
    pub fn to_redo(&self) -> Option<&Step> {
        self.steps.get(self.made)
    }

    /// Notes that the last step was taken back.
    pub fn undone(&mut self) {
        self.made = self.made.saturating_sub(1);
    }

    /// Notes that the step after was made again. A job's step is closed by that: nothing more is added to it.
    pub fn redone(&mut self) {
        if let Some(step) = self.steps.get_mut(self.made) {
            step.job = None;
            self.made += 1;
        }
    }
}

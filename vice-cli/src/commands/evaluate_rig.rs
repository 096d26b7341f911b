//! `vice evaluate` of several cameras.

use std::path::PathBuf;

use vice_run::open::Opened;
use vice_run::report::html::{IMAGE_BUDGET_BYTES, Run, render};
use vice_run::request::Request;
use vice_run::result::ResultDocument;
use vice_run::rig::{Rig, RigDocument};

use super::report::{PageArgs, run_of, warn_of_pictures};
use crate::outputs::Outputs;
use crate::terminal::{self, Verbosity, printable, with_progress};

/// What is written beside the table.
pub(super) struct Files<'a> {
    pub(super) json: &'a Option<PathBuf>,
    pub(super) csv: &'a Option<PathBuf>,
    pub(super) latex: &'a Option<PathBuf>,
    pub(super) report: &'a Option<PathBuf>,
    pub(super) page: &'a PageArgs,
    /// Whether the document lists the samples.
    pub(super) samples: bool,
}

/// Evaluates each camera and all together, and writes what is asked for.
pub(super) fn run(
    request: &Request,
    each: Vec<Request>,
    files: &Files<'_>,
    verbosity: Verbosity,
) -> anyhow::Result<RigDocument> {
    let inputs: Vec<PathBuf> = each.iter().flat_map(Request::inputs).collect();
    let outputs = Outputs::new(&[files.json, files.csv, files.latex, files.report], &inputs)?;
    let rig = Rig::open(request, each)?;
    let keep = files.report.is_some() || (files.samples && files.json.is_some());
    let mut document = with_progress(verbosity, |progress| rig.evaluate(keep, progress))?;
    let page = match files.report {
        Some(path) => {
            let budget = IMAGE_BUDGET_BYTES / document.cameras.len().max(1);
            let of_camera = |(one, (request, opened)): (&ResultDocument, &(Request, Opened))| {
                let mut run = run_of(one.clone(), request, opened, budget, files.page, verbosity);
                warn_of_pictures(&run, path);
                run.name = format!("{}: {}", run.name, printable(&opened.camera_name));
                run
            };
            let runs: Vec<Run> = document.cameras.iter().zip(&rig.cameras).map(of_camera).collect();
            Some((path, render(&runs)?))
        }
        None => None,
    };
    if !files.samples {
        document.drop_samples();
    }
    let csv = files.csv.as_ref().map(|path| document.csv().map(|text| (path, text))).transpose()?;
    let latex = files.latex.as_ref().map(|path| document.latex().map(|text| (path, text))).transpose()?;
    let texts: Vec<(&PathBuf, String)> = [csv, latex, page].into_iter().flatten().collect();
    let json_printed = files.json.as_ref().map_or(Ok(false), |path| outputs.write_json(path, &document))?;
    let in_a_file = files.json.is_some() && verbosity.is_quiet();
    if !(outputs.write(&texts)? || json_printed || in_a_file) {
        terminal::print(&document.table())?;
    } else {
        terminal::warn(document.cameras.iter().flat_map(|d| d.suspicions.iter()));
    }
    Ok(document)
}

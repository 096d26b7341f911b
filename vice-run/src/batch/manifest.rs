//! A manifest: what a batch is to evaluate.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde_json::Value;
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_files::address;

use super::cells::{Cells, RawRow, wrong};
use super::field::{self, Cell, DATASET, ESTIMATOR, FLIGHT, GROUP, RUN_ID};
use super::{csv_rows, glob, parquet_rows, toml_rows};
use crate::error::RunResult;
use crate::request::Request;

/// What is to be evaluated.
#[derive(Clone, Debug)]
pub struct Manifest {
    /// The file.
    pub path: PathBuf,
    /// The folder that its paths are relative to.
    pub base: PathBuf,
    /// The runs, in the order of the file; those of a wildcard sorted by path.
    pub rows: Vec<Row>,
}

/// One run.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Its name, of which there is one only.
    pub run_id: String,
    /// What it stands under in a table; may be empty.
    pub group: String,
    /// The flight that it stands under in a table: its own name, unless several runs are one flight's.
    pub flight: String,
    /// Whose the estimates are, in their order, or one for all; empty where the streams' names say it.
    pub estimators: Vec<String>,
    /// What is asked, with paths as the manifest has them.
    pub request: Request,
    /// The line of the manifest.
    pub line: u64,
}

impl Manifest {
    /// Reads a manifest: TOML, CSV or Parquet by the ending of its name.
    ///
    /// # Errors
    /// [`DataError`] with path and line for what cannot be read, columns that are not known, values that are none,
    /// wildcards that stand for nothing, and names that are there twice.
    pub fn read(path: impl AsRef<Path>) -> RunResult<Self> {
        let path = path.as_ref();
        Ok(Self::parse_file(path).map_err(|e| e.at(path))?)
    }

    fn parse_file(path: &Path) -> DataResult<Self> {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
        let (defaults, raw) = match ending.as_str() {
            "toml" => toml_rows::read(&text_of(path)?)?,
            "csv" => csv_rows::read(&text_of(path)?)?,
            "parquet" => parquet_rows::read(path)?,
            _ => {
                return Err(DataError::of_kind(ErrorKind::Usage, "is no manifest by its name")
                    .hint("name it .toml, .csv or .parquet"));
            }
        };
        let base = path.parent().map(Path::to_path_buf).unwrap_or_default();
        let mut rows = Vec::new();
        for row in raw {
            rows.extend(runs(&base, &defaults, &row)?);
        }
        if rows.is_empty() {
            return Err(DataError::of_kind(ErrorKind::Usage, "holds no run"));
        }
        if let Some(other) = rows
            .iter()
            .find(|row| row.request.depth.is_triangulated() != rows[0].request.depth.is_triangulated())
        {
            let problem = "triangulated depth cannot stand beside other depths in one table: it takes a part of the error for depth";
            return Err(wrong(other.line, problem).hint("make a batch of its own of these runs"));
        }
        let mut names = BTreeSet::new();
        for row in &rows {
            if !names.insert(row.run_id.as_str()) {
                return Err(wrong(row.line, format!("there is another run `{}`", row.run_id))
                    .hint("give each a run_id of its own; {name} in it is the data set's"));
            }
        }
        Ok(Self { path: path.to_path_buf(), base, rows })
    }
}

fn text_of(path: &Path) -> DataResult<String> {
    std::fs::read_to_string(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => DataError::of_kind(ErrorKind::Missing, "no such file"),
        _ => DataError::new("cannot be read as text").because(e),
    })
}

/// The runs of a row: one, or one for each path that its wildcard stands for.
fn runs(base: &Path, defaults: &Cells, row: &RawRow) -> DataResult<Vec<Row>> {
    let cells = defaults.overlaid(&row.cells);
    let dataset = cells.text(DATASET)?.ok_or_else(|| wrong(row.line, "names no dataset"))?;
    let datasets = match glob::is_glob(&dataset) && !base.join(&dataset).exists() {
        false => vec![dataset],
        true => {
            let found = glob::expand(base, &dataset);
            if found.is_empty() {
                return Err(wrong(row.line, format!("dataset {dataset} stands for nothing that is there")));
            }
            found.iter().map(|p| p.to_string_lossy().into_owned()).collect()
        }
    };
    datasets.iter().map(|dataset| one(&cells, dataset, row.line)).collect()
}

fn one(cells: &Cells, dataset: &str, line: u64) -> DataResult<Row> {
    let shown = address::shown(dataset);
    let name = Path::new(&*shown).file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let filled = |text: &str| text.replace("{dataset}", &shown).replace("{name}", &name);
    let mut fields = field::start();
    for (place, (cell, at)) in
        cells.iter().filter(|(p, _)| ![RUN_ID, GROUP, FLIGHT, ESTIMATOR, DATASET].contains(&p.as_str()))
    {
        field::put(&mut fields, place, &cell.map(filled))
            .map_err(|e| wrong(*at, format!("{}: {e}", field::option(place))))?;
    }
    field::put(&mut fields, DATASET, &Cell::Text(dataset.to_string())).map_err(|e| wrong(line, e))?;
    let request: Request =
        serde_json::from_value(Value::Object(fields)).map_err(|e| wrong(line, e.to_string()))?;
    request.check().map_err(|e| wrong(line, e.to_string()))?;
    let run_id = filled(&cells.text(RUN_ID)?.unwrap_or_else(|| "{dataset}".to_string()));
    let estimators = cells.get(ESTIMATOR).map_or_else(Vec::new, |cell| cell.map(filled).parts());
    let estimates = request.streams.estimates.len();
    if estimators.len() > 1 && estimators.len() != estimates {
        let problem = format!("{} names for {estimates} estimates", estimators.len());
        return Err(wrong(line, format!("{ESTIMATOR}: {problem}")).hint("give one for each, or one for all"));
    }
    Ok(Row {
        flight: filled(&cells.text(FLIGHT)?.unwrap_or_else(|| run_id.clone())),
        run_id,
        estimators,
        group: filled(&cells.text(GROUP)?.unwrap_or_default()),
        request,
        line,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(name: &str, text: &str) -> Result<Vec<Row>, String> {
        let folder = tempfile::tempdir().unwrap();
        for run in ["flights/one", "flights/two"] {
            std::fs::create_dir_all(folder.path().join(run)).unwrap();
        }
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let rows = Manifest::read(&path).map(|m| m.rows);
        rows.map_err(|e| e.to_string().replace(&format!("{}/", folder.path().display()), ""))
    }

    #[test]
    fn csv_and_toml_say_the_same() {
        let csv = "run_id,group,dataset,labels,estimate,fps,max-gap\n\
                   defaults,g,,l.csv,\"a,b.txt\",10,\n\
                   x,,d,,,,0.2\n";
        let toml = "[defaults]\ngroup = \"g\"\nlabels = \"l.csv\"\nestimate = [\"a\", \"b.txt\"]\nfps = 10\n\
                    [[run]]\nrun_id = \"x\"\ndataset = \"d\"\nstreams = { max_gap_s = 0.2 }\n";
        let (csv, toml) = (read("m.csv", csv).unwrap(), read("m.toml", toml).unwrap());
        assert_eq!(csv[0].request, toml[0].request);
        assert_eq!((csv[0].run_id.as_str(), csv[0].group.as_str(), csv[0].line), ("x", "g", 3));
        assert_eq!((csv[0].request.streams.estimates.len(), csv[0].request.protocol.fps), (2, Some(10.0)));
    }

    #[test]
    fn a_wildcard_is_a_run_for_each() {
        let rows = read("m.csv", "run_id,dataset,labels\n{name}-1,flights/*,{dataset}/l.csv\n").unwrap();
        assert_eq!(rows.iter().map(|r| r.run_id.as_str()).collect::<Vec<_>>(), ["one-1", "two-1"]);
        assert_eq!(rows[1].request.labels.file, Path::new("flights/two/l.csv"));
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        let error = |name: &str, text: &str| read(name, text).unwrap_err();
        assert!(error("m.csv", "dataset,fsp\nd,\n").starts_with("m.csv:1: there is no column `fsp`"));
        assert_eq!(error("m.csv", "dataset,fps\n\nd,ten\n"), "m.csv:3: fps: `ten` is no number");
        assert!(error("m.csv", "dataset,fps\nd\n").starts_with("m.csv:2: has 1 cells under 2 columns"));
        assert!(error("m.csv", "dataset,align\nd,up\n").starts_with("m.csv:2: align: unknown variant `up`"));
        assert!(error("m.csv", "dataset,zcam-range\nd,\"1,2\"\n").starts_with("m.csv:2: zcam-range: "));
        assert!(
            error("m.csv", "dataset,depth\nd,floor\ne,triangulated\n")
                .starts_with("m.csv:3: triangulated depth cannot stand beside other depths")
        );
        assert!(error("m.csv", "dataset\nd\nd\n").starts_with("m.csv:3: there is another run `d`"));
        assert!(error("m.csv", "dataset\nno/*\n").starts_with("m.csv:2: dataset no/* stands for nothing"));
        assert!(error("m.toml", "\n[[run]]\nfsp = 1\n").starts_with("m.toml:3: there is no column `fsp`"));
        assert!(error("m.toml", "[[run]\n").starts_with("m.toml:1: is no TOML"));
        assert!(error("m.toml", "[run]\n").starts_with("m.toml:1: `run` is not known"));
        assert!(
            error("m.txt", "")
                .starts_with("m.txt: is no manifest by its name (name it .toml, .csv or .parquet)")
        );
        assert!(error("m.csv", "dataset\n").starts_with("m.csv: holds no run"));
    }
}

//! The scripts for clusters, run with what a scheduler puts into the environment.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use vice_tests::{Run, vice_in, vice_program};

fn cluster(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../examples/cluster").join(name)
}

/// A program that says what it was asked for.
fn echo(folder: &std::path::Path) -> PathBuf {
    let program = folder.join("vice");
    fs::write(&program, "#!/bin/sh\necho \"$*\"\n").unwrap();
    let status = Command::new("chmod").arg("+x").arg(&program).status().unwrap();
    assert!(status.success());
    program
}

fn run_shard(program: &std::path::Path, environment: &[(&str, &str)]) -> Run {
    let mut command = Command::new(cluster("run_shard.sh"));
    for name in
        ["SLURM_ARRAY_TASK_ID", "JOB_COMPLETION_INDEX", "AWS_BATCH_JOB_ARRAY_INDEX", "BATCH_TASK_INDEX"]
    {
        command.env_remove(name);
    }
    command.env("VICE", program).args(["m.csv", "out", "--jobs", "2"]);
    command.envs(environment.iter().copied()).output().unwrap().into()
}

#[test]
fn each_scheduler_says_which_part_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let program = echo(folder.path());
    let slurm = |id: &'static str, min: &'static str, step: &'static str| {
        [
            ("SLURM_ARRAY_TASK_ID", id),
            ("SLURM_ARRAY_TASK_MIN", min),
            ("SLURM_ARRAY_TASK_STEP", step),
            ("SLURM_ARRAY_TASK_COUNT", "16"),
        ]
    };
    let part = |environment: &[(&str, &str)]| {
        let run = run_shard(&program, environment);
        assert_eq!(run.code, 0, "{}", run.stderr);
        run.stdout.trim().to_string()
    };
    let asked = |part: &str| format!("batch m.csv --out out --shard {part}/16 --jobs 2");
    assert_eq!(part(&slurm("0", "0", "1")), asked("1"));
    assert_eq!(part(&slurm("16", "1", "1")), asked("16"));
    assert_eq!(part(&slurm("14", "10", "2")), asked("3"));
    assert_eq!(part(&[("JOB_COMPLETION_INDEX", "15"), ("SHARDS", "16")]), asked("16"));
    assert_eq!(part(&[("AWS_BATCH_JOB_ARRAY_INDEX", "2"), ("SHARDS", "16")]), asked("3"));
    assert_eq!(part(&[("BATCH_TASK_INDEX", "4"), ("BATCH_TASK_COUNT", "16")]), asked("5"));
    let run = run_shard(&program, &[("JOB_COMPLETION_INDEX", "1")]);
    assert!(run.code != 0 && run.stderr.contains("set SHARDS"), "{}", run.stderr);
    let run = run_shard(&program, &[]);
    assert!(run.code == 2 && run.stderr.contains("no scheduler says"), "{}", run.stderr);
}

#[test]
fn the_parts_of_a_slurm_array_make_the_batch() {
    let folder = tempfile::tempdir().unwrap();
    let run = vice_in(folder.path(), &["synth", "flight", "--duration", "2", "--rate", "5"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let mut text = String::from("run_id,dataset,labels,estimate,start\n");
    (0..5).for_each(|k| text.push_str(&format!("r{k},flight,flight/labels/floor.csv,imu-euler,0.{k}\n")));
    fs::write(folder.path().join("m.csv"), text).unwrap();
    for part in ["2", "0", "1"] {
        let run: Run = Command::new("sh")
            .arg(cluster("slurm.sbatch"))
            .current_dir(folder.path())
            .env("VICE", vice_program())
            .env("SLURM_SUBMIT_DIR", cluster(""))
            .envs([("MANIFEST", "m.csv"), ("OUT", "parts"), ("SLURM_CPUS_PER_TASK", "1")])
            .envs([
                ("SLURM_ARRAY_TASK_ID", part),
                ("SLURM_ARRAY_TASK_MIN", "0"),
                ("SLURM_ARRAY_TASK_COUNT", "3"),
            ])
            .output()
            .unwrap()
            .into();
        assert_eq!(run.code, 0, "{}", run.stderr);
    }
    assert_eq!(vice_in(folder.path(), &["batch", "m.csv", "--out", "whole"]).code, 0);
    let results = |out: &str| {
        assert_eq!(vice_in(folder.path(), &["batch", "collect", out]).code, 0);
        fs::read_to_string(folder.path().join(out).join("results.csv")).unwrap()
    };
    assert_eq!(results("parts"), results("whole"));
    assert!(!results("parts").contains("missing"));
    // The files for other schedulers start the same script with the same arguments.
    for name in ["kubernetes.yaml", "google_batch.json"] {
        let text = fs::read_to_string(cluster(name)).unwrap();
        assert!(text.contains("run_shard.sh") && text.contains("--jobs"), "{name}");
    }
}

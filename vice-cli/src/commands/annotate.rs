//! `vice annotate`: labels in the browser.

use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv4Addr};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::Context;
use vice_annotate::desk::Desk;
use vice_annotate::server::{ServerOptions, serve};
use vice_run::request::{LabelsSpec, Request};

use crate::doorway::Doorway;
use crate::inputs::{DatasetArgs, DepthArgs, StreamArgs, WindowArgs};
use crate::terminal::{self, Outcome, Verbosity, usage};

/// Arguments of `vice annotate`.
#[derive(Debug, clap::Args)]
#[command(
    mut_arg("estimate", |a| a.required(false)),
    mut_arg("fps", |a| a.help("Label the frame nearest to each tick of this rate [default: every frame]")),
    after_help = "Examples:\n  \
    vice annotate V1_01_easy --labels floor.json --fps 10 --duration 30\n  \
    vice annotate my_run --labels my.json --estimate openvins.txt --depth zmap --no-open\n  \
    vice annotate V1_01_easy --labels floor.json --fps 10 --review 30\n\n\
    Labels are on the disk before the page says so; Ctrl-C ends the program. A CSV is not written over: its labels go \
    on in a JSON beside it. What was done is kept in FILE.json.journal, with all steps for undo. \
    In the page `?` shows the keys."
)]
pub(crate) struct Args {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Labels, made with the first point where they are not there yet.
    #[arg(long, value_name = "FILE", help_heading = "Labels")]
    labels: PathBuf,
    #[command(flatten)]
    window: WindowArgs,
    #[command(flatten)]
    streams: StreamArgs,
    /// Depth source of dots and suggestions: floor, zmap, zcam, mesh, tag, stereo [default: floor].
    #[arg(long, value_name = "SOURCE", help_heading = "Depth")]
    depth: Option<String>,
    #[command(flatten)]
    depth_options: DepthArgs,
    /// Review instead of label: this many observations, drawn evenly, are placed anew by someone who does not see where they were.
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "40", help_heading = "Labels",
        value_parser = clap::value_parser!(u32).range(1..=100_000))]
    review: Option<u32>,
    #[command(flatten)]
    server: ServerArgs,
}

/// How the page is reached.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Page")]
struct ServerArgs {
    /// Port to listen on; 0 takes a free one.
    #[arg(long, default_value = "0")]
    port: u16,
    /// Address to listen on, where others shall reach the page; needs --insecure beyond this machine.
    #[arg(long, value_name = "ADDR", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    bind: IpAddr,
    /// Let --bind serve other machines without encryption.
    #[arg(long)]
    insecure: bool,
    /// Print an address of the page only; do not open a browser.
    #[arg(long)]
    no_open: bool,
    /// Keys for actions, as JSON: {"next-frame": ["e", "pagedown"]}; the page's help lists the actions.
    #[arg(long, value_name = "FILE")]
    keys: Option<PathBuf>,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let keys = keys(args)?;
    let names: Vec<String> = args.depth.iter().cloned().collect();
    let depth = args.depth_options.spec("--depth", &names)?;
    if depth.sources.len() > 1 {
        return Err(usage("--depth: the annotator takes one depth source"));
    }
    let request = Request {
        dataset: args.depth_options.dataset(&args.dataset),
        labels: LabelsSpec { file: args.labels.clone(), ..LabelsSpec::default() },
        protocol: args.window.spec(),
        streams: args.streams.spec()?,
        depth,
        ..Request::default()
    };
    if !args.server.bind.is_loopback() {
        if !args.server.insecure {
            return Err(usage(format!(
                "--bind {}: others could reach the page there, and nothing is encrypted: tunnel to it instead (ssh -L \
                 8080:localhost:PORT), or add --insecure in a network that you trust",
                args.server.bind
            )));
        }
        tracing::warn!(
            "--bind {}: whoever listens on the way sees the images and can change the labels: nothing is encrypted",
            args.server.bind
        );
    }
    let desk = Desk::open(&request)?;
    if let Some(reason) = desk.read_only().filter(|_| args.review.is_none()) {
        tracing::warn!(
            "{}: {reason}; the labels are shown, but cannot be changed",
            desk.labels_file().display()
        );
    }
    let review = args.review.map(|n| n as usize);
    let options = ServerOptions { bind: args.server.bind, port: args.server.port, keys, review };
    let folder = desk.labels_file().parent().map(Path::to_path_buf).unwrap_or_default();
    let summary = serve(desk, &options, |invitations| {
        let printed = invitations.url()?;
        // A closed standard output is no reason to end.
        let _ = terminal::print(&format!("{printed}\n"));
        verbosity.note("This address opens the page once; the next one is printed then. Ctrl-C ends.");
        let doorway = if args.server.no_open { None } else { Doorway::open(&folder, &invitations.url()?) };
        let (more, state) = (invitations.clone(), Mutex::new((printed, doorway)));
        invitations.on_use(move |used| {
            let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
            if state.0 != used {
                state.1 = None;
            } else if let Ok(next) = more.url() {
                verbosity.note(&format!("To open it in another browser: {next}"));
                state.0 = next;
            }
        });
        Ok(())
    })?;
    if let Some(summary) = summary {
        terminal::print(&format!("{}\n", summary.text()))?;
    }
    Ok(Outcome::Done)
}

fn keys(args: &Args) -> anyhow::Result<BTreeMap<String, Vec<String>>> {
    let Some(path) = &args.server.keys else { return Ok(BTreeMap::new()) };
    let shown = || path.display().to_string();
    let text = std::fs::read_to_string(path).with_context(shown)?;
    serde_json::from_str(&text)
        .with_context(|| format!("{}: expected keys by action, such as {{\"next-frame\": [\"e\"]}}", shown()))
}

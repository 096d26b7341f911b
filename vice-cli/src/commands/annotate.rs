//! `vice annotate`: labels in the browser.

use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;

use anyhow::Context;
use vice_annotate::desk::Desk;
use vice_annotate::server::{ServerOptions, serve};
use vice_run::request::{LabelsSpec, Request};

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
    Labels are on the disk before the page says so; Ctrl-C ends the program. A CSV is not written over: its labels go\n\
    on in a JSON beside it. What was done is kept in FILE.json.journal, with all steps for undo.\n\
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
    /// Address to listen on, where others shall reach the page.
    #[arg(long, value_name = "ADDR", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    bind: IpAddr,
    /// Print the page's address only; do not open a browser.
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
    let desk = Desk::open(&request)?;
    if let Some(reason) = desk.read_only().filter(|_| args.review.is_none()) {
        tracing::warn!(
            "{}: {reason}; the labels are shown, but cannot be changed",
            desk.labels_file().display()
        );
    }
    if !args.server.bind.is_loopback() {
        tracing::warn!(
            "--bind {}: whoever reaches this address and learns the token can see the images and change the labels, and \
             nothing is encrypted",
            args.server.bind
        );
    }
    let review = args.review.map(|n| n as usize);
    let options = ServerOptions { bind: args.server.bind, port: args.server.port, keys, review };
    let summary = serve(desk, &options, |url| {
        // A closed standard output is no reason to end.
        let _ = terminal::print(&format!("{url}\n"));
        verbosity.note("Open this address in a browser on this machine; Ctrl-C ends.");
        if !args.server.no_open
            && let Err(error) = open::that_detached(url)
        {
            tracing::warn!("no browser could be opened ({error}): open the address above by hand");
        }
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

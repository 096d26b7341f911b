//! What a point costs from what fits the caches to what does not, with one thread and two, beside the machine's limit.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use vice_core::statistics::sorted;

use crate::table::{significant, spread};

/// One measurement: the kernel, and the limit measured beside it, nanoseconds a point.
#[derive(Clone, Copy, Debug)]
struct Cost {
    kernel_ns: f64,
    limit_ns: f64,
}

/// Costs by kernel, points and threads, one a round.
#[derive(Default)]
pub(crate) struct Sizes(BTreeMap<String, BTreeMap<usize, BTreeMap<usize, Vec<Cost>>>>);

impl Sizes {
    /// Adds a round's measurement: points a second, and which part of the machine's limit that is.
    pub(crate) fn add(
        &mut self,
        kernel: &str,
        points: usize,
        threads: usize,
        per_second: f64,
        fraction: f64,
    ) {
        let kernel_ns = 1e9 / per_second;
        let by_points = self.0.entry(kernel.to_string()).or_default();
        let costs = by_points.entry(points).or_default().entry(threads).or_default();
        costs.push(Cost { kernel_ns, limit_ns: kernel_ns * fraction });
    }

    /// The table, in Markdown.
    pub(crate) fn render(&self) -> String {
        let mut text = "| kernel | points | ns a point | part of the limit | two threads against one | what the limit gains by two |\n\
                        | --- | --- | --- | --- | --- | --- |\n"
            .to_string();
        let mut flatness = String::new();
        for (kernel, by_points) in &self.0 {
            let mut range = [(f64::INFINITY, 0.0_f64); 2];
            for (points, by_threads) in by_points {
                let Some(one) = by_threads.get(&1).filter(|costs| !costs.is_empty()) else { continue };
                let two = by_threads.get(&2).map_or(&[][..], Vec::as_slice);
                let best = |of: fn(&Cost) -> f64| one.iter().map(of).fold(f64::INFINITY, f64::min);
                let gain = |of: fn(&Cost) -> f64| {
                    spread(&sorted(one.iter().zip(two).map(|(a, b)| of(a) / of(b)).collect()))
                };
                let costs = [best(|c| c.kernel_ns), best(|c| c.limit_ns)];
                for ((least, most), cost) in range.iter_mut().zip(costs) {
                    (*least, *most) = (least.min(cost), most.max(cost));
                }
                let _ = writeln!(
                    text,
                    "| {kernel} | {points} | {} | {} | {} | {} |",
                    significant(costs[0]),
                    spread(&sorted(one.iter().map(|c| c.limit_ns / c.kernel_ns).collect())),
                    gain(|c| c.kernel_ns),
                    gain(|c| c.limit_ns),
                );
            }
            let [ours, limit] = range.map(|(least, most)| most / least);
            let _ = writeln!(
                flatness,
                "- {kernel}: its dearest point costs {ours:.2} times its cheapest, that of its limit {limit:.2} times"
            );
        }
        format!("{text}\n{flatness}")
    }
}

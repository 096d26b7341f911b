//! Which frames hang on nothing, and how many hang on them: each frame is gone up from once.

use std::collections::{BTreeMap, HashMap};

/// Each root with the number of `children` under it, by the parent of each; about two questions a frame.
///
/// # Errors
/// A frame of a cycle, or that leads into one.
pub(super) fn count<'a>(
    children: impl Iterator<Item = &'a str>,
    mut parent_of: impl FnMut(&str) -> Option<&'a str>,
) -> Result<BTreeMap<&'a str, usize>, &'a str> {
    /// A frame that was met: on the way that is being gone, or under a root.
    enum Met<'a> {
        OnTheWay,
        Under(&'a str),
    }
    let mut roots: BTreeMap<&str, usize> = BTreeMap::new();
    let mut met: HashMap<&str, Met<'_>> = HashMap::new();
    let mut way = Vec::new();
    for frame in children {
        let mut at = frame;
        let root = loop {
            match met.get(at) {
                Some(Met::Under(root)) => break *root,
                Some(Met::OnTheWay) => return Err(at),
                None => {}
            }
            let Some(parent) = parent_of(at) else { break at };
            met.insert(at, Met::OnTheWay);
            way.push(at);
            at = parent;
        };
        met.extend(way.drain(..).map(|frame| (frame, Met::Under(root))));
        *roots.entry(root).or_default() += 1;
    }
    Ok(roots)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The roots, and how many parents were asked for.
    fn counted(edges: &[(String, String)]) -> (Result<BTreeMap<&str, usize>, &str>, usize) {
        let parents: HashMap<&str, &str> = edges.iter().map(|(p, c)| (c.as_str(), p.as_str())).collect();
        let mut asked = 0;
        let found = count(edges.iter().map(|(_, child)| child.as_str()), |frame| {
            asked += 1;
            parents.get(frame).copied()
        });
        (found, asked)
    }

    fn edge(parent: &str, child: usize) -> (String, String) {
        (parent.to_string(), format!("f{child}"))
    }

    #[test]
    fn thousands_of_frames_are_gone_up_once_each() {
        const N: usize = 20_000;
        let down: Vec<_> = (0..N).map(|i| edge(&format!("f{}", i + 1), i)).collect();
        let up: Vec<_> = down.iter().rev().cloned().collect();
        for chain in [down, up] {
            let (roots, asked) = counted(&chain);
            assert_eq!(roots.unwrap(), BTreeMap::from([("f20000", N)]));
            assert!(asked <= 2 * N, "{asked} questions");
        }
        // Chains of a hundred, each on a root of its own, and a star.
        let forest: Vec<_> = (0..N)
            .map(|i| match i % 100 {
                0 => edge(&format!("r{}", i / 100), i),
                _ => edge(&format!("f{}", i - 1), i),
            })
            .collect();
        let (roots, asked) = counted(&forest);
        let roots = roots.unwrap();
        assert!(roots.len() == N / 100 && roots.values().all(|n| *n == 100) && asked <= 2 * N);
        let star: Vec<_> = (0..N).map(|i| edge("hub", i)).collect();
        let (roots, asked) = counted(&star);
        assert!(roots.unwrap()["hub"] == N && asked <= 2 * N, "{asked} questions");
    }

    #[test]
    fn a_cycle_is_found_from_wherever_it_is_met() {
        const N: usize = 20_000;
        // A long tail that leads into a ring, which is met from the end of the tail first.
        let mut ring: Vec<_> = (0..N).map(|i| edge(&format!("f{}", i + 1), i)).collect();
        ring.push((format!("f{}", N - 10), format!("f{N}")));
        let (found, asked) = counted(&ring);
        let frame: usize = found.unwrap_err()[1..].parse().unwrap();
        assert!((N - 10..=N).contains(&frame) && asked <= 2 * N, "{frame}, {asked} questions");
    }
}

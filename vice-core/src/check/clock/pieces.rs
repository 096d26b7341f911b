//! Stretches of time over which both sources turn.

use nalgebra::Vector3;

use super::super::turning::Turning;

/// Shortest stretch, seconds: noise of the orientations counts less the longer it is, and the motion of hands, wheels and
/// propellers that tells two moments apart is faster than a few hertz.
const LEAST_S: f64 = 0.1;
/// Longest one, seconds: over more than that a robot turns back, and the turn says little of when.
const MOST_S: f64 = 1.05;

/// Stretches between orientations of the sparser source, and its turn rate over each.
pub(in super::super) struct Pieces {
    /// Ends in seconds since the source's origin.
    pub(in super::super) ends: Vec<(f64, f64)>,
    /// Mean turn rates in its own body, rad/s.
    pub(in super::super) rates: Vec<Vector3<f64>>,
}

impl Pieces {
    /// Neighbouring stretches, each as short as the source allows.
    pub(in super::super) fn of(source: &Turning) -> Self {
        let times = source.times();
        let most = MOST_S.max(2.0 * source.spacing_s());
        let mut nodes = vec![times[0]];
        for t in times {
            if t - nodes[nodes.len() - 1] >= LEAST_S - 1e-6 {
                nodes.push(*t);
            }
        }
        let known = source.at(nodes.iter().copied());
        let mut pieces = Self { ends: Vec::new(), rates: Vec::new() };
        for i in 1..nodes.len() {
            let dt = nodes[i] - nodes[i - 1];
            // The source's own gaps are its stretches here, where they are short enough.
            let (Some((a, gaps_a)), Some((b, gaps_b))) = (&known[i - 1], &known[i]) else { continue };
            if dt <= most && (source.bridges_gaps() || gaps_a == gaps_b) {
                pieces.ends.push((nodes[i - 1], nodes[i]));
                pieces.rates.push(crate::frames::rotation_vector_rad(&(a.inverse() * b)) / dt);
            }
        }
        pieces
    }

    pub(in super::super) fn len(&self) -> usize {
        self.ends.len()
    }

    /// Every so many of them, from the first on.
    pub(super) fn every(&self, step: usize) -> Self {
        Self {
            ends: self.ends.iter().copied().step_by(step).collect(),
            rates: self.rates.iter().copied().step_by(step).collect(),
        }
    }

    /// Those that lie between two times, seconds since the source's origin.
    pub(super) fn between(&self, from: f64, to: f64) -> Self {
        let kept = self.ends.iter().zip(&self.rates).filter(|(e, _)| e.0 >= from && e.1 <= to);
        let (ends, rates) = kept.map(|(e, r)| (*e, *r)).unzip();
        Self { ends, rates }
    }

    /// Mean of their middles, seconds since the source's origin.
    pub(super) fn middle_s(&self) -> f64 {
        self.ends.iter().map(|(a, b)| 0.5 * (a + b)).sum::<f64>() / self.len().max(1) as f64
    }

    /// Seconds from the first to the last.
    pub(super) fn seconds(&self) -> f64 {
        match (self.ends.first(), self.ends.last()) {
            (Some(first), Some(last)) => last.1 - first.0,
            _ => 0.0,
        }
    }

    /// The turn rates of another source over the same stretches, where `moment` takes a time of this source to one of the
    /// other; `None` where the other is not known.
    pub(in super::super) fn seen_by(
        &self,
        other: &Turning,
        moment: impl Fn(f64) -> f64,
    ) -> Vec<Option<Vector3<f64>>> {
        let moments = self.ends.iter().flat_map(|(from, to)| [moment(*from), moment(*to)]);
        let known = other.at(moments);
        let pairs = known.chunks_exact(2).zip(&self.ends);
        pairs.map(|(pair, (from, to))| Turning::rate(&pair[0], &pair[1], to - from)).collect()
    }
}

//! From hypotheses to the document.

use super::document::{
    DiagnosisDocument, Estimated, FlawPart, HypothesisPart, LabelsPart, OdometryPart, Overlap, SCHEMA,
};
use super::fit::{Fit, Work};
use super::flaw::{Flaw, PARAMETERS};
use super::search::{Ranked, Search};
use super::verdict::{decide, rank, share};
use super::{Diagnosed, Diagnosis, Gross, Prepared, width, words};

/// So many hypotheses are listed.
const MOST_HYPOTHESES: usize = 8;
/// An overlap that is worth a word.
const LARGE_OVERLAP: f64 = 0.5;

pub(super) fn diagnosed(
    diagnosis: &Diagnosis<'_>,
    prepared: &Prepared<'_>,
    work: &Work<'_, '_>,
    search: &Search,
    gross: &Gross,
) -> Diagnosed {
    let evaluation = diagnosis.evaluation;
    let best = &search.ranked[0].fit;
    let labels_rmse_px = labels_rmse_px(work, best);
    let none = search.ranked.iter().find(|r| r.fit.flaws.is_empty());
    let taken_px = none.map_or(prepared.rmse_px, |r| work.rms(&r.fit.residuals));
    let best_px = work.rms(&best.residuals_now());
    let decision = decide(search, &work.noise, taken_px, best_px, labels_rmse_px);
    let reporter = Reporter { work, prepared, search, labels_rmse_px, rmse_px: prepared.rmse_px };
    let (verdict, theta) = reporter.verdict(
        &decision,
        gross,
        evaluation.streams[diagnosis.stream].time_offset.as_secs_f64(),
        diagnosis.inertial.is_some(),
    );
    let singles: Vec<&Ranked> =
        Flaw::ALL.iter().filter_map(|f| search.ranked.iter().find(|r| r.fit.flaws == [*f])).collect();
    let document = DiagnosisDocument {
        schema: SCHEMA.to_string(),
        vice_version: env!("CARGO_PKG_VERSION").to_string(),
        dataset: evaluation.rig.name().to_string(),
        format: evaluation.rig.format().to_string(),
        camera: evaluation.rig.camera_name().to_string(),
        stream: evaluation.streams[diagnosis.stream].name.clone(),
        depth: evaluation.depths[diagnosis.depth].name().to_string(),
        labels: labels_part(prepared, work),
        rmse_px: prepared.rmse_px,
        label_noise_px: work.noise.sizes(&best.logs).white_px,
        wander_px_root_s: wander_px(work, best),
        labels_rmse_px,
        odometry: odometry(work, best),
        flaws: singles.iter().map(|r| reporter.part(&r.fit, r.fit.flaws[0])).collect(),
        overlaps: overlaps(&singles),
        hypotheses: reporter.hypotheses(),
        verdict,
    };
    for (flaw, why) in &search.refused {
        tracing::warn!("{flaw} is not looked for: {why}");
    }
    let conventions = gross.conventions.clone();
    Diagnosed { document, theta, conventions }
}

pub(super) fn labels_part(prepared: &Prepared<'_>, work: &Work<'_, '_>) -> LabelsPart {
    let scene = &prepared.scene;
    let mut keyframes: Vec<usize> = scene.segments.iter().map(|s| s.frame).collect();
    keyframes.sort_unstable();
    keyframes.dedup();
    let mut points: Vec<usize> = scene.segments.iter().map(|s| s.point).collect();
    points.sort_unstable();
    points.dedup();
    let times = || scene.labels.iter().map(|l| scene.frames[l.frame].t_s);
    let raised = |w: &Vec<f64>| w.iter().filter(|w| **w > 1.0 && **w < 1e6).count();
    LabelsPart {
        scored: prepared.scored,
        points: points.len(),
        blocks: keyframes.len(),
        blocks_of: "keyframes".to_string(),
        seconds: times().fold(f64::NEG_INFINITY, f64::max) - times().fold(f64::INFINITY, f64::min),
        outliers: raised(&work.weights.labels),
        key_outliers: raised(&work.weights.keys),
    }
}

/// RMSE_2D that labels and key labels make by themselves, with the outliers as they are.
fn labels_rmse_px(work: &Work<'_, '_>, best: &Fit) -> f64 {
    let sizes = work.noise.sizes(&best.logs);
    let residuals = best.residuals_now();
    let white = sizes.white_px.powi(2);
    let mut sum = 0.0;
    let mut count = 0;
    for (i, label) in work.scene.labels.iter().enumerate().filter(|(i, _)| !work.dead[*i]) {
        count += 1;
        let key = &work.geometry.segments[label.segment].by_pixel;
        let answer = &work.geometry.labels[i];
        let moved: f64 = answer.by_place.iter().map(|h| (h.transpose() * key).norm_squared()).sum();
        let age_s = work.scene.frames[label.frame].t_s
            - work.scene.frames[work.scene.segments[label.segment].frame].t_s;
        // The depth's own noise is none of the poses'.
        let depth = &work.geometry.segments[label.segment].depth_variance;
        let depth: f64 = answer.by_place.iter().map(|h| (h.transpose() * depth * h)[0]).sum();
        let expected = 2.0 * white + white * moved + 2.0 * sizes.walk_px.powi(2) * age_s + depth;
        let aside = work.weights.labels[i] > 1.0 || work.weights.keys[label.segment] > 1.0;
        sum += if aside { residuals[i].norm_squared().max(expected) } else { expected };
    }
    (sum / f64::from(count.max(1))).sqrt()
}

/// RMS of how a coordinate moves by a second's walk of the position.
fn wander_px(work: &Work<'_, '_>, best: &Fit) -> f64 {
    let sizes = work.noise.sizes(&best.logs);
    let squares: f64 = work
        .geometry
        .labels
        .iter()
        .map(|l| 0.5 * l.by_place.iter().map(nalgebra::Vector3::norm_squared).sum::<f64>())
        .sum();
    sizes.position_m * (squares / work.geometry.labels.len().max(1) as f64).sqrt()
}

fn odometry(work: &Work<'_, '_>, best: &Fit) -> OdometryPart {
    let sizes = work.noise.sizes(&best.logs);
    OdometryPart {
        expected: work.noise.odometry,
        position_m_root_s: sizes.position_m,
        yaw_rad_root_s: sizes.yaw_rad,
        lean_rad: sizes.lean_rad,
        jitter_m: sizes.jitter_m,
        jumps_s: best.jumps.iter().map(|j| work.scene.frames[j.from].t_s).collect(),
    }
}

pub(super) struct Reporter<'r, 's, 'a> {
    pub(super) work: &'r Work<'s, 'a>,
    pub(super) prepared: &'r Prepared<'a>,
    pub(super) search: &'r Search,
    pub(super) labels_rmse_px: f64,
    pub(super) rmse_px: f64,
}

impl Reporter<'_, '_, '_> {
    /// Share of all hypotheses that hold all of these flaws.
    pub(super) fn with_all(&self, flaws: &[Flaw]) -> f64 {
        let holds = |r: &&Ranked| flaws.iter().all(|f| r.fit.flaws.contains(f));
        self.search.ranked.iter().filter(holds).map(|r| r.posterior).sum::<f64>().min(1.0)
    }

    /// RMSE_2D with the values of a fit taken out, the poses as they are read: what an evaluation then gives.
    pub(super) fn left_px(&self, fit: &Fit) -> f64 {
        let residuals = self.prepared.scene.residuals(&fit.values(), &self.prepared.plain);
        let Ok(residuals) = residuals else { return self.work.rms(&fit.residuals_now()) };
        let scored: Vec<f64> = residuals.iter().filter(|r| !r.x.is_nan()).map(|r| r.norm_squared()).collect();
        (scored.iter().sum::<f64>() / scored.len().max(1) as f64).sqrt()
    }

    fn hypotheses(&self) -> Vec<HypothesisPart> {
        let none = self.search.ranked.iter().find(|r| r.fit.flaws.is_empty());
        let at_best = |fit: &Fit| fit.score - fit.solution.evidence + fit.solution.likelihood;
        let part = |ranked: &Ranked| {
            let fit = &ranked.fit;
            HypothesisPart {
                flaws: fit.flaws.clone(),
                share: ranked.posterior,
                likelier: none.map_or(0.0, |n| fit.score - n.fit.score),
                likelier_at_best: none.map_or(0.0, |n| at_best(fit) - at_best(&n.fit)),
                rmse_px: self.work.rms(&fit.residuals_now()),
                noise_times: fit.logs.map(f64::exp),
                jumps: fit.jumps.len(),
            }
        };
        self.search.ranked.iter().take(MOST_HYPOTHESES).map(part).collect()
    }

    /// What one flaw of a fit comes to.
    pub(super) fn part(&self, fit: &Fit, flaw: Flaw) -> FlawPart {
        let values = fit.values();
        let parameters: Vec<Estimated> = flaw
            .parameters()
            .map(|p| {
                let (value, half) = (values[p], width::half(fit, flaw, p));
                let name = PARAMETERS[p].name.to_string();
                Estimated { name, value, low: value - half, high: value + half }
            })
            .collect();
        let size = width::length(fit, flaw).map(|(value, half)| {
            let name = PARAMETERS[flaw.parameters().start].name.replacen("_x", "", 1);
            Estimated { name, value, low: (value - half).max(0.0), high: value + half }
        });
        let none = self.search.ranked.iter().find(|r| r.fit.flaws.is_empty());
        let rmse_px = self.left_px(fit);
        let before = none.map_or(self.rmse_px, |r| self.work.rms(&r.fit.residuals));
        let effects: Vec<f64> = flaw
            .solved()
            .filter_map(|p| {
                let i = fit.place_of(p)?;
                Some(PARAMETERS[p].typical * self.work.rms(&fit.columns[i]))
            })
            .collect();
        let alone = fit.flaws.len() == 1;
        FlawPart {
            flaw,
            text: words::line(flaw, &parameters, size.as_ref()),
            of: flaw.solved().len(),
            parameters,
            size,
            rmse_px,
            explained_percent: 100.0 * (1.0 - (rmse_px / before.max(f64::MIN_POSITIVE)).powi(2)),
            likelier: none.map_or(0.0, |r| fit.score - r.fit.score),
            sureness: share(self.search, &fit.flaws),
            rank: if alone { rank(fit) } else { flaw.solved().len() },
            weakest_px: effects.iter().copied().fold(f64::INFINITY, f64::min),
            strongest_px: effects.iter().copied().fold(0.0, f64::max),
        }
    }
}

fn overlaps(singles: &[&Ranked]) -> Vec<Overlap> {
    let mut overlaps = Vec::new();
    for of in singles {
        for with in singles.iter().filter(|w| w.fit.flaws != of.fit.flaws) {
            let share = overlap(&of.fit, &with.fit);
            if share > LARGE_OVERLAP {
                overlaps.push(Overlap { of: of.fit.flaws[0], with: with.fit.flaws[0], share });
            }
        }
    }
    overlaps
}

/// How much of the pixels that one fit accounts for another could account for as well, 0 to 1.
fn overlap(of: &Fit, with: &Fit) -> f64 {
    let rows = 2 * of.residuals.len();
    let values = of.values();
    let field = nalgebra::DVector::from_fn(rows, |row, _| {
        of.columns.iter().zip(&of.parameters).map(|(c, p)| c[row / 2][row % 2] * values[*p]).sum::<f64>()
    });
    let n = with.parameters.len();
    let columns = nalgebra::DMatrix::from_fn(rows, n, |row, c| {
        with.columns[c][row / 2][row % 2] * PARAMETERS[with.parameters[c]].typical
    });
    let length = field.norm_squared();
    let normal = columns.transpose() * &columns;
    let seen = columns.transpose() * field;
    let eigen = normal.symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    if length <= 0.0 || largest <= 0.0 {
        return 0.0;
    }
    let shared: f64 = (0..n)
        .filter(|i| eigen.eigenvalues[*i] > 1e-12 * largest)
        .map(|i| eigen.eigenvectors.column(i).dot(&seen).powi(2) / eigen.eigenvalues[i])
        .sum();
    (shared / length).clamp(0.0, 1.0)
}

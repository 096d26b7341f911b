//! From hypotheses to the document.

use super::document::{
    DiagnosisDocument, Estimated, FlawPart, HypothesisPart, LabelsPart, OdometryPart, Overlap, SCHEMA,
    Verdict, VerdictKind,
};
use super::fit::{Fit, Work};
use super::flaw::{Flaw, PARAMETERS};
use super::noise::{JITTER, POSITION, YAW};
use super::search::{Ranked, Search};
use super::theta::Theta;
use super::verdict::{Decision, decide, rank, share};
use super::{Diagnosed, Diagnosis, Gross, Prepared, words};

/// Half the width of a 95 % interval in posterior deviations: the sizes of the noise are estimated, and the model is no
/// truth.
const HALF_WIDTH: f64 = 2.5;
/// Errors of a tilt were measured at up to 5.4 deviations over five flights: an integration errs by more than white noise.
const HALF_WIDTH_TILT: f64 = 6.0;
/// At constant speed a clock and a position are nearly one.
const HALF_WIDTH_CLOCK: f64 = 3.0;
/// A drift and the slope of a walk are one.
const HALF_WIDTH_DRIFT: f64 = 3.2;
/// So many hypotheses are listed.
const MOST_HYPOTHESES: usize = 8;
/// An overlap that is worth a word.
const LARGE_OVERLAP: f64 = 0.5;
/// A second flaw beside a convention needs this share.
const SURE_BESIDE: f64 = 0.9;
/// Of labels that cannot be carried at all, this share needs an explanation.
const MANY_LOST: f64 = 0.3;

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
    let decision = decide(search, &work.noise, taken_px, labels_rmse_px);
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
        dataset: evaluation.dataset.name().to_string(),
        format: evaluation.dataset.format().to_string(),
        camera: evaluation.camera_name.to_string(),
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

fn half_width(flaw: Flaw) -> f64 {
    match flaw {
        Flaw::InitialTilt => HALF_WIDTH_TILT,
        Flaw::Drift => HALF_WIDTH_DRIFT,
        Flaw::ClockOffset | Flaw::ClockRate | Flaw::ClockStep => HALF_WIDTH_CLOCK,
        _ => HALF_WIDTH,
    }
}

struct Reporter<'r, 's, 'a> {
    work: &'r Work<'s, 'a>,
    prepared: &'r Prepared<'a>,
    search: &'r Search,
    labels_rmse_px: f64,
    rmse_px: f64,
}

impl Reporter<'_, '_, '_> {
    /// Share of all hypotheses that hold all of these flaws.
    fn with_all(&self, flaws: &[Flaw]) -> f64 {
        let holds = |r: &&Ranked| flaws.iter().all(|f| r.fit.flaws.contains(f));
        self.search.ranked.iter().filter(holds).map(|r| r.posterior).sum::<f64>().min(1.0)
    }

    /// RMSE_2D with the values of a fit taken out, the poses as they are read: what an evaluation then gives.
    fn left_px(&self, fit: &Fit) -> f64 {
        let residuals = self.prepared.scene.residuals(&fit.values(), &self.prepared.plain);
        let Ok(residuals) = residuals else { return self.work.rms(&fit.residuals_now()) };
        let scored: Vec<f64> = residuals.iter().flatten().map(|r| r.norm_squared()).collect();
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
    fn part(&self, fit: &Fit, flaw: Flaw) -> FlawPart {
        let values = fit.values();
        let deviation = |parameter: usize| {
            fit.parameters
                .iter()
                .position(|p| *p == parameter)
                .map_or(0.0, |i| fit.solution.covariance[(i, i)].max(0.0).sqrt())
        };
        let parameters: Vec<Estimated> = flaw
            .parameters()
            .map(|p| {
                let half = half_width(flaw) * deviation(p);
                let value = values[p];
                Estimated {
                    name: PARAMETERS[p].name.to_string(),
                    value,
                    low: value - half,
                    high: value + half,
                }
            })
            .collect();
        // The yaw rate of a drift is of another unit than its velocity.
        let vector = if flaw == Flaw::Drift { 3 } else { flaw.solved().len() };
        let is_vector = matches!(
            flaw,
            Flaw::ExtrinsicRotation | Flaw::ExtrinsicTranslation | Flaw::InitialTilt | Flaw::Drift
        );
        let size = is_vector.then(|| {
            let first = flaw.parameters().start;
            let x: Vec<f64> = (0..vector).map(|i| values[first + i]).collect();
            let length = x.iter().map(|v| v * v).sum::<f64>().sqrt();
            let at = |p: usize| fit.parameters.iter().position(|q| *q == first + p).unwrap_or(0);
            let mut variance = 0.0;
            for a in 0..vector {
                for b in 0..vector {
                    variance += x[a] * x[b] * fit.solution.covariance[(at(a), at(b))];
                }
            }
            let half = half_width(flaw) * variance.max(0.0).sqrt() / length.max(1e-12);
            let name = PARAMETERS[first].name.replacen("_x", "", 1);
            Estimated { name, value: length, low: (length - half).max(0.0), high: length + half }
        });
        let none = self.search.ranked.iter().find(|r| r.fit.flaws.is_empty());
        let rmse_px = self.left_px(fit);
        let before = none.map_or(self.rmse_px, |r| self.work.rms(&r.fit.residuals));
        let effects: Vec<f64> = flaw
            .solved()
            .filter_map(|p| {
                let i = fit.parameters.iter().position(|q| *q == p)?;
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

    fn verdict(
        &self,
        decision: &Decision,
        gross: &Gross,
        time_offset_s: f64,
        inertial: bool,
    ) -> (Verdict, Theta) {
        let best = &self.search.ranked[0];
        let none = share(self.search, &[]);
        let sets = share(self.search, &best.fit.flaws);
        let left_px = self.left_px(&best.fit);
        let base = Verdict {
            kind: VerdictKind::NoFlaw,
            flaws: vec![],
            sureness: none,
            fitted: vec![],
            rmse_px: self.rmse_px,
            sentence: String::new(),
            corrections: vec![],
            labels_that_help: vec![],
            estimate_as: vec![],
        };
        let name = |f: &Flaw| f.name().to_string();
        let help = |flaws: &[Flaw]| -> Vec<String> {
            flaws.iter().map(|f| format!("{f}: {}", f.labels_that_help())).collect()
        };
        let named = |fit: &Fit| -> (Vec<FlawPart>, Vec<String>) {
            let parts = fit.flaws.iter().map(|f| self.part(fit, *f)).collect();
            let values = fit.values();
            let corrections =
                fit.flaws.iter().map(|f| words::correction(*f, values.of(*f), time_offset_s)).collect();
            (parts, corrections)
        };
        if gross.frozen {
            let sentence = format!(
                "the rotation of the estimate never changes, as if it had not been written, while the labels show that the camera turns ({:.2} px)",
                self.rmse_px
            );
            let flaws = vec!["convention:frozen-rotation".to_string()];
            let verdict = Verdict { kind: VerdictKind::Named, flaws, sureness: 0.99, sentence, ..base };
            return (verdict, Theta::zero());
        }
        if !gross.conventions.is_empty() {
            return self.convention(decision, gross, base, named);
        }
        let noise = self.noise_words(&best.fit);
        let lost = self.work.dead.iter().filter(|d| **d).count() as f64 / self.work.dead.len().max(1) as f64;
        if lost > MANY_LOST {
            let sentence = format!(
                "none of the causes looked for explains this: {:.0} % of the labels' points fall behind the camera or have no depth",
                100.0 * lost
            );
            return (Verdict { kind: VerdictKind::Unexplained, sentence, ..base }, Theta::zero());
        }
        match decision {
            Decision::NoFlaw => {
                let sentence = format!(
                    "no flaw found above the label noise ({:.2} px, of which the labels alone make {:.2} px) and what an odometry may wander ({noise})",
                    self.rmse_px, self.labels_rmse_px
                );
                (Verdict { sentence, ..base }, Theta::zero())
            }
            Decision::Named(flaws) => {
                let fit = &self.search.ranked.iter().find(|r| r.fit.flaws == *flaws).unwrap_or(best).fit;
                let left_px = self.left_px(fit);
                let (fitted, corrections) = named(fit);
                let values: Vec<&str> = fitted.iter().map(|f| f.text.as_str()).collect();
                let sentence = format!(
                    "most likely {}: {:.2} px become {left_px:.2} px without it",
                    values.join("; "),
                    self.rmse_px
                );
                let verdict = Verdict {
                    kind: VerdictKind::Named,
                    flaws: flaws.iter().map(name).collect(),
                    sureness: self.with_all(flaws),
                    fitted,
                    rmse_px: left_px,
                    sentence,
                    corrections,
                    ..base
                };
                let values = fit.values();
                (verdict, values)
            }
            Decision::CannotTell(candidates) => {
                let listed: Vec<String> = candidates.iter().map(|f| f.words().to_string()).collect();
                let sentence = format!(
                    "cannot tell {} apart: each may explain much of the {:.2} px (likeliest: {}, which leaves {left_px:.2} px)",
                    words::listed(&listed, "and"),
                    self.rmse_px,
                    words::listed(
                        &best.fit.flaws.iter().map(|f| f.words().to_string()).collect::<Vec<_>>(),
                        "with"
                    )
                );
                let verdict = Verdict {
                    kind: VerdictKind::CannotTell,
                    flaws: candidates.iter().map(name).collect(),
                    sureness: sets,
                    sentence,
                    labels_that_help: help(candidates),
                    ..base
                };
                (verdict, Theta::zero())
            }
            Decision::Unexplained { noise: wanders, jumps } => {
                let mut flaws = Vec::new();
                let mut why = String::new();
                if *wanders {
                    flaws.push("pose-noise".to_string());
                    why = format!("; the estimate wanders more than is healthy ({noise})");
                }
                if *jumps {
                    flaws.push("pose-jump".to_string());
                    let at: Vec<String> = best
                        .fit
                        .jumps
                        .iter()
                        .map(|j| format!("{:.1} s", self.work.scene.frames[j.from].t_s))
                        .collect();
                    why.push_str(&format!("; it jumps or slides at {}", at.join(", ")));
                }
                let is_noise = inertial && none > 0.3 && !*jumps;
                let kind = if is_noise { VerdictKind::Named } else { VerdictKind::Unexplained };
                let sentence = if is_noise {
                    format!(
                        "the integrated sensors wander, and nothing else is found: {:.2} px, of which the labels make {:.2} px",
                        self.rmse_px, self.labels_rmse_px
                    )
                } else {
                    format!(
                        "none of the causes looked for explains this: {left_px:.2} px are left, the labels' noise is {:.2} px{why}",
                        self.labels_rmse_px
                    )
                };
                let sureness = best.posterior;
                (Verdict { kind, flaws, sureness, sentence, ..base }, Theta::zero())
            }
            Decision::TooFew { times } => {
                let part_s = self.seconds();
                let sentence = if times.is_finite() {
                    format!(
                        "too few labels for any answer ({:.2} px): about {:.0} times as many are needed, {:.0} s more of them with key frames as often as now",
                        self.rmse_px,
                        times.ceil(),
                        ((times - 1.0) * part_s).ceil().max(1.0)
                    )
                } else {
                    format!("too few labels for any answer ({:.2} px)", self.rmse_px)
                };
                (Verdict { kind: VerdictKind::TooFewLabels, sentence, ..base }, Theta::zero())
            }
        }
    }

    fn seconds(&self) -> f64 {
        let times = || self.work.scene.labels.iter().map(|l| self.work.scene.frames[l.frame].t_s);
        times().fold(f64::NEG_INFINITY, f64::max) - times().fold(f64::INFINITY, f64::min)
    }

    fn noise_words(&self, fit: &Fit) -> String {
        let sizes = self.work.noise.sizes(&fit.logs);
        let expected = self.work.noise.odometry;
        let degrees = f64::to_degrees;
        if self.work.noise.inertial {
            return format!(
                "accelerometer {:.4} m/s² and gyroscope {:.5} rad/s a root hertz, {:.1} and {:.1} times the usual",
                sizes.accel,
                sizes.gyro,
                fit.logs[POSITION].exp(),
                fit.logs[YAW].exp()
            );
        }
        format!(
            "{:.1} mm and {:.3}° a root second, jitter {:.1} times the usual; healthy is {:.1} mm and {:.3}°",
            1e3 * sizes.position_m,
            degrees(sizes.yaw_rad),
            fit.logs[JITTER].exp(),
            1e3 * expected.position_m,
            degrees(expected.yaw_rad)
        )
    }

    fn convention(
        &self,
        decision: &Decision,
        gross: &Gross,
        base: Verdict,
        named: impl Fn(&Fit) -> (Vec<FlawPart>, Vec<String>),
    ) -> (Verdict, Theta) {
        let best = &self.search.ranked[0];
        let words: Vec<String> = gross.conventions.iter().map(|c| c.words()).collect();
        let list = crate::conventions::list_text(&gross.conventions);
        let mut flaws: Vec<String> = gross.conventions.iter().map(|c| c.verdict_name().to_string()).collect();
        let fit = match decision {
            Decision::Named(flaws) => self.search.ranked.iter().find(|r| r.fit.flaws == *flaws),
            _ => None,
        };
        let fit = fit.map_or(&best.fit, |r| &r.fit);
        let beside = matches!(decision, Decision::Named(_))
            && self.with_all(&fit.flaws) > SURE_BESIDE
            && share(self.search, &[]) < 0.02;
        let (fitted, mut corrections) = if beside { named(fit) } else { (vec![], vec![]) };
        let values: Vec<&str> = fitted.iter().map(|f| f.text.as_str()).collect();
        let also = if beside { format!(", and {}", values.join("; ")) } else { String::new() };
        corrections.insert(0, format!("--estimate-as {list}"));
        if beside {
            flaws.extend(fit.flaws.iter().map(|f| f.name().to_string()));
        }
        let none = self.search.ranked.iter().find(|r| r.fit.flaws.is_empty());
        let cured_px = self.left_px(if beside { fit } else { none.map_or(fit, |r| &r.fit) });
        let sentence = format!(
            "most likely {}{also}: {:.2} px become {cured_px:.2} px with --estimate-as {list}",
            words.join(", and "),
            self.rmse_px
        );
        let verdict = Verdict {
            kind: VerdictKind::Named,
            flaws,
            sureness: 1.0 - (-gross.likelier).exp().min(0.5),
            fitted,
            rmse_px: cured_px,
            sentence,
            corrections,
            estimate_as: gross.conventions.iter().map(ToString::to_string).collect(),
            ..base
        };
        (verdict, if beside { fit.values() } else { Theta::zero() })
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

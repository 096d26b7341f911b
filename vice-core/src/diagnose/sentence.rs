//! A verdict in words, and what to do about it.

use super::document::{FlawPart, Verdict, VerdictKind};
use super::fit::Fit;
use super::flaw::Flaw;
use super::noise::{JITTER, POSITION, YAW};
use super::report::Reporter;
use super::theta::Theta;
use super::verdict::{Decision, share};
use super::{Gross, words};

/// A second flaw beside a convention needs this share.
const SURE_BESIDE: f64 = 0.9;
/// Of labels that cannot be carried at all, this share needs an explanation.
const MANY_LOST: f64 = 0.3;

impl Reporter<'_, '_, '_> {
    pub(super) fn verdict(
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
                if is_noise && flaws.is_empty() {
                    flaws.push("pose-noise".to_string());
                }
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

//! A comparison of labels as text.

use super::{Agreement, LabelComparison};
use crate::report::table::align;
use crate::text::printable;

impl LabelComparison {
    /// A table of the points, all together, and what it means for RMSE_2D.
    pub fn text(&self) -> String {
        let head = [
            "point",
            "compared",
            "missing in A",
            "missing in B",
            "median px",
            "95 % px",
            "worst px",
            "drift px",
            "drift 95 %",
        ];
        let mut grid = vec![head.map(String::from).to_vec()];
        for point in &self.points {
            let name =
                if point.a == point.b { point.a.clone() } else { format!("{} = {}", point.a, point.b) };
            grid.push(row(&printable(&name), &point.agreement));
        }
        grid.push(row("all", &self.all));
        let name = |path: &std::path::Path| printable(&path.display().to_string());
        let mut text = format!("A: {}\nB: {}\n\n{}", name(&self.a), name(&self.b), align(&grid));
        for (set, names) in [("A", &self.only_in_a), ("B", &self.only_in_b)] {
            if !names.is_empty() {
                let names: Vec<String> = names.iter().map(|n| printable(n)).collect();
                text += &format!("only in {set}: {}\n", names.join(", "));
            }
        }
        text += &match self.floor_px {
            Some(floor) => format!(
                "floor under RMSE_2D: {floor:.3} px, if each is as good as the other (labels moved apart since their key frame, by √2)\n"
            ),
            None => "no floor under RMSE_2D: no segment has two labels of both\n".to_string(),
        };
        text
    }
}

fn row(name: &str, agreement: &Agreement) -> Vec<String> {
    let px = |value: Option<f64>| value.map_or_else(|| "-".to_string(), |v| format!("{v:.2}"));
    vec![
        name.to_string(),
        agreement.compared.to_string(),
        agreement.missing_in_a.to_string(),
        agreement.missing_in_b.to_string(),
        px(agreement.median_px),
        px(agreement.p95_px),
        px(agreement.worst_px),
        px(agreement.drift_median_px),
        px(agreement.drift_p95_px),
    ]
}

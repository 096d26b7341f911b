//! A comparison of labels over time, as a picture.

use std::fmt::Write;

use super::{LabelComparison, TimeBin};

const SIZE: [f64; 2] = [720.0, 300.0];
/// Left, top, right, bottom.
const MARGIN: [f64; 4] = [56.0, 28.0, 16.0, 44.0];

impl LabelComparison {
    /// Median and 95th percentile of the distance second by second, as SVG.
    pub fn svg(&self) -> String {
        let [width, height] = SIZE;
        let last_s = self.by_time.last().map_or(1.0, |b| b.from_s + super::BIN_S);
        let most_px = self.by_time.iter().map(|b| b.p95_px).fold(0.1, f64::max) * 1.1;
        let x = |s: f64| MARGIN[0] + s / last_s * (width - MARGIN[0] - MARGIN[2]);
        let y = |px: f64| height - MARGIN[3] - px / most_px * (height - MARGIN[1] - MARGIN[3]);
        let line = |value: fn(&TimeBin) -> f64| {
            let places = self
                .by_time
                .iter()
                .map(|b| format!("{:.1},{:.1}", x(b.from_s + super::BIN_S / 2.0), y(value(b))));
            places.collect::<Vec<_>>().join(" ")
        };
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n"
        );
        // Writing to a string cannot fail.
        for k in 0..=4 {
            let (px, s) = (most_px * f64::from(k) / 4.0, last_s * f64::from(k) / 4.0);
            let _ = writeln!(
                text,
                "<path d=\"M{:.1} {:.1}H{:.1}\" stroke=\"#ddd\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{px:.2}</text>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{s:.1}</text>",
                MARGIN[0],
                y(px),
                width - MARGIN[2],
                MARGIN[0] - 6.0,
                y(px) + 4.0,
                x(s),
                height - MARGIN[3] + 16.0
            );
        }
        let _ = writeln!(
            text,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"#c60\" stroke-width=\"1.5\"/>\n\
             <polyline points=\"{}\" fill=\"none\" stroke=\"#06c\" stroke-width=\"1.5\"/>\n\
             <text x=\"{:.1}\" y=\"18\" fill=\"#06c\">median px</text><text x=\"{:.1}\" y=\"18\" fill=\"#c60\">95 % px</text>\n\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">s since the first label</text>\n</svg>",
            line(|b| b.p95_px),
            line(|b| b.median_px),
            MARGIN[0],
            MARGIN[0] + 90.0,
            width / 2.0,
            height - 8.0
        );
        text
    }
}

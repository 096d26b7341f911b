//! Small plots side by side: the error over time of all estimators, a plot for each flight.

use maud::{Markup, PreEscaped, html};

use super::flights::{Curve, Flight};
use crate::report::plots::axis::Axis;
use crate::report::plots::estimate_class;
use crate::report::plots::panel::Panel;
use crate::report::plots::picture::Picture;
use crate::text::printable;

const WIDTH: f64 = 300.0;
const HEIGHT: f64 = 160.0;
const LEFT: f64 = 40.0;
/// A curve is broken where nothing was scored for so many seconds.
const GAP_S: f64 = 5.0;

/// The plots, each with its own scale, and the colours of the estimators once.
pub(super) fn multiples(flights: &[(Flight, Vec<(String, Curve)>)]) -> Markup {
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in flights.iter().flat_map(|(_, curves)| curves) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    let class = |name: &str| estimate_class(names.iter().position(|n| *n == name).unwrap_or(0));
    html! {
        p.soft { "Mean error of the points in px over seconds since the first label; each plot has its own scale." }
        p { @for name in &names { span class={ "key k-" (class(name)) } {} (printable(name)) " \u{2003}" } }
        div.multiples {
            @for (flight, curves) in flights {
                @let name = format!("{} {} {}", printable(&flight.group), printable(&flight.flight), printable(&flight.depth));
                figure data-flight=(name) {
                    figcaption { (printable(&flight.flight)) " \u{b7} " (printable(&flight.depth)) }
                    (PreEscaped(plot(curves, &class, &name)))
                }
            }
        }
    }
}

fn plot<'a>(curves: &[(String, Curve)], class: &dyn Fn(&str) -> &'a str, name: &str) -> String {
    let all = || curves.iter().flat_map(|(_, curve)| curve);
    let mut picture = Picture::new(WIDTH, HEIGHT);
    let panel = Panel {
        left: LEFT,
        top: 22.0,
        width: WIDTH - LEFT - 8.0,
        height: HEIGHT - 60.0,
        x: Axis::exactly(all().map(|p| p.0).chain([0.0]), 4),
        y: Axis::from_zero(all().map(|p| p.1).chain([0.01]), 3),
    };
    panel.draw_axes(&mut picture, Some("s"), Some("px"));
    for (name, curve) in curves {
        panel.line(&mut picture, class(name), curve, GAP_S);
    }
    picture.into_svg(&format!("error over time: {name}"))
}

//! The worst moments at full resolution, and pieces of the images around each point.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, html};
use vice_core::time::Stamp;

use super::overlay::{data_uri, drawn};
use crate::report::crops::{Around, Piece, PointPieces, SIDE};
use crate::report::frames::Shots;
use crate::report::keys::{Key, of_carrier};
use crate::report::marks::Marks;
use crate::report::numbers::px;
use crate::text::printable;

/// The worst moments, the worst first.
pub(crate) fn moments(marks: &Marks, keys: &[Key], shots: &Shots, zero: Stamp) -> Markup {
    html! {
        @if !shots.moments.is_empty() {
            h2 { "The worst moments" }
            p.note {
                "Full resolution, at least half a second apart, the worst first. Press a picture to see it pixel for pixel."
                @if shots.moments_left_out > 0 { " " (shots.moments_left_out) " more did not fit into the page." }
            }
            div.moments {
                @for (moment, shot) in &shots.moments {
                    @let at = format!("{:.2} s", moment.stamp.since(zero).as_secs_f64());
                    figure.moment {
                        div.shot.whole tabindex="0" role="button" aria-label={ "enlarge the frame at " (at) } {
                            img alt={ "frame at " (at) } width=(shot.size_px[0]) height=(shot.size_px[1]) src=(data_uri(shot));
                            @if let Some(frame) = marks.frames.get(&moment.stamp) { (PreEscaped(drawn(marks, keys, frame, shot, true))) }
                        }
                        figcaption {
                            (at) ": "
                            @if let Some(carrier) = marks.carriers.get(moment.carrier) { (printable(&carrier.name)) " is " }
                            (px(moment.error_px)) " off at point " (printable(&moment.point.0))
                        }
                    }
                }
            }
        }
    }
}

/// The pieces around each point.
pub(crate) fn pieces(marks: &Marks, keys: &[Key], shots: &Shots, zero: Stamp) -> Markup {
    let seconds = |stamp: Stamp| format!("{:.2} s", stamp.since(zero).as_secs_f64());
    html! {
        @if shots.pieces.iter().any(|p| p.pieces.iter().any(|piece| piece.png.is_some())) {
            h2 { "Point by point" }
            p.note {
                (SIDE) " by " (SIDE) " pixels at eight times their size, around the key label, the label, and where each stream carried \
                 the point, in the frame in which an estimate is furthest off. A good estimate shows the same corner as the label."
            }
            @for point in &shots.pieces {
                h3 { "Point " (printable(&point.point.0)) ", " (seconds(point.stamp)) ", off by up to " (px(point.error_px)) }
                div.pieces { @for piece in &point.pieces { (one(marks, keys, point, piece, &seconds)) } }
            }
        }
    }
}

fn one(
    marks: &Marks,
    keys: &[Key],
    point: &PointPieces,
    piece: &Piece,
    seconds: &dyn Fn(Stamp) -> String,
) -> Markup {
    let key = match piece.around {
        Around::Carried(carrier) => marks.carriers.get(carrier).and_then(|c| of_carrier(keys, c)),
        _ => None,
    };
    let class = key.map_or("label", |k| k.class);
    let name = match (piece.around, key) {
        (Around::Keyframe, _) => format!("key label, {}", seconds(piece.stamp)),
        (Around::Label, _) => format!("label, {}", seconds(piece.stamp)),
        (_, Some(key)) => format!("{}, {}", key.name, px(piece.error_px)),
        _ => px(piece.error_px),
    };
    // Where the place lies in the pixel in the middle.
    let middle = |value: f64| f64::from(SIDE / 2) + 0.5 + (value - value.round());
    let (x, y) = (middle(piece.at.u), middle(piece.at.v));
    html! {
        figure.cut data-s=[key.map(|k| k.id)] {
            @match &piece.png {
                Some(png) => {
                    div.piece {
                        img alt={ (name) " of point " (printable(&point.point.0)) } src={ "data:image/png;base64," (STANDARD.encode(png)) };
                        svg viewBox={ "0 0 " (SIDE) " " (SIDE) } aria-hidden="true" {
                            path class={ "halo" } d={ (cross(x, y)) } {}
                            path class={ "mk c-" (class) } d={ (cross(x, y)) } {}
                        }
                    }
                }
                None => div.piece.none { "outside the image" },
            }
            figcaption { span class={ "key k-" (class) } {} (name) }
        }
    }
}

/// Four strokes that leave the middle in view.
fn cross(x: f64, y: f64) -> String {
    format!(
        "M{:.2} {y:.2}h-4M{:.2} {y:.2}h4M{x:.2} {:.2}v-4M{x:.2} {:.2}v4",
        x - 1.5,
        x + 1.5,
        y - 1.5,
        y + 1.5
    )
}

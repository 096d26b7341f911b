//! What the surfaces of the room look like: tiles, bricks, a window, a door, posters, crates and cartons.
//!
//! Albedo is a number between 0 (black) and 1 (white) at a place on a face. Every material mixes scales, so that there
//! are corners to track from half a metre as well as from seven.

use crate::hash::{hash, unit};
use crate::material::Material;
use crate::pattern::{Spot, band, checker, digit, inside, lines, noise, rectangle, resolved, speckles, step};
use crate::scene::Face;

/// Albedo of a face at a spot.
pub(crate) fn albedo(face: &Face, at: &Spot) -> f64 {
    let value = match face.material {
        Material::Tiles(seed) => tiles(at, seed),
        Material::Plaster => plaster(at, 11),
        Material::Bricks => skirting(at, bricks(at)),
        Material::WindowWall => skirting(at, window_wall(at, face.size_m)),
        Material::DoorWall => skirting(at, door_wall(at)),
        Material::PosterWall(seed) => skirting(at, poster_wall(at, seed)),
        Material::Crate(seed) => wooden_crate(at, face.size_m, seed),
        Material::Cardboard(seed) => cardboard(at, face.size_m, seed),
        Material::Cabinet(seed) => cabinet(at, face.size_m, seed),
    };
    value.clamp(0.02, 1.0)
}

fn mix(a: f64, b: f64, share_of_b: f64) -> f64 {
    a + (b - a) * share_of_b
}

/// Half-metre tiles in two tones with dark joints, grain, chips, and a large painted mark every one and a half metres.
fn tiles(at: &Spot, seed: u32) -> f64 {
    const SIDE: f64 = 0.5;
    let tone = mix(0.40, 0.60, checker(at, SIDE));
    let cell = hash((at.s / SIDE).floor() as i32, (at.t / SIDE).floor() as i32, seed);
    let own = (unit(cell, 0) - 0.5) * 0.14 * resolved(2.0 * SIDE, at.width());
    let grain = noise(at, &[(0.31, 0.05), (0.09, 0.05), (0.031, 0.06), (0.012, 0.05)], seed);
    let chips = speckles(at, 0.085, 0.75, 0.30, seed) + speckles(at, 0.033, 0.6, 0.16, seed ^ 77);
    let joints = lines(at.s, SIDE, 0.012, at.ws).max(lines(at.t, SIDE, 0.012, at.wt));
    let painted = floor_mark(at, seed);
    let tone = mix(tone + own, 0.86, painted.0.max(0.0));
    let tone = mix(tone, 0.08, painted.1);
    mix(tone + grain + chips, 0.16, joints * 0.85)
}

/// Large marks on the floor: how much white paint and how much black.
fn floor_mark(at: &Spot, seed: u32) -> (f64, f64) {
    const CELL: f64 = 1.5;
    let (x, y) = ((at.s / CELL).floor(), (at.t / CELL).floor());
    let h = hash(x as i32, y as i32, seed ^ 0xA5A5);
    let centre = |index: f64, byte| (index + 0.5 + 0.4 * (unit(h, byte) - 0.5)) * CELL;
    let here = at.moved(centre(x, 0), centre(y, 1));
    let w = here.width();
    let r = here.s.hypot(here.t);
    if r > 0.36 {
        return (0.0, 0.0);
    }
    match (h >> 16) % 4 {
        0 => (inside((r - 0.2).abs() - 0.045, w), inside(r - 0.07, w)),
        1 => {
            let arm = here.s.abs().max(here.t.abs()) - 0.22;
            let cross = here.s.abs().min(here.t.abs()) - 0.05;
            (0.0, inside(arm.max(cross), w))
        }
        2 => {
            let plate = rectangle(&here, [-0.2, 0.2], [-0.22, 0.22]);
            (plate, digit(&here.moved(-0.09, -0.16), (h >> 20) % 10, 0.32))
        }
        _ => {
            let triangle = (-here.t - 0.13).max(0.866 * here.s.abs() + 0.5 * here.t - 0.13);
            (inside(triangle, w), inside(triangle + 0.075, w))
        }
    }
}

fn plaster(at: &Spot, seed: u32) -> f64 {
    0.74 + noise(at, &[(0.7, 0.04), (0.2, 0.03), (0.06, 0.03), (0.02, 0.03)], seed)
        + speckles(at, 0.12, 0.45, 0.16, seed)
}

/// A dark board where a wall meets the floor.
fn skirting(at: &Spot, wall: f64) -> f64 {
    let board = step(0.11, at.t, at.wt);
    let groove = band(at.t, 0.08, 0.09, at.wt) * 0.12;
    mix(wall, 0.30 - groove + noise(at, &[(0.15, 0.03), (0.03, 0.03)], 91), board)
}

fn bricks(at: &Spot) -> f64 {
    const LONG: f64 = 0.30;
    const HIGH: f64 = 0.10;
    let row = (at.t / HIGH).floor();
    let shift = if (row as i64).rem_euclid(2) == 0 { 0.0 } else { LONG / 2.0 };
    let column = ((at.s + shift) / LONG).floor();
    let own = unit(hash(column as i32, row as i32, 301), 1) - 0.5;
    let brick = 0.42 + 0.22 * own * resolved(2.0 * HIGH, at.width());
    let grain = noise(at, &[(0.05, 0.05), (0.016, 0.06)], 302) + speckles(at, 0.06, 0.5, 0.16, 303);
    let mortar = lines(at.t, HIGH, 0.014, at.wt).max(lines(at.s + shift, LONG, 0.014, at.ws));
    mix(brick + grain, 0.72, mortar)
}

/// Wallpaper with a bright window of six panes in a frame, and a sill.
fn window_wall(at: &Spot, size_m: [f64; 2]) -> f64 {
    let here = at.moved(size_m[0] / 2.0 - 1.1, 0.95);
    let wall = wallpaper(at);
    let frame = rectangle(&here, [-0.07, 2.27], [-0.07, 1.37]);
    let panes = rectangle(&here, [0.0, 2.2], [0.0, 1.3])
        * (1.0 - lines(here.s, 2.2 / 3.0, 0.05, at.ws))
        * (1.0 - lines(here.t, 0.65, 0.05, at.wt));
    let hills = here.t - 0.35 - 0.10 * (here.s * 3.1).sin() - 0.05 * (here.s * 7.3).cos();
    let outside =
        mix(0.55 + noise(&here, &[(0.12, 0.12), (0.04, 0.08)], 5), 0.95, step(hills, 0.0, at.width()));
    let sill = rectangle(&here, [-0.15, 2.35], [-0.14, -0.07]);
    let value = mix(mix(wall, 0.88, frame), outside, panes);
    mix(value, 0.5, sill)
}

fn wallpaper(at: &Spot) -> f64 {
    let stripes = lines(at.s, 0.20, 0.07, at.ws) * 0.09;
    0.64 - stripes
        + noise(at, &[(0.5, 0.03), (0.07, 0.04), (0.02, 0.03)], 21)
        + speckles(at, 0.10, 0.6, 0.26, 22)
}

/// Plaster with a panelled door, its handle, and a framed picture beside it.
fn door_wall(at: &Spot) -> f64 {
    let here = at.moved(2.2, 0.0);
    let frame = rectangle(&here, [-0.08, 1.03], [0.0, 2.16]);
    let leaf = rectangle(&here, [0.0, 0.95], [0.0, 2.08]);
    let wood = 0.46
        + noise(&Spot { t: here.t * 0.12, wt: here.wt * 0.12, ..here }, &[(0.03, 0.07), (0.011, 0.05)], 41)
        + speckles(&here, 0.09, 0.35, 0.14, 42);
    let panel = |t: [f64; 2]| {
        rectangle(&here, [0.15, 0.8], t) - rectangle(&here, [0.17, 0.78], [t[0] + 0.02, t[1] - 0.02])
    };
    let grooves = panel([0.2, 0.95]) + panel([1.15, 1.9]);
    let knob = inside((here.s - 0.87).hypot(here.t - 1.03) - 0.035, at.width());
    let value = mix(plaster(at, 43), 0.84, frame);
    let value = mix(value, wood - 0.2 * grooves, leaf);
    let value = mix(value, 0.93, knob);
    poster(at, [4.6, 0.8], [1.3, 1.0], 3, value)
}

/// Plaster with a row of posters.
fn poster_wall(at: &Spot, seed: u32) -> f64 {
    let mut value = plaster(at, seed);
    for i in 0..4_u32 {
        let h = hash(i as i32, 0, seed);
        let corner = [0.9 + f64::from(i) * 1.65 + 0.25 * unit(h, 0), 0.65 + 0.35 * unit(h, 1)];
        let size = [0.8 + 0.35 * unit(h, 2), 0.9 + 0.4 * unit(h, 3)];
        value = poster(at, corner, size, i + (seed & 3), value);
    }
    value
}

/// A framed print over what is behind it.
fn poster(at: &Spot, corner: [f64; 2], size: [f64; 2], kind: u32, behind: f64) -> f64 {
    let here = at.moved(corner[0], corner[1]);
    let frame = rectangle(&here, [0.0, size[0]], [0.0, size[1]]);
    if frame == 0.0 {
        return behind;
    }
    let w = here.width();
    let print = rectangle(&here, [0.04, size[0] - 0.04], [0.04, size[1] - 0.04]);
    let middle = here.moved(size[0] / 2.0, size[1] / 2.0);
    let picture = match kind % 4 {
        0 => mix(0.12, 0.9, checker(&here.moved(0.04, 0.04), 0.12)),
        1 => {
            let rings = (middle.s.hypot(middle.t) / 0.07).fract() - 0.5;
            let sharp = (rings.abs() - 0.25) * 0.07;
            mix(0.9, 0.15, mix(0.5, inside(sharp, w), resolved(0.07, w)))
        }
        2 => {
            let sky = 0.85 - 0.25 * here.t / size[1];
            let ridge = here.t - 0.3 * size[1] - 0.12 * (here.s * 8.0).sin() - 0.05 * (here.s * 23.0).sin();
            let sun = inside((here.s - 0.7 * size[0]).hypot(here.t - 0.78 * size[1]) - 0.09, w);
            mix(mix(0.28, sky, step(ridge, 0.0, w)), 0.98, sun)
        }
        _ => {
            let two = digit(&middle.moved(-0.32, -0.25), kind + 3, 0.5).max(digit(
                &middle.moved(0.04, -0.25),
                kind + 7,
                0.5,
            ));
            mix(0.85, 0.12, two)
        }
    };
    let detail =
        noise(&here, &[(0.05, 0.05), (0.018, 0.06)], 60 + kind) + speckles(&here, 0.07, 0.5, 0.2, 61 + kind);
    mix(behind, mix(0.10, picture + detail, print), frame)
}

/// Boards with gaps, grain and nails, in a frame with a diagonal brace.
fn wooden_crate(at: &Spot, size_m: [f64; 2], seed: u32) -> f64 {
    const BOARD: f64 = 0.115;
    let edge = 0.055;
    let grain = |along: Spot, seed| {
        let squeezed = Spot { s: along.s * 0.1, ws: along.ws * 0.1, ..along };
        noise(&squeezed, &[(0.022, 0.09), (0.008, 0.06)], seed) + speckles(&along, 0.075, 0.35, 0.22, seed)
    };
    let board = (at.t / BOARD).floor();
    let own = 0.14 * (unit(hash(board as i32, 3, seed), 0) - 0.5);
    let boards =
        0.56 + own + grain(at.moved(board * 0.7, 0.0), seed) - 0.42 * lines(at.t, BOARD, 0.012, at.wt);
    let slope = (size_m[1] - 2.0 * edge) / (size_m[0] - 2.0 * edge);
    let length = slope.hypot(1.0);
    let across = (at.t - edge - slope * (at.s - edge)) / length;
    let brace = inside(across.abs() - 0.045, at.width());
    let brace_edge = inside((across.abs() - 0.045).abs() - 0.004, at.width());
    let along = Spot { s: (at.s + slope * at.t) / length, t: across, ws: at.width(), wt: at.width() };
    let value = mix(boards, 0.66 + grain(along, seed ^ 9), brace);
    let value = mix(value, 0.2, brace_edge * 0.8);
    let inner = rectangle(at, [edge, size_m[0] - edge], [edge, size_m[1] - edge]);
    let inner_line =
        rectangle(at, [edge - 0.008, size_m[0] - edge + 0.008], [edge - 0.008, size_m[1] - edge + 0.008])
            - inner;
    let frame = 0.70 + grain(at.turned(), seed ^ 5);
    let nail = |s: f64, t: f64| inside((at.s - s).hypot(at.t - t) - 0.011, at.width());
    let half = edge / 2.0;
    let nails = [
        (half, half),
        (size_m[0] - half, half),
        (half, size_m[1] - half),
        (size_m[0] - half, size_m[1] - half),
    ]
    .iter()
    .map(|(s, t)| nail(*s, *t))
    .fold(0.0, f64::max);
    let value = mix(mix(frame, value, inner), 0.2, inner_line * 0.8);
    mix(value, 0.08, nails)
}

/// A carton with a strip of tape, a label with bars, and a printed number.
fn cardboard(at: &Spot, size_m: [f64; 2], seed: u32) -> f64 {
    let paper = 0.50
        + noise(at, &[(0.2, 0.03), (0.05, 0.04), (0.015, 0.05)], seed)
        + speckles(at, 0.065, 0.55, 0.24, seed)
        + 0.02 * lines(at.s, 0.012, 0.006, at.ws);
    let middle = size_m[0] / 2.0;
    let tape = band(at.s, middle - 0.03, middle + 0.03, at.ws);
    let value = mix(paper, 0.72 + noise(at, &[(0.02, 0.05)], seed ^ 3), tape * 0.8);
    let unit_m = (0.3 * size_m[0].min(size_m[1])).min(0.2);
    let label = at.moved(size_m[0] - 1.9 * unit_m, 0.25 * unit_m);
    let sticker = rectangle(&label, [0.0, 1.6 * unit_m], [0.0, unit_m]);
    let bar_cell = 0.012;
    let bar = f64::from(hash((label.s / bar_cell).floor() as i32, 0, seed) & 1);
    let bars = rectangle(&label, [0.15 * unit_m, 1.45 * unit_m], [0.12 * unit_m, 0.55 * unit_m])
        * mix(0.5, bar, resolved(4.0 * bar_cell, at.ws));
    let text = lines(label.t, 0.12 * unit_m, 0.05 * unit_m, at.wt)
        * rectangle(&label, [0.15 * unit_m, 1.1 * unit_m], [0.65 * unit_m, 0.92 * unit_m]);
    let value = mix(value, 0.93 - 0.8 * bars - 0.6 * text, sticker);
    let number = at.moved(0.22 * unit_m, size_m[1] - 1.35 * unit_m);
    mix(value, 0.12, digit(&number, seed >> 8, 1.1 * unit_m))
}

/// Doors with handles.
fn cabinet(at: &Spot, size_m: [f64; 2], seed: u32) -> f64 {
    let value = 0.60
        + noise(at, &[(0.3, 0.03), (0.04, 0.04), (0.013, 0.04)], seed)
        + speckles(at, 0.08, 0.5, 0.2, seed);
    let middle = size_m[0] / 2.0;
    let outline = 1.0 - rectangle(at, [0.02, size_m[0] - 0.02], [0.02, size_m[1] - 0.02]);
    let gap = band(at.s, middle - 0.005, middle + 0.005, at.ws).max(lines(at.t, 0.42, 0.01, at.wt));
    let height = at.t - ((at.t / 0.42).floor() + 0.5) * 0.42;
    let handle = band(height, -0.06, 0.06, at.wt) * band((at.s - middle).abs(), 0.04, 0.06, at.ws);
    mix(mix(value, 0.14, outline.max(gap)), 0.06, handle)
}

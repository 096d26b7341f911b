//! Digits and a few letters, five by seven dots: enough to label a scale on a picture.

use super::overlay::{Canvas, Colour};

/// Width of a letter and its gap, dots.
const ADVANCE: i64 = 6;
/// Height of a letter, dots.
pub(crate) const HEIGHT: i64 = 7;

/// Rows of a letter from the top, five bits each, the leftmost highest.
const fn rows(letter: char) -> [u8; 7] {
    match letter {
        '0' => [0b01110, 0b10001, 0b10011, 0b10101, 0b11001, 0b10001, 0b01110],
        '1' => [0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110],
        '2' => [0b01110, 0b10001, 0b00001, 0b00010, 0b00100, 0b01000, 0b11111],
        '3' => [0b11111, 0b00010, 0b00100, 0b00010, 0b00001, 0b10001, 0b01110],
        '4' => [0b00010, 0b00110, 0b01010, 0b10010, 0b11111, 0b00010, 0b00010],
        '5' => [0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110],
        '6' => [0b00110, 0b01000, 0b10000, 0b11110, 0b10001, 0b10001, 0b01110],
        '7' => [0b11111, 0b00001, 0b00010, 0b00100, 0b01000, 0b01000, 0b01000],
        '8' => [0b01110, 0b10001, 0b10001, 0b01110, 0b10001, 0b10001, 0b01110],
        '9' => [0b01110, 0b10001, 0b10001, 0b01111, 0b00001, 0b00010, 0b01100],
        '.' => [0, 0, 0, 0, 0, 0b01100, 0b01100],
        '-' => [0, 0, 0, 0b11111, 0, 0, 0],
        '+' => [0, 0b00100, 0b00100, 0b11111, 0b00100, 0b00100, 0],
        'm' => [0, 0, 0b11010, 0b10101, 0b10101, 0b10101, 0b10101],
        _ => [0; 7],
    }
}

/// Writes a text with its top left corner at a place, `scale` image pixels a dot.
pub(crate) fn write(canvas: &mut Canvas, (left, top): (i64, i64), scale: i64, text: &str, colour: Colour) {
    for (place, letter) in (0_i64..).zip(text.chars()) {
        for (row, bits) in (0_i64..).zip(rows(letter)) {
            for column in 0..5 {
                if bits >> (4 - column) & 1 == 1 {
                    let x = left + (place * ADVANCE + column) * scale;
                    canvas.fill((x, top + row * scale), (scale, scale), colour);
                }
            }
        }
    }
}

/// Width of a text in dots.
pub(crate) fn width(text: &str) -> i64 {
    text.chars().count() as i64 * ADVANCE
}

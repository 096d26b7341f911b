//! Hashes of lattice cells, which surfaces take their patterns from.

/// 32 random bits of a lattice cell.
pub(crate) fn hash(x: i32, y: i32, seed: u32) -> u32 {
    let mut h = (x as u32).wrapping_mul(0x85EB_CA6B)
        ^ (y as u32).wrapping_mul(0xC2B2_AE35).rotate_left(15)
        ^ seed.wrapping_mul(0x27D4_EB2F);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
    h ^ (h >> 15)
}

/// One byte of a hash as a number in `[0, 1)`.
pub(crate) fn unit(hash: u32, byte: u32) -> f64 {
    f64::from((hash >> (8 * byte)) & 0xFF) / 256.0
}

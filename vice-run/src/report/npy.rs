//! NumPy's array file, version 1.0 (numpy.lib.format).

/// A two-dimensional array of little-endian floats, row by row.
pub(crate) fn encode_f32(rows: u32, columns: u32, values: &[f32]) -> Vec<u8> {
    let mut bytes =
        header(&format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({rows}, {columns}), }}"));
    bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

fn header(description: &str) -> Vec<u8> {
    let mut header = description.to_string();
    // Magic, version, length and header together are a multiple of 64, the last byte a line feed.
    let unpadded = 10 + header.len() + 1;
    header.push_str(&" ".repeat(unpadded.next_multiple_of(64) - unpadded));
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend_from_slice(&(header.len() as u16).to_le_bytes());
    bytes.extend_from_slice(header.as_bytes());
    bytes
}

/// An array of little-endian doubles of any shape, the last index running fastest.
pub(crate) fn encode_f64(shape: &[usize], values: &[f64]) -> Vec<u8> {
    let sizes: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let mut bytes = header(&format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({sizes}), }}"));
    bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_header_is_padded_and_the_values_follow() {
        let bytes = super::encode_f32(1, 2, &[1.0, f32::NAN]);
        assert_eq!(bytes.len() % 64, 8);
        assert_eq!(bytes[bytes.len() - 9], b'\n');
        assert_eq!(bytes[bytes.len() - 8..][..4], 1.0_f32.to_le_bytes());
    }
}

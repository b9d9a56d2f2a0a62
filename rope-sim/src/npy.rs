//! NumPy's `.npy` files: C-ordered `float32` or `float64` out, `float32` or `float64` in.
//!
//! Layout (NumPy enhancement proposal 1): `\x93NUMPY`, version, header length, a
//! Python dictionary as text, padding to 64 bytes, the numbers.

use std::io::{self, Read, Write};

/// An array as read from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Size along each axis.
    pub shape: Vec<usize>,
    /// Numbers in C order.
    pub values: Vec<f64>,
}

/// Why a file is not read.
#[derive(Debug, thiserror::Error)]
pub enum NpyError {
    /// The file cannot be read to its end.
    #[error("cannot read the array")]
    Io(#[from] io::Error),
    /// Not an `.npy` file, or of a kind this reader does not know.
    #[error("not a readable .npy file: {what}")]
    Format {
        /// What is wrong.
        what: &'static str,
    },
}

/// Writes `values` (C order) with `shape` as little-endian `float64`.
///
/// # Errors
/// Whatever the writer reports; `InvalidInput` if the shape does not hold the values.
pub fn write_f64(out: impl Write, shape: &[usize], values: &[f64]) -> io::Result<()> {
    write(out, shape, "<f8", values.iter().map(|v| v.to_le_bytes()))
}

/// Writes `values` (C order) with `shape` as little-endian `float32`.
///
/// # Errors
/// As [`write_f64`].
pub fn write_f32(out: impl Write, shape: &[usize], values: &[f32]) -> io::Result<()> {
    write(out, shape, "<f4", values.iter().map(|v| v.to_le_bytes()))
}

fn write<const N: usize>(
    mut out: impl Write,
    shape: &[usize],
    kind: &str,
    values: impl ExactSizeIterator<Item = [u8; N]>,
) -> io::Result<()> {
    if shape.iter().product::<usize>() != values.len() {
        let what = format!("shape {shape:?} does not hold {} values", values.len());
        return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    }
    let sizes: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let mut header = format!(
        "{{'descr': '{kind}', 'fortran_order': False, 'shape': ({}), }}",
        sizes.trim_end()
    );
    let unpadded = 10 + header.len() + 1;
    header.extend(std::iter::repeat_n(
        ' ',
        unpadded.next_multiple_of(64) - unpadded,
    ));
    header.push('\n');
    let length =
        u16::try_from(header.len()).map_err(|e| io::Error::new(io::ErrorKind::InvalidInput, e))?;
    out.write_all(b"\x93NUMPY\x01\x00")?;
    out.write_all(&length.to_le_bytes())?;
    out.write_all(header.as_bytes())?;
    let bytes: Vec<u8> = values.flatten().collect();
    out.write_all(&bytes)
}

/// Reads a C-ordered little-endian `float32` or `float64` array.
///
/// # Errors
/// Unreadable input, another kind of file, another number type or order.
pub fn read(mut input: impl Read) -> Result<Array, NpyError> {
    let format = |what| NpyError::Format { what };
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes)?;
    if !bytes.starts_with(b"\x93NUMPY") {
        return Err(format("the first six bytes are not \\x93NUMPY"));
    }
    let (start, length) = match bytes.get(6..12) {
        Some([1, _, a, b, ..]) => (10, usize::from(u16::from_le_bytes([*a, *b]))),
        Some([2 | 3, _, a, b, c, d]) => (12, u32::from_le_bytes([*a, *b, *c, *d]) as usize),
        _ => return Err(format("unknown version")),
    };
    let end = start + length;
    let header = bytes
        .get(start..end)
        .ok_or(format("the header is cut short"))?;
    let header = String::from_utf8_lossy(header);
    if header.contains("'fortran_order': True") {
        return Err(format("Fortran order"));
    }
    let shape = header
        .split_once("'shape': (")
        .and_then(|(_, rest)| rest.split_once(')'))
        .map(|(sizes, _)| sizes.split(',').map(str::trim).filter(|s| !s.is_empty()))
        .and_then(|sizes| {
            sizes
                .map(|s| s.parse().ok())
                .collect::<Option<Vec<usize>>>()
        })
        .ok_or(format("no shape in the header"))?;
    let body = &bytes[end..];
    let values: Vec<f64> = if header.contains("'<f8'") {
        body.as_chunks::<8>()
            .0
            .iter()
            .map(|c| f64::from_le_bytes(*c))
            .collect()
    } else if header.contains("'<f4'") {
        body.as_chunks::<4>()
            .0
            .iter()
            .map(|c| f32::from_le_bytes(*c).into())
            .collect()
    } else {
        return Err(format("numbers are neither <f4 nor <f8"));
    };
    if shape.iter().try_fold(1_usize, |n, s| n.checked_mul(*s)) != Some(values.len()) {
        return Err(format("the shape does not match the amount of data"));
    }
    Ok(Array { shape, values })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read() {
        let values: Vec<f64> = (0..24).map(|i| f64::from(i) * 0.1 - 1.0).collect();
        for shape in [vec![24], vec![2, 4, 3]] {
            let mut file = Vec::new();
            write_f64(&mut file, &shape, &values).unwrap();
            assert_eq!((file.len() - 24 * 8) % 64, 0, "the numbers must be aligned");
            assert_eq!(
                read(&file[..]).unwrap(),
                Array {
                    shape,
                    values: values.clone()
                }
            );
        }
        let mut file = Vec::new();
        write_f32(&mut file, &[2], &[0.5, -1.25]).unwrap();
        assert_eq!(read(&file[..]).unwrap().values, [0.5, -1.25]);
    }

    #[test]
    fn broken_files_are_refused() {
        let mut file = Vec::new();
        write_f64(&mut file, &[3], &[1.0, 2.0, 3.0]).unwrap();
        assert!(read(&file[..file.len() - 8]).is_err());
        assert!(read(&file[..20]).is_err());
        assert!(read(&b"PK\x03\x04"[..]).is_err());
        assert!(write_f64(io::sink(), &[4], &[1.0]).is_err());
    }

    proptest::proptest! {
        #[test]
        fn spoilt_files_are_read_or_refused(
            changes in proptest::collection::vec((0_usize..200, proptest::num::u8::ANY), 1..6),
            cut in 0_usize..260,
        ) {
            let mut file = Vec::new();
            write_f64(&mut file, &[2, 3], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).unwrap();
            for (at, byte) in changes {
                let at = at % file.len();
                file[at] = byte;
            }
            file.truncate(cut);
            if let Ok(array) = read(&file[..]) {
                let size: usize = array.shape.iter().product();
                proptest::prop_assert_eq!(size, array.values.len());
            }
        }
    }
}

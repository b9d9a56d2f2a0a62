//! Arrays in a file that `numpy.load` opens: a ZIP archive with one `.npy` file each, as
//! `numpy.savez` writes it, without compression.
//!
//! The crates for the format bring a parser generator for the header, which is read by nobody
//! here; written, it is one line.

use anyhow::Result;
use rawzip::ZipArchiveWriter;
use std::io::Write;

/// The format's version 1.0, and what its header with these is a multiple of.
const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";
const ALIGNED: usize = 64;
/// Bytes of a character of an array of texts.
const CHARACTER: usize = 4;

/// A number or a truth value, as numpy has it in memory.
pub(super) trait Element {
    /// Type, in numpy's words.
    const KIND: &'static str;
    /// Appends its bytes.
    fn put(&self, bytes: &mut Vec<u8>);
}

macro_rules! number {
    ($($number:ty => $kind:literal),*) => {$(
        impl Element for $number {
            const KIND: &'static str = $kind;
            fn put(&self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
        }
    )*};
}
number!(f64 => "<f8", u64 => "<u8", u32 => "<u4");

impl Element for bool {
    const KIND: &'static str = "|b1";
    fn put(&self, bytes: &mut Vec<u8>) {
        bytes.push(u8::from(*self));
    }
}

/// A file that is being written.
pub(super) struct NpzFile {
    archive: ZipArchiveWriter<Vec<u8>>,
    arrays: u64,
}

impl NpzFile {
    /// A file without an array.
    pub(super) fn new() -> Self {
        Self {
            archive: ZipArchiveWriter::new(Vec::new()),
            arrays: 0,
        }
    }

    /// Adds an array of one dimension.
    pub(super) fn row<T: Element>(
        &mut self,
        name: &str,
        values: impl IntoIterator<Item = T>,
    ) -> Result<()> {
        let (mut bytes, mut count) = (Vec::new(), 0);
        for value in values {
            value.put(&mut bytes);
            count += 1;
        }
        self.add(name, T::KIND, &[count], &bytes)
    }

    /// Adds an array of one number.
    pub(super) fn scalar<T: Element>(&mut self, name: &str, value: T) -> Result<()> {
        let mut bytes = Vec::new();
        value.put(&mut bytes);
        self.add(name, T::KIND, &[], &bytes)
    }

    /// Adds an array whose first dimension is that of `rows`, each of which has the shape `inner`.
    pub(super) fn table<'a>(
        &mut self,
        name: &str,
        inner: &[usize],
        rows: impl IntoIterator<Item = &'a [f64]>,
    ) -> Result<()> {
        let (mut bytes, mut shape) = (Vec::new(), vec![0]);
        for row in rows {
            row.iter().for_each(|value| value.put(&mut bytes));
            shape[0] += 1;
        }
        shape.extend_from_slice(inner);
        self.add(name, f64::KIND, &shape, &bytes)
    }

    /// Adds an array of texts.
    pub(super) fn texts(&mut self, name: &str, texts: &[impl AsRef<str>]) -> Result<()> {
        let lengths = texts.iter().map(|text| text.as_ref().chars().count());
        let width = lengths.max().unwrap_or_default().max(1);
        let mut bytes = Vec::with_capacity(texts.len() * width * CHARACTER);
        for (i, text) in texts.iter().enumerate() {
            for character in text.as_ref().chars() {
                bytes.extend_from_slice(&u32::from(character).to_le_bytes());
            }
            bytes.resize((i + 1) * width * CHARACTER, 0);
        }
        self.add(name, &format!("<U{width}"), &[texts.len()], &bytes)
    }

    fn add(&mut self, name: &str, kind: &str, shape: &[usize], data: &[u8]) -> Result<()> {
        let shape: String = shape.iter().map(|length| format!("{length},")).collect();
        let mut header =
            format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
        let front = MAGIC.len() + size_of::<u16>();
        let padded = (front + header.len() + 1).next_multiple_of(ALIGNED) - front;
        header.extend(std::iter::repeat_n(' ', padded - 1 - header.len()));
        header.push('\n');
        let path = format!("{name}.npy");
        let (mut entry, config) = self.archive.new_file(&path).start()?;
        let mut writer = config.wrap(&mut entry);
        writer.write_all(MAGIC)?;
        writer.write_all(&u16::try_from(padded)?.to_le_bytes())?;
        writer.write_all(header.as_bytes())?;
        writer.write_all(data)?;
        let (_, descriptor) = writer.finish()?;
        entry.finish(descriptor)?;
        self.arrays += 1;
        Ok(())
    }

    /// The bytes of the file, and how many arrays are in it.
    pub(super) fn finish(self) -> Result<(Vec<u8>, u64)> {
        Ok((self.archive.finish()?, self.arrays))
    }
}

//! Columns of numbers, texts, lists and pictures, written as Parquet.
//!
//! Everything is nullable and nothing is null, as in the files of other programs, so that
//! these and those can be joined. Lists have one length in all rows.

use anyhow::{Context, Result};
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int64Type};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};
use run_log::files::create_folder;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What a column holds, row after row.
#[derive(Debug, Clone)]
pub(super) enum Values {
    /// Whole numbers.
    Integers(Vec<i64>),
    /// Numbers in single precision.
    Singles(Vec<f32>),
    /// Numbers in double precision.
    Doubles(Vec<f64>),
    /// Texts, in UTF-8.
    Texts(Vec<String>),
    /// JPEGs, and what each would be called as a file.
    Pictures(Vec<ByteArray>, Vec<String>),
}

/// A column.
#[derive(Debug, Clone)]
pub(super) struct Column {
    /// The feature's, or that of a column of `meta/`.
    pub(super) name: String,
    /// Lengths of the lists in a row, the outermost first; none for single values.
    pub(super) lengths: Vec<usize>,
    /// The values of all rows, one after the other.
    pub(super) values: Values,
}

impl Column {
    /// A column of single values.
    pub(super) fn single(name: impl Into<String>, values: Values) -> Self {
        Self::lists(name, &[], values)
    }

    /// A column of lists.
    pub(super) fn lists(name: impl Into<String>, lengths: &[usize], values: Values) -> Self {
        Self {
            name: name.into(),
            lengths: lengths.to_vec(),
            values,
        }
    }

    /// Its type, by which readers know lists, texts and pictures.
    fn schema(&self) -> Result<TypePtr> {
        if self.lengths.is_empty() {
            return self.innermost(&self.name);
        }
        let mut inner = self.innermost("element")?;
        for depth in (0..self.lengths.len()).rev() {
            let name = if depth == 0 { &*self.name } else { "element" };
            let repeated = Type::group_type_builder("list")
                .with_repetition(Repetition::REPEATED)
                .with_fields(vec![inner])
                .build()?;
            inner = Type::group_type_builder(name)
                .with_repetition(Repetition::OPTIONAL)
                .with_logical_type(Some(LogicalType::List))
                .with_fields(vec![Arc::new(repeated)])
                .build()?
                .into();
        }
        Ok(inner)
    }

    /// The type of what stands in the innermost list.
    fn innermost(&self, name: &str) -> Result<TypePtr> {
        Ok(match self.values {
            Values::Integers(_) => leaf(name, Physical::INT64, false)?,
            Values::Singles(_) => leaf(name, Physical::FLOAT, false)?,
            Values::Doubles(_) => leaf(name, Physical::DOUBLE, false)?,
            Values::Texts(_) => leaf(name, Physical::BYTE_ARRAY, true)?,
            Values::Pictures(..) => Type::group_type_builder(name)
                .with_repetition(Repetition::OPTIONAL)
                .with_fields(vec![
                    leaf("bytes", Physical::BYTE_ARRAY, false)?,
                    leaf("path", Physical::BYTE_ARRAY, true)?,
                ])
                .build()?
                .into(),
        })
    }

    fn write(&self, group: &mut SerializedRowGroupWriter<'_, File>) -> Result<()> {
        let lengths = &self.lengths[..];
        match &self.values {
            Values::Integers(values) => put::<Int64Type>(group, values, lengths, 1),
            Values::Singles(values) => put::<FloatType>(group, values, lengths, 1),
            Values::Doubles(values) => put::<DoubleType>(group, values, lengths, 1),
            Values::Texts(texts) => put::<ByteArrayType>(group, &bytes_of(texts), lengths, 1),
            Values::Pictures(pictures, names) => {
                put::<ByteArrayType>(group, pictures, lengths, 2)?;
                put::<ByteArrayType>(group, &bytes_of(names), lengths, 2)
            }
        }
    }
}

fn bytes_of(texts: &[String]) -> Vec<ByteArray> {
    texts.iter().map(|text| ByteArray::from(&**text)).collect()
}

fn leaf(name: &str, physical: Physical, is_text: bool) -> Result<TypePtr> {
    let leaf = Type::primitive_type_builder(name, physical)
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(is_text.then_some(LogicalType::String))
        .build()?;
    Ok(Arc::new(leaf))
}

/// Writes the next column of a group; `optional` groups and values lie around each value, those
/// of the lists not counted.
fn put<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, File>,
    values: &[T::T],
    lengths: &[usize],
    optional: i16,
) -> Result<()> {
    let mut column = group
        .next_column()?
        .context("the table has no such column")?;
    // All of them are there: each list adds one that is repeated and one that may be null.
    let depth = i16::try_from(lengths.len())?;
    let defined = vec![optional + 2 * depth; values.len()];
    let repeated: Vec<i16> = (0..values.len()).map(|i| repetition(i, lengths)).collect();
    let repeated = (depth > 0).then_some(&repeated[..]);
    column
        .typed::<T>()
        .write_batch(values, Some(&defined), repeated)?;
    Ok(column.close()?)
}

/// Which list the value at `index` goes on with: 0 begins a row, 1 the next element of the
/// outermost list, and so on.
fn repetition(index: usize, lengths: &[usize]) -> i16 {
    let mut level = 0;
    let mut span: usize = lengths.iter().product();
    for length in lengths {
        if index.is_multiple_of(span) {
            return level;
        }
        span /= length;
        level += 1;
    }
    level
}

/// A file of columns under way.
#[derive(Debug)]
pub(super) struct Table {
    path: PathBuf,
    writer: SerializedFileWriter<File>,
}

impl Table {
    /// Creates `path`, which must not exist, and the folders above it, for columns like these, with
    /// texts for programs that look for them.
    pub(super) fn create(path: &Path, like: &[Column], texts: &[(&str, String)]) -> Result<Self> {
        if let Some(folder) = path.parent() {
            create_folder(folder)?;
        }
        let fail = || format!("cannot write `{}`", path.display());
        let file = File::create_new(path).with_context(fail)?;
        let fields = like.iter().map(Column::schema).collect::<Result<_>>()?;
        let schema = Type::group_type_builder("schema")
            .with_fields(fields)
            .build()?;
        let texts = texts.iter().map(|(key, text)| KeyValue {
            key: (*key).to_owned(),
            value: Some(text.clone()),
        });
        // Pictures are compressed already, the rest is small beside them.
        let properties = WriterProperties::builder()
            .set_created_by(format!("wag version {}", shared_types::VERSION))
            .set_dictionary_enabled(false)
            .set_statistics_enabled(EnabledStatistics::Chunk)
            .set_key_value_metadata(Some(texts.collect()))
            .build();
        let writer = SerializedFileWriter::new(file, schema.into(), properties.into());
        Ok(Self {
            path: path.to_owned(),
            writer: writer.with_context(fail)?,
        })
    }

    /// Adds rows: all columns, in the order in which they were named.
    pub(super) fn add(&mut self, columns: &[Column]) -> Result<()> {
        let fail = || format!("cannot write `{}`", self.path.display());
        let mut group = self.writer.next_row_group().with_context(fail)?;
        for column in columns {
            column.write(&mut group).with_context(fail)?;
        }
        group.close().with_context(fail)?;
        Ok(())
    }

    /// Writes the file's end, without which nobody can read it.
    pub(super) fn finish(self) -> Result<()> {
        let fail = || format!("cannot write `{}`", self.path.display());
        self.writer.close().with_context(fail)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_know_which_list_they_go_on_with() {
        let levels = |count, lengths: &[usize]| -> Vec<i16> {
            (0..count).map(|i| repetition(i, lengths)).collect()
        };
        assert_eq!(levels(3, &[]), [0, 0, 0]);
        assert_eq!(levels(6, &[3]), [0, 1, 1, 0, 1, 1]);
        assert_eq!(levels(8, &[2, 2]), [0, 2, 1, 2, 0, 2, 1, 2]);
        assert_eq!(levels(4, &[3, 1, 1]), [0, 1, 1, 0]);
        assert_eq!(levels(3, &[1]), [0, 0, 0]);
    }
}

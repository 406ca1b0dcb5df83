//! Parquet: one row group, a column of doubles a channel and joint.

use super::Table;
use anyhow::Result;
use parquet::basic::{Compression, Repetition, Type as Physical};
use parquet::data_type::DoubleType;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use std::sync::Arc;

/// The bytes of the file.
///
/// # Errors
/// None in practice: every column has as many numbers as there are times.
pub fn write(table: &Table) -> Result<Vec<u8>> {
    let columns: Vec<(String, &[f64])> = table.columns().collect();
    let fields = columns
        .iter()
        .map(|(name, _)| {
            let field = Type::primitive_type_builder(name, Physical::DOUBLE).with_repetition(Repetition::REQUIRED);
            Ok(Arc::new(field.build()?))
        })
        .collect::<Result<Vec<_>>>()?;
    let schema = Arc::new(Type::group_type_builder("residuals").with_fields(fields).build()?);
    let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for (_, column) in &columns {
        if let Some(mut own) = group.next_column()? {
            own.typed::<DoubleType>().write_batch(column, None, None)?;
            own.close()?;
        }
    }
    group.close()?;
    writer.close()?;
    Ok(bytes)
}

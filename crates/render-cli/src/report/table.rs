//! Tables of words and numbers, for pages, terminals and other programs.

use serde_json::{Map, Value, json};

use super::number::significant;

/// Significant digits that people are shown. Programs get all of them.
const DIGITS: usize = 4;

/// Rows of words and numbers under named columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    name: String,
    columns: Vec<String>,
    rows: Vec<Vec<Cell>>,
}

/// What stands in a place of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Words.
    Text(String),
    /// A number; people are shown four significant digits of it.
    Number(f64),
    /// A whole number.
    Count(u64),
    /// Nothing.
    Empty,
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<u64> for Cell {
    fn from(count: u64) -> Self {
        Self::Count(count)
    }
}

impl<T: Into<Self>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Empty, Into::into)
    }
}

impl Cell {
    /// As people read it.
    pub(super) fn to_text(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Number(number) => significant(*number, DIGITS),
            Self::Count(count) => count.to_string(),
            Self::Empty => String::new(),
        }
    }

    pub(super) fn is_number(&self) -> bool {
        matches!(self, Self::Number(_) | Self::Count(_))
    }

    fn to_csv(&self) -> String {
        match self {
            Self::Text(text) => csv_field(text),
            // The shortest text that reads back as the same number.
            Self::Number(number) => format!("{number:?}"),
            Self::Count(_) | Self::Empty => self.to_text(),
        }
    }

    fn to_json(&self) -> Value {
        match self {
            Self::Text(text) => json!(text),
            Self::Number(number) if number.is_finite() => json!(number),
            Self::Count(count) => json!(count),
            Self::Number(_) | Self::Empty => Value::Null,
        }
    }
}

impl Table {
    /// A table without rows.
    pub fn new<const N: usize>(name: &str, columns: [&str; N]) -> Self {
        Self::with_columns(name, columns.map(str::to_owned).to_vec())
    }

    /// A table without rows, of as many columns as are known only when it is made.
    pub fn with_columns(name: &str, columns: Vec<String>) -> Self {
        Self { name: name.to_owned(), columns, rows: Vec::new() }
    }

    /// Adds a row.
    ///
    /// # Panics
    ///
    /// If it has not a cell for each column.
    pub fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        let cells: Vec<_> = cells.into_iter().collect();
        assert_eq!(cells.len(), self.columns.len(), "{}: a cell for each column", self.name);
        self.rows.push(cells);
    }

    /// The name of its file, without an extension.
    pub fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn columns(&self) -> &[String] {
        &self.columns
    }

    pub(super) fn rows(&self) -> &[Vec<Cell>] {
        &self.rows
    }

    /// Columns of even width, numbers to the right.
    pub fn to_text(&self) -> String {
        let rows: Vec<Vec<String>> =
            self.rows.iter().map(|row| row.iter().map(Cell::to_text).collect()).collect();
        let widths: Vec<usize> = (0..self.columns.len())
            .map(|column| {
                let of_rows = rows.iter().map(|row| row[column].chars().count());
                of_rows.fold(self.columns[column].chars().count(), usize::max)
            })
            .collect();
        let is_number = |column: usize| self.rows.iter().any(|row| row[column].is_number());
        let mut text = String::new();
        for row in std::iter::once(&self.columns).chain(&rows) {
            let mut line = String::new();
            for (column, (cell, &width)) in row.iter().zip(&widths).enumerate() {
                let gap = if column > 0 { "  " } else { "" };
                line.push_str(&match is_number(column) {
                    true => format!("{gap}{cell:>width$}"),
                    false => format!("{gap}{cell:<width$}"),
                });
            }
            text.push_str(line.trim_end());
            text.push('\n');
        }
        text
    }

    /// Comma-separated values (RFC 4180, with line feeds alone), numbers in full.
    pub fn to_csv(&self) -> String {
        let columns = self.columns.iter().map(|column| csv_field(column));
        let mut text = columns.collect::<Vec<_>>().join(",");
        text.push('\n');
        for row in &self.rows {
            text.push_str(&row.iter().map(Cell::to_csv).collect::<Vec<_>>().join(","));
            text.push('\n');
        }
        text
    }

    /// A list of objects.
    pub(super) fn to_json(&self) -> Value {
        let object = |row: &Vec<Cell>| {
            let pairs = self.columns.iter().cloned().zip(row.iter().map(Cell::to_json));
            Value::Object(Map::from_iter(pairs))
        };
        Value::Array(self.rows.iter().map(object).collect())
    }
}

/// `text` as a field of comma-separated values.
pub(super) fn csv_field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mut table = Table::new("t", ["what", "value, sr⁻¹"]);
        table.row(["a, \"b\"".into(), (0.1 + 0.2).into()]);
        table.row(["c".into(), Cell::Empty]);
        table.row(["dé".into(), 7_u64.into()]);
        table
    }

    #[test]
    fn people_see_even_columns() {
        let expected = "what    value, sr⁻¹\na, \"b\"          0.3\nc\ndé                7\n";
        assert_eq!(table().to_text(), expected);
    }

    #[test]
    fn programs_get_all_digits() {
        let expected = "what,\"value, sr⁻¹\"\n\"a, \"\"b\"\"\",0.30000000000000004\nc,\ndé,7\n";
        assert_eq!(table().to_csv(), expected);
        assert_eq!(table().to_json()[0]["value, sr⁻¹"], 0.1 + 0.2);
        assert_eq!(table().to_json()[1]["value, sr⁻¹"], Value::Null);
    }
}

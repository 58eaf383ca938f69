//! Plain text tables: aligned for a terminal, and at the same time Markdown, so that a README can quote them as they are.

use std::fmt;

/// A table under construction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Table<const COLUMNS: usize> {
    heads: [&'static str; COLUMNS],
    rows: Vec<[String; COLUMNS]>,
}

impl<const COLUMNS: usize> Table<COLUMNS> {
    /// A table with these column heads and no rows.
    pub fn new(heads: [&'static str; COLUMNS]) -> Self {
        Self {
            heads,
            rows: Vec::new(),
        }
    }

    /// Appends a row.
    pub fn row(&mut self, cells: [String; COLUMNS]) {
        self.rows.push(cells);
    }

    /// Whether every cell of `column` that is not empty or a dash for none begins as a number does, so that it reads best on the right.
    fn is_numeric(&self, column: usize) -> bool {
        let begins_number = |cell: &str| {
            cell.trim_start_matches(['-', '−', '+', '±', '<', '≤', ' '])
                .starts_with(|c: char| c.is_ascii_digit())
        };
        let mut cells = self
            .rows
            .iter()
            .map(|row| row[column].as_str())
            .filter(|cell| !cell.is_empty() && !cell.starts_with('–'))
            .peekable();
        cells.peek().is_some() && cells.all(begins_number)
    }
}

impl<const COLUMNS: usize> fmt::Display for Table<COLUMNS> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let length = |text: &str| text.chars().count();
        let widths: [usize; COLUMNS] = std::array::from_fn(|at| {
            let cells = self.rows.iter().map(|row| length(&row[at]));
            cells.chain([length(self.heads[at]), 3]).max().unwrap_or(3)
        });
        let right: [bool; COLUMNS] = std::array::from_fn(|at| self.is_numeric(at));
        let mut line = |cells: [&str; COLUMNS]| {
            for ((cell, width), right) in cells.into_iter().zip(widths).zip(right) {
                if right {
                    write!(f, "| {cell:>width$} ")?
                } else {
                    write!(f, "| {cell:<width$} ")?
                }
            }
            writeln!(f, "|")
        };
        line(self.heads)?;
        let rules: [String; COLUMNS] = std::array::from_fn(|at| match right[at] {
            true => "-".repeat(widths[at] - 1) + ":",
            false => "-".repeat(widths[at]),
        });
        line(rules.each_ref().map(String::as_str))?;
        self.rows
            .iter()
            .try_for_each(|row| line(row.each_ref().map(String::as_str)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_right_words_left_and_the_text_is_markdown() {
        let mut table = Table::new(["figure", "value", "unit"]);
        table.row(["lateral rms".into(), "0.11".into(), "mm".into()]);
        table.row(["drift".into(), "-12.5".into(), "µm".into()]);
        table.row(["bus load".into(), String::new(), "%".into()]);
        table.row(["start off".into(), "–".into(), "mm".into()]);
        let expected = "\
| figure      | value | unit |
| ----------- | ----: | ---- |
| lateral rms |  0.11 | mm   |
| drift       | -12.5 | µm   |
| bus load    |       | %    |
| start off   |     – | mm   |
";
        assert_eq!(table.to_string(), expected);
    }

    #[test]
    fn a_table_without_rows_is_its_heads() {
        assert_eq!(Table::new(["a"]).to_string(), "| a   |\n| --- |\n");
    }
}

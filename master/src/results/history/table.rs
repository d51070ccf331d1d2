//! A history read back from its file.

use std::{
    fs::{self, File},
    io::{BufRead, BufReader},
    path::Path,
};

use crate::results::Error;

/// A history read back.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Header cells, with their units.
    pub columns: Vec<String>,
    /// Rows of numbers, each as long as `columns`.
    pub rows: Vec<Vec<f64>>,
}

impl Table {
    /// Reads a `history.csv`.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Malformed`] for a row of another length than the header and for a cell that is no
    /// number.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = fs::read_to_string(path).map_err(Error::io("read", path))?;
        let malformed = |line: usize, what: String| Error::Malformed { path: path.to_owned(), line, what };
        let mut lines = text.lines();
        let header =
            lines.next().ok_or_else(|| malformed(1, "expected a header row, found nothing".into()))?;
        let columns = split_header(header);
        let mut rows = Vec::new();
        for (number, line) in (2..).zip(lines) {
            let row = line
                .split(',')
                .map(|cell| {
                    cell.parse().map_err(|_| malformed(number, format!("expected a number, found {cell:?}")))
                })
                .collect::<Result<Vec<f64>, _>>()?;
            if row.len() != columns.len() {
                return Err(malformed(
                    number,
                    format!("expected {} cells, found {}", columns.len(), row.len()),
                ));
            }
            rows.push(row);
        }
        Ok(Self { columns, rows })
    }

    /// The header cells of a `history.csv`, and of its rows the columns of these indices. A torn last row of a run under way is left out.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Malformed`] for a column that is not there and for a cell of one that is no number.
    pub fn read_columns(path: &Path, wanted: &[usize]) -> Result<(Vec<String>, Vec<Vec<f64>>), Error> {
        let malformed = |line: usize, what: String| Error::Malformed { path: path.to_owned(), line, what };
        let file = File::open(path).map_err(Error::io("read", path))?;
        let mut lines = BufReader::new(file).lines();
        let header = match lines.next() {
            Some(line) => line.map_err(Error::io("read", path))?,
            None => return Err(malformed(1, "expected a header row, found nothing".into())),
        };
        let columns = split_header(&header);
        if let Some(beyond) = wanted.iter().find(|index| **index >= columns.len()) {
            return Err(malformed(1, format!("expected column {beyond}, found {} columns", columns.len())));
        }
        let mut values = vec![Vec::new(); wanted.len()];
        if wanted.is_empty() {
            return Ok((columns, values));
        }
        for (number, line) in (2..).zip(lines) {
            let line = line.map_err(Error::io("read", path))?;
            let cells: Vec<&str> = line.split(',').collect();
            if cells.len() < columns.len() {
                break;
            }
            for (index, values) in wanted.iter().zip(&mut values) {
                let cell = cells[*index];
                let number: f64 = cell
                    .parse()
                    .map_err(|_| malformed(number, format!("expected a number, found {cell:?}")))?;
                values.push(number);
            }
        }
        Ok((columns, values))
    }

    /// The column of this name, without its unit: `kinetic`, `plate:internal`, `tip:vx`.
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let bare =
            |column: &String| column.rsplit_once(" [").map_or(column.as_str(), |(bare, _)| bare) == name;
        let index = self.columns.iter().position(bare)?;
        Some(self.rows.iter().map(|row| row[index]).collect())
    }
}

/// The cells of a header row; undoes [`super::cell`].
fn split_header(line: &str) -> Vec<String> {
    let mut cells = vec![String::new()];
    let mut quoted = false;
    let mut letters = line.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '"' if quoted && letters.peek() == Some(&'"') => {
                letters.next();
                cells.last_mut().expect("starts with one cell").push('"');
            }
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            _ => cells.last_mut().expect("starts with one cell").push(letter),
        }
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::{super::cell, *};
    use crate::results::HISTORY;

    #[test]
    fn single_columns_are_those_of_the_whole_table_and_a_torn_row_is_left_out() {
        let folder = tempfile::tempdir().expect("room");
        let path = folder.path().join(HISTORY);
        fs::write(&path, "cycle,\"a,b:vz [m/s]\",error\n1,2.5,0.0\n2,-3.5,1e-9\n3,4").expect("room");
        let (columns, values) = Table::read_columns(&path, &[2, 1]).expect("a table");
        assert_eq!(columns, ["cycle", "a,b:vz [m/s]", "error"]);
        assert_eq!(values, [[0.0, 1e-9], [2.5, -3.5]]);
        assert_eq!(Table::read_columns(&path, &[]).expect("a table").1, Vec::<Vec<f64>>::new());
        let beyond = Table::read_columns(&path, &[3]).expect_err("three columns");
        assert!(beyond.to_string().contains("expected column 3, found 3 columns"), "{beyond}");
    }

    #[test]
    fn header_cells_come_back_whatever_a_part_is_called() {
        let names = ["plate", "a,b", "say \"x\"", "\"", ",", "", "ärger [mm]"];
        let line = names.map(cell).join(",");
        assert_eq!(split_header(&line), names);
        assert_eq!(cell("two\nlines\t"), "two lines ");
    }
}

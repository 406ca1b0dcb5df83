//! A matrix of figures whose cells are shaded: a heat map with names at its rows and columns.

use super::{file, number};
use maud::html;

/// Height of a row, least width of a column, width of a character of a name and of the title at most.
const ROW: f64 = 25.0;
const COLUMN: f64 = 27.0;
const CHARACTER: f64 = 6.9;
const TITLE: f64 = 9.0;
/// Names of columns stand at this slope: sine and cosine of 45°.
const SLOPE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// A heat map.
#[derive(Debug)]
pub struct Matrix<'a> {
    /// Stands above it.
    pub title: &'a str,
    /// What the rows and the columns are.
    pub sides: [&'a str; 2],
    /// Names of the rows.
    pub rows: &'a [String],
    /// Names of the columns.
    pub columns: &'a [String],
    /// Cells row by row; `None` stays blank.
    pub cells: &'a [Vec<Option<Cell>>],
    /// Stands below it.
    pub note: &'a str,
}

/// One cell.
#[derive(Debug, Clone)]
pub struct Cell {
    /// How dark it is, 0 to 1.
    pub shade: f64,
    /// What stands in it.
    pub text: String,
    /// Whether it is framed.
    pub framed: bool,
    /// What it says when pointed at.
    pub tip: String,
}

impl Matrix<'_> {
    /// The text of an SVG file.
    pub fn svg(&self) -> String {
        let reach =
            |names: &[String]| CHARACTER * names.iter().map(|name| name.chars().count()).max().unwrap_or(0) as f64;
        let texts = self.cells.iter().flatten().flatten().map(|cell| cell.text.chars().count());
        let column = COLUMN.max(8.0 * texts.max().unwrap_or(0) as f64 + 8.0);
        let left = 16.0 + reach(self.rows).max(CHARACTER * self.sides[0].chars().count() as f64) + 12.0;
        let top = 52.0 + SLOPE * reach(self.columns) + 14.0;
        let right = left + column * self.columns.len() as f64;
        let bottom = top + ROW * self.rows.len() as f64;
        // The last names lean over the right edge.
        let end = |(j, name): (usize, &String)| {
            left + column * (j as f64 + 0.5) + SLOPE * CHARACTER * name.chars().count() as f64
        };
        let lean = self.columns.iter().enumerate().map(end).fold(right, f64::max) + 16.0;
        let note = 16.0 + 6.4 * self.note.chars().count() as f64 + 16.0;
        let title = 16.0 + TITLE * self.title.chars().count() as f64 + 16.0;
        let width = lean.max(note).max(title).ceil();
        let at = |i: usize, j: usize| (left + column * j as f64, top + ROW * i as f64);
        file(
            self.title,
            [width, bottom + 36.0],
            &html! {
                text.muted x=(number(left - 12.0)) y=(number(top - 8.0)) text-anchor="end" { (self.sides[0]) }
                text.muted x=(number(left)) y="42" { (self.sides[1]) }
                @for (j, name) in self.columns.iter().enumerate() {
                    @let (h, v) = (left + column * (j as f64 + 0.5) + 3.0, top - 7.0);
                    text x=(number(h)) y=(number(v)) transform={ "rotate(-45 " (number(h)) " " (number(v)) ")" } { (name) }
                }
                @for (i, (name, row)) in self.rows.iter().zip(self.cells).enumerate() {
                    text x=(number(left - 12.0)) y=(number(at(i, 0).1 + 0.5 * ROW + 4.5)) text-anchor="end" { (name) }
                    @for (j, cell) in row.iter().enumerate() {
                        @let (h, v) = at(i, j);
                        @let shade = cell.as_ref().map_or(0.0, |cell| cell.shade).clamp(0.0, 1.0);
                        g {
                            @if let Some(cell) = cell.as_ref().filter(|cell| !cell.tip.is_empty()) { title { (cell.tip) } }
                            rect.cell x=(number(h)) y=(number(v)) width=(number(column)) height=(ROW) style={ "--a:" (format!("{shade:.2}")) } {}
                            @if let Some(cell) = cell {
                                @if cell.framed { rect.framed x=(number(h + 1.0)) y=(number(v + 1.0)) width=(number(column - 2.0)) height=(ROW - 2.0) {} }
                                text x=(number(h + 0.5 * column)) y=(number(v + 0.5 * ROW + 4.5)) text-anchor="middle" { (cell.text) }
                            }
                        }
                    }
                }
                text.muted.small x="16" y=(number(bottom + 22.0)) { (self.note) }
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_is_there_and_the_names_are_escaped() {
        let cell = |text: &str, framed| Some(Cell { shade: 0.5, text: text.into(), framed, tip: String::new() });
        let cells = [vec![cell("1", true), None], vec![cell("22", false), cell("3", true)]];
        let names = ["a < b".to_owned(), "a long name".to_owned()];
        let matrix =
            Matrix { title: "t", sides: ["rows", "columns"], rows: &names, columns: &names, cells: &cells, note: "n" };
        let text = matrix.svg();
        assert_eq!((text.matches("class=\"cell\"").count(), text.matches("class=\"framed\"").count()), (4, 2));
        assert_eq!(text.matches("a &lt; b").count(), 2, "{text}");
        for word in [">22<", ">3<", ">1<"] {
            assert!(text.contains(word), "{word}");
        }
    }
}

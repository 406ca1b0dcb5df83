//! Text in the columns of a terminal: padding, cutting, wrapping, bars and colours.

use console::{Term, measure_text_width};
use gapscope_diagnosis::schema::Verdict;

/// Columns of a summary where there is no terminal, and at most; and at least, where a terminal has next to none.
pub const WIDTH: usize = 100;
const NARROW: usize = 40;
/// Columns before the text of a block.
pub const INDENT: usize = 9;

/// Rows under a heading that stands in the margin; a row too long for the terminal goes on below, further in.
pub fn block(lines: &mut Vec<String>, paint: &Paint, head: &str, rows: &[String]) {
    let width = paint.width - INDENT;
    let fit = |row: &String| match measure_text_width(row) {
        columns if columns <= width => vec![row.clone()],
        _ => {
            let inner = row.len() - row.trim_start().len();
            let broken = wrap(row.trim_start(), width.saturating_sub(inner + 2));
            broken.iter().enumerate().map(|(i, l)| " ".repeat(inner + if i == 0 { 0 } else { 2 }) + l).collect()
        }
    };
    for (i, row) in rows.iter().flat_map(fit).enumerate() {
        let margin = if i == 0 { paint.head(&pad(head, INDENT - 1)) } else { " ".repeat(INDENT - 1) };
        lines.push(format!("{margin} {row}"));
    }
}

/// A bar of `width` columns in eighths.
pub fn blocks(part: f64, width: usize) -> String {
    let eighths = if part.is_finite() { (part.clamp(0.0, 1.0) * 8.0 * width as f64).round() as usize } else { 0 };
    let mut bar = "█".repeat(eighths / 8);
    if let Some(end) = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"].get(eighths % 8) {
        bar.push_str(end);
    }
    pad(&bar, width)
}

/// Width of a column: its longest cell, within `most`.
pub fn column<'a>(cells: impl Iterator<Item = &'a str>, most: usize) -> usize {
    cells.map(|cell| cell.chars().count()).max().unwrap_or(0).min(most)
}

/// Text cut or filled to exactly `width` columns.
pub fn pad(text: &str, width: usize) -> String {
    let text = cut_to(text, width);
    let fill = width.saturating_sub(text.chars().count());
    text + &" ".repeat(fill)
}

/// A name filled to `width` columns and never cut: names differ at their ends.
pub fn name(text: &str, width: usize) -> String {
    let clean = clean(text);
    let fill = width.saturating_sub(clean.chars().count());
    clean + &" ".repeat(fill)
}

/// Text filled from the left to `width` columns.
pub fn fill(text: &str, width: usize) -> String {
    " ".repeat(width.saturating_sub(text.chars().count())) + text
}

/// Text within `width` columns and free of control characters, so that a log's words cannot steer the terminal.
pub fn cut_to(text: &str, width: usize) -> String {
    let clean = clean(text);
    if clean.chars().count() <= width {
        return clean;
    }
    let mut short: String = clean.chars().take(width.saturating_sub(1)).collect();
    short.push('…');
    short
}

/// Text broken at spaces into lines of at most `width` columns, to its last word. Spaces within a line stay as many as they are.
pub fn wrap(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = vec![];
    let mut spaces = 0;
    for word in text.split(' ') {
        if word.is_empty() {
            spaces += 1;
            continue;
        }
        match lines.last_mut() {
            Some(line) if measure_text_width(line) + spaces + 1 + measure_text_width(word) <= width => {
                line.push_str(&" ".repeat(spaces + 1));
                line.push_str(word);
            }
            _ => lines.push(word.to_string()),
        }
        spaces = 0;
    }
    lines
}

/// Text free of control characters, so that a log's words cannot steer the terminal.
pub fn clean(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// What the summary is printed on: colours where wanted, and columns.
pub struct Paint {
    /// Whether it is a terminal; elsewhere nothing is left out.
    pub terminal: bool,
    /// Whether it shows colours.
    pub color: bool,
    /// Columns.
    pub width: usize,
}

impl Paint {
    /// Standard output as it is: colours on a terminal alone, and not where `NO_COLOR` asks for none.
    pub fn here() -> Paint {
        let term = Term::stdout();
        let columns = term.size_checked().map_or(WIDTH, |(_, columns)| usize::from(columns));
        let color = term.is_term() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
        Paint { terminal: term.is_term(), color, width: columns.clamp(NARROW, WIDTH) }
    }

    /// A file or a pipe.
    pub fn plain() -> Paint {
        Paint { terminal: false, color: false, width: WIDTH }
    }

    fn with(&self, code: &str, text: &str) -> String {
        if self.color { format!("\u{1b}[{code}m{text}\u{1b}[0m") } else { text.to_string() }
    }

    /// A name that stands out.
    pub fn bold(&self, text: &str) -> String {
        self.with("1", text)
    }

    /// A heading in the margin.
    pub fn head(&self, text: &str) -> String {
        self.with("2", text)
    }

    /// A verdict in the colour of its tone.
    pub fn verdict(&self, text: &str, verdict: Verdict) -> String {
        let code = match verdict {
            Verdict::NoGap | Verdict::Explained => "1;32",
            Verdict::PartlyExplained => "1;33",
            Verdict::UnknownEffect | Verdict::NotExcited => "1;31",
        };
        self.with(code, text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapping_keeps_spaces_within_a_line_and_drops_them_at_its_ends() {
        assert_eq!(wrap("EXPLAINED  1 effect", 40), ["EXPLAINED  1 effect"]);
        assert_eq!(wrap("  EXPLAINED  1 effect explains ", 19), ["EXPLAINED  1 effect", "explains"]);
        assert_eq!(wrap("one   two", 8), ["one", "two"]);
        assert_eq!(wrap("a-word-that-is-wider  b", 6), ["a-word-that-is-wider", "b"]);
    }
}

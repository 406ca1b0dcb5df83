//! Text in the columns of a terminal: padding, cutting, wrapping, bars and colours.

use gapscope_diagnosis::schema::Verdict;

/// Columns of the terminal that a summary counts on.
pub const WIDTH: usize = 100;
/// Columns before the text of a block.
pub const INDENT: usize = 9;

/// Rows under a heading that stands in the margin.
pub fn block(lines: &mut Vec<String>, paint: &Paint, head: &str, rows: &[String]) {
    for (i, row) in rows.iter().enumerate() {
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

/// Text filled from the left to `width` columns.
pub fn fill(text: &str, width: usize) -> String {
    " ".repeat(width.saturating_sub(text.chars().count())) + text
}

/// Text within the terminal's width.
pub fn cut(text: &str) -> String {
    cut_to(text, WIDTH)
}

/// Text within `width` columns and free of control characters, so that a log's words cannot steer the terminal.
pub fn cut_to(text: &str, width: usize) -> String {
    let clean: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    if clean.chars().count() <= width {
        return clean;
    }
    let mut short: String = clean.chars().take(width.saturating_sub(1)).collect();
    short.push('…');
    short
}

/// Text broken at spaces into lines that fit beside the margin, at most `most` of them.
pub fn wrap(text: &str, most: usize) -> Vec<String> {
    let width = WIDTH - INDENT - 2;
    let mut lines: Vec<String> = vec![];
    for word in text.split(' ').filter(|w| !w.is_empty()) {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_string()),
        }
    }
    if lines.len() > most {
        lines.truncate(most);
        if let Some(last) = lines.last_mut() {
            last.push_str(" …");
        }
    }
    lines.iter().map(|line| cut_to(line, width + 2)).collect()
}

/// Colours of the terminal, where wanted.
pub struct Paint {
    /// Whether the terminal shows colours.
    pub color: bool,
}

impl Paint {
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

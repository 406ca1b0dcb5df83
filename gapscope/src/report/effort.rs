//! What drives push with: a torque where a joint turns, a force where it slides; a robot that has both gets the common word.
//!
//! All sentences are written for joints that turn, those of the diagnosis too. They are put into the robot's own word here.

use super::words;
use gapscope_diagnosis::schema::Regime;

/// The word of the texts.
const WRITTEN: &str = "torque";
/// Elements whose text stays: code is what a user types or a file holds.
const VERBATIM: [&str; 5] = ["code", "pre", "script", "style", "textarea"];
/// Attributes that are seen or heard.
const READ_OUT: [&str; 3] = ["aria-label=\"", "title=\"", "data-label=\""];

/// The word for what a robot's drives push with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort(&'static str);

impl Effort {
    /// Of a robot whose joints' regimes have these units.
    pub fn of(regimes: &[Regime]) -> Effort {
        Effort::of_units(regimes.iter().map(|regime| words::implied_unit(&regime.joint, regimes)))
    }

    /// Of joints whose efforts have these units, `N m` or `N`; torque where there are none.
    pub fn of_units<'a>(units: impl IntoIterator<Item = &'a str>) -> Effort {
        let (mut slides, mut turns) = (false, false);
        units.into_iter().for_each(|unit| if unit == "N" { slides = true } else { turns = true });
        Effort(match (slides, turns) {
            (true, false) => "force",
            (true, true) => "effort",
            _ => WRITTEN,
        })
    }

    /// The word itself.
    pub fn word(self) -> &'static str {
        self.0
    }

    /// A text with this word in it. Parts of names and paths stay, as `torque_bias` and `torque.csv` do.
    pub fn say(self, text: &str) -> String {
        if self.0 == WRITTEN {
            return text.to_owned();
        }
        // A slide has no turns.
        let text =
            &if self.0 == "force" { text.replace("cycles per turn", "phase per metre") } else { text.to_owned() };
        let mut said = String::with_capacity(text.len());
        let mut rest = text.as_str();
        while let Some(at) = rest.char_indices().find_map(|(at, _)| begins(&rest[at..]).then_some(at)) {
            let (before, found) = rest.split_at(at);
            let (word, after) = found.split_at(WRITTEN.len());
            said += before;
            if joined_before(&said) || joined_after(after) {
                said += word;
            } else if word.starts_with('T') {
                said += &words::capital(self.0);
            } else {
                said += self.0;
            }
            rest = after;
        }
        said + rest
    }

    /// HTML with this word in its texts and in what is read out of its attributes; code stays.
    pub fn say_page(self, html: &str) -> String {
        if self.0 == WRITTEN {
            return html.to_owned();
        }
        let mut said = String::with_capacity(html.len());
        let mut verbatim = 0_usize;
        for part in html.split_inclusive('>') {
            let (text, tag) = part.split_at(part.find('<').unwrap_or(part.len()));
            said += &if verbatim > 0 { text.to_owned() } else { self.say(text) };
            let name = tag.trim_start_matches(['<', '/']).split(|c: char| !c.is_alphanumeric()).next();
            if name.is_some_and(|name| VERBATIM.contains(&name)) {
                verbatim = if tag.starts_with("</") { verbatim.saturating_sub(1) } else { verbatim + 1 };
            }
            said += &self.say_tag(tag);
        }
        said
    }

    fn say_tag(self, tag: &str) -> String {
        let mut said = tag.to_owned();
        for name in READ_OUT {
            let Some(from) = said.find(name).map(|at| at + name.len()) else { continue };
            let to = said[from..].find('"').map_or(said.len(), |length| from + length);
            said.replace_range(from..to, &self.say(&said[from..to]));
        }
        said
    }
}

/// Whether a text begins with the word, with or without a capital.
fn begins(text: &str) -> bool {
    let head = text.as_bytes().get(..WRITTEN.len());
    head.is_some_and(|head| head.eq_ignore_ascii_case(WRITTEN.as_bytes()) && head[1..] == WRITTEN.as_bytes()[1..])
}

fn joined_before(text: &str) -> bool {
    text.ends_with(|c: char| c.is_alphanumeric() || "_-./\\".contains(c))
}

/// A full stop belongs to a name where a letter follows it; an `s` is the plural's.
fn joined_after(text: &str) -> bool {
    let text = text.strip_prefix('s').unwrap_or(text);
    let mut chars = text.chars();
    match chars.next() {
        Some('.') => chars.next().is_some_and(char::is_alphanumeric),
        Some(c) => c.is_alphanumeric() || "_-/\\".contains(c),
        None => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_word_follows_the_joints() {
        for (units, word) in
            [(vec!["N m", "N m"], "torque"), (vec!["N"], "force"), (vec!["N m", "N"], "effort"), (vec![], "torque")]
        {
            assert_eq!(Effort::of_units(units).word(), word);
        }
    }

    #[test]
    fn names_and_paths_stay() {
        let force = Effort("force");
        for (written, said) in [
            ("Torque and torques; torque.", "Force and forces; force."),
            ("torque_bias, torque.csv, /tmp/torque, x-torque", "torque_bias, torque.csv, /tmp/torque, x-torque"),
            ("(torque) torque, N", "(force) force, N"),
            ("cycles per turn 80 rad/m", "phase per metre 80 rad/m"),
            ("Größe: torque", "Größe: force"),
        ] {
            assert_eq!(force.say(written), said);
            assert_eq!(Effort(WRITTEN).say(written), written);
        }
    }

    #[test]
    fn code_and_attributes_that_nobody_hears_stay() {
        let page = r#"<p id="torque" aria-label="Torque gap">torque <code>torque <b>torque</b></code> torque</p>"#;
        let said = r#"<p id="torque" aria-label="Force gap">force <code>torque <b>torque</b></code> force</p>"#;
        assert_eq!(Effort("force").say_page(page), said);
    }
}

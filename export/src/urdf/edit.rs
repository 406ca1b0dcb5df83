//! Edits of an XML text: attributes set, elements put in, and every other byte left as it is.

use roxmltree::Node;
use std::ops::Range;

/// Edits of a text, collected in any order.
pub struct Edits<'a> {
    text: &'a str,
    edits: Vec<(Range<usize>, String)>,
}

impl<'a> Edits<'a> {
    /// No edit yet of the text that the nodes were read from.
    pub fn new(text: &'a str) -> Edits<'a> {
        Edits { text, edits: Vec::new() }
    }

    /// Sets an attribute of an element, which may lack it. The value must need no escaping, as numbers and names of ours do not.
    pub fn set(&mut self, node: Node, name: &str, value: &str) {
        if let Some(attribute) = node.attributes().find(|a| a.name() == name && a.namespace().is_none()) {
            self.edits.push((attribute.range_value(), value.to_owned()));
        } else {
            let at = self.name_end(node);
            self.edits.push((at..at, format!(" {name}=\"{value}\"")));
        }
    }

    /// Takes an attribute out.
    pub fn remove(&mut self, node: Node, name: &str) {
        if let Some(attribute) = node.attributes().find(|a| a.name() == name && a.namespace().is_none()) {
            self.edits.push((attribute.range(), String::new()));
        }
    }

    /// Puts elements behind the start tag of an element, on lines of their own where its children are.
    pub fn insert_first(&mut self, node: Node, elements: &str) {
        let range = node.range();
        if self.closes_itself(node) {
            return self.open(node, elements);
        }
        let at = node.first_child().map_or_else(|| self.closing_tag(&range), |child| child.range().start);
        let inner = format!("{}  ", self.indent(range.start));
        let lined = self.text[at..].trim_start_matches([' ', '\t', '\r']).starts_with('\n');
        let new = if lined { format!("\n{}", lines(elements, &inner)) } else { elements.replace('\n', "") };
        self.edits.push((at..at, new));
    }

    /// Puts elements before the end tag of an element.
    pub fn insert_last(&mut self, node: Node, elements: &str) {
        let range = node.range();
        if self.closes_itself(node) {
            return self.open(node, elements);
        }
        let at = self.closing_tag(&range);
        let before = self.text[..at].trim_end_matches([' ', '\t']);
        let new = if before.ends_with('\n') {
            let outer = &self.text[before.len()..at];
            let inner = format!("{outer}  ");
            // The blanks before the end tag begin the first line.
            format!("{}\n{outer}", &lines(elements, &inner)[outer.len()..])
        } else {
            elements.replace('\n', "")
        };
        self.edits.push((at..at, new));
    }

    /// The text with all edits.
    pub fn apply(mut self) -> String {
        self.edits.sort_by_key(|(range, _)| (range.start, range.end));
        let (mut out, mut at) = (String::with_capacity(self.text.len() + 1024), 0);
        for (range, new) in &self.edits {
            // Two edits of one place would be two effects on one number: the sums are made before.
            if range.start >= at {
                out.push_str(&self.text[at..range.start]);
                out.push_str(new);
                at = range.end;
            }
        }
        out.push_str(&self.text[at..]);
        out
    }

    /// Opens an element that closes itself.
    fn open(&mut self, node: Node, elements: &str) {
        let range = node.range();
        let name = &self.text[range.start + 1..self.name_end(node)];
        let outer = self.indent(range.start);
        let new = format!(">\n{}\n{outer}</{name}>", lines(elements, &format!("{outer}  ")));
        self.edits.push((range.end - 2..range.end, new));
    }

    fn closes_itself(&self, node: Node) -> bool {
        !node.has_children() && self.text[node.range()].ends_with("/>")
    }

    fn closing_tag(&self, range: &Range<usize>) -> usize {
        self.text[range.clone()].rfind("</").map_or(range.end, |at| range.start + at)
    }

    /// Behind the name in the start tag.
    fn name_end(&self, node: Node) -> usize {
        let range = node.range();
        let ends = |c: char| c.is_whitespace() || c == '/' || c == '>';
        range.start + 1 + self.text[range.start + 1..range.end].find(ends).unwrap_or(0)
    }

    /// The blanks that the line of a place begins with.
    fn indent(&self, at: usize) -> &'a str {
        let line = self.text[..at].rfind('\n').map_or(0, |end| end + 1);
        let blanks = self.text[line..].len() - self.text[line..].trim_start_matches([' ', '\t']).len();
        &self.text[line..line + blanks]
    }
}

fn lines(elements: &str, indent: &str) -> String {
    elements.lines().map(|line| format!("{indent}{line}")).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use roxmltree::Document;

    fn edited(text: &str, edit: impl Fn(&mut Edits, Node)) -> String {
        let document = Document::parse(text).unwrap();
        let mut edits = Edits::new(text);
        edit(&mut edits, document.root_element());
        edits.apply()
    }

    #[test]
    fn only_what_is_meant_changes() {
        let set = |edits: &mut Edits, node: Node| {
            edits.set(node, "b", "7");
            edits.set(node, "c", "8");
            edits.set(node, "d", "9");
        };
        assert_eq!(
            edited("<!-- x --><a\n b = '1'  ><?k?></a>", set),
            "<!-- x --><a c=\"8\" d=\"9\"\n b = '7'  ><?k?></a>"
        );
        assert_eq!(edited("<a/>", set), "<a b=\"7\" c=\"8\" d=\"9\"/>");
        assert_eq!(edited("<a b=\"1\" d=\"2\"/>", |e, n| e.remove(n, "b")), "<a  d=\"2\"/>");
    }

    #[test]
    fn elements_go_where_they_belong_in_any_layout() {
        let first = |edits: &mut Edits, node: Node| edits.insert_first(node, "<x>\n  <y/>\n</x>");
        let last = |edits: &mut Edits, node: Node| edits.insert_last(node, "<x/>");
        assert_eq!(edited("<a><b/></a>", first), "<a><x>  <y/></x><b/></a>");
        assert_eq!(edited("<a>\n  <b/>\n</a>", first), "<a>\n  <x>\n    <y/>\n  </x>\n  <b/>\n</a>");
        assert_eq!(edited("<a n='1'/>", first), "<a n='1'>\n  <x>\n    <y/>\n  </x>\n</a>");
        assert_eq!(edited("<a></a>", last), "<a><x/></a>");
        assert_eq!(edited("<a>\n  <b/>\n</a>", last), "<a>\n  <b/>\n  <x/>\n</a>");
    }
}

//! Bytes of a message (OMG CDR, XTypes 1.3 section 7.4: plain, both byte orders) read by a layout.

use super::definition::{Count, Kind, Layout, Number};

/// What a field holds.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    /// A number, or a sequence of them.
    Numbers(Vec<f64>),
    /// A text, or a sequence of them.
    Texts(Vec<String>),
    /// Messages; each a list of the values of its fields.
    Messages(Vec<Vec<Value>>),
}

/// Why bytes are no message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Broken {
    /// They end before it does, or hold what a message cannot hold.
    Bytes,
    /// They are in a form that is not read.
    Encoding,
}

/// The values of a message's fields.
pub(super) fn decode(layout: &Layout, bytes: &[u8]) -> Result<Vec<Value>, Broken> {
    let (big, widest) = match bytes.get(..2) {
        Some([0, 0]) => (true, 8),
        Some([0, 1]) => (false, 8),
        Some([0, 6]) => (true, 4),
        Some([0, 7]) => (false, 4),
        Some(_) => return Err(Broken::Encoding),
        None => return Err(Broken::Bytes),
    };
    let bytes = bytes.get(4..).ok_or(Broken::Bytes)?;
    let mut cursor = Cursor { bytes, at: 0, big, widest, room: 2 * bytes.len() + 1000 };
    cursor.message(layout)
}

struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    big: bool,
    /// Numbers wider than this are aligned as if they were this wide.
    widest: usize,
    /// Values that may still be made: messages without fields take no bytes.
    room: usize,
}

impl Cursor<'_> {
    fn message(&mut self, layout: &Layout) -> Result<Vec<Value>, Broken> {
        layout.0.iter().map(|(_, kind, count)| self.field(kind, *count)).collect()
    }

    fn field(&mut self, kind: &Kind, count: Count) -> Result<Value, Broken> {
        let count = match count {
            Count::One => 1,
            Count::Fixed(count) => count,
            Count::Any => self.number(Number::Unsigned, 4)? as usize,
        };
        // A count beyond the bytes that are left is damage, and would be a great deal of memory.
        self.room = self.room.checked_sub(count).ok_or(Broken::Bytes)?;
        if count > self.bytes.len().saturating_sub(self.at) {
            return Err(Broken::Bytes);
        }
        Ok(match kind {
            Kind::Number(number, size) => {
                Value::Numbers((0..count).map(|_| self.number(*number, *size)).collect::<Result<_, _>>()?)
            }
            Kind::Text => Value::Texts((0..count).map(|_| self.text()).collect::<Result<_, _>>()?),
            Kind::Message(layout) => {
                Value::Messages((0..count).map(|_| self.message(layout)).collect::<Result<_, _>>()?)
            }
        })
    }

    fn number(&mut self, number: Number, size: usize) -> Result<f64, Broken> {
        self.at = self.at.next_multiple_of(size.min(self.widest));
        let cell = self.bytes.get(self.at..self.at + size).ok_or(Broken::Bytes)?;
        self.at += size;
        let mut bytes = [0; 8];
        bytes[..size].copy_from_slice(cell);
        if self.big {
            bytes[..size].reverse();
        }
        let whole = u64::from_le_bytes(bytes);
        let unused = 64 - 8 * size as u32;
        Ok(match (number, size) {
            (Number::Float, 8) => f64::from_bits(whole),
            (Number::Float, _) => f64::from(f32::from_bits(whole as u32)),
            (Number::Signed, _) => (((whole << unused) as i64) >> unused) as f64,
            (Number::Unsigned, _) => whole as f64,
        })
    }

    fn text(&mut self) -> Result<String, Broken> {
        let length = self.number(Number::Unsigned, 4)? as usize;
        let end = self.at.checked_add(length).ok_or(Broken::Bytes)?;
        let text = self.bytes.get(self.at..end).ok_or(Broken::Bytes)?;
        self.at = end;
        let text = text.strip_suffix(&[0]).unwrap_or(text);
        std::str::from_utf8(text).map(str::to_owned).map_err(|_| Broken::Bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::super::definition::layout;
    use super::*;

    #[test]
    fn numbers_are_aligned_and_texts_end_with_zero() {
        let layout = layout("p/M", "uint8 a\nfloat64[] x\nstring s\nint16 b\n").unwrap();
        let bytes: Vec<u8> = [
            vec![0, 1, 0, 0, 7, 0, 0, 0, 1, 0, 0, 0],
            1.5f64.to_le_bytes().to_vec(),
            vec![2, 0, 0, 0, b'k', 0],
            (-2i16).to_le_bytes().to_vec(),
        ]
        .concat();
        let expected = vec![
            Value::Numbers(vec![7.0]),
            Value::Numbers(vec![1.5]),
            Value::Texts(vec!["k".into()]),
            Value::Numbers(vec![-2.0]),
        ];
        assert_eq!(decode(&layout, &bytes).unwrap(), expected);
        for cut in 4..bytes.len() {
            assert_eq!(decode(&layout, &bytes[..cut]), Err(Broken::Bytes), "cut at {cut}");
        }
        assert_eq!(decode(&layout, &[0, 2, 0, 0]), Err(Broken::Encoding));
        // A count of four billion is damage, not memory.
        assert_eq!(decode(&layout, &[0, 1, 0, 0, 7, 0, 0, 0, 255, 255, 255, 255]), Err(Broken::Bytes));
    }
}

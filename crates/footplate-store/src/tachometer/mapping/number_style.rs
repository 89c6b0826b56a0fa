//! How the numbers of a foreign recording are written: with a point or a comma, and what stands between fields.

use std::borrow::Cow;

/// Separators that are looked for in a header, the most telling first.
const SEPARATORS: [u8; 4] = [b';', b'\t', b'|', b','];

/// Separator and decimal mark of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct NumberStyle {
    pub(super) separator: u8,
    /// `None` if each field shows it.
    pub(super) decimal: Option<char>,
}

impl NumberStyle {
    /// What stands between the names of a header: the character of which there are most, and of equally many the one that
    /// names and numbers have less.
    pub(super) fn separator_of(header: &[u8]) -> u8 {
        let (mut best, mut most) = (b',', 0);
        for separator in SEPARATORS {
            let count = count_outside_quotes(header, separator);
            if count > most {
                (best, most) = (separator, count);
            }
        }
        best
    }

    /// A number with a point, whatever it was written with; what it should be where that cannot be said.
    pub(super) fn point<'t>(&self, text: &'t str) -> Result<Cow<'t, str>, String> {
        let (comma, point) = (text.contains(','), text.contains('.'));
        match self.decimal {
            Some('.') if comma => Err("a number with a decimal point, as `decimal` says".to_owned()),
            Some(',') if point => Err("a number with a decimal comma, as `decimal` says".to_owned()),
            _ if comma && point => Err("a number without separators of thousands".to_owned()),
            _ if comma => Ok(text.replacen(',', ".", 1).into()),
            _ => Ok(text.into()),
        }
    }
}

fn count_outside_quotes(text: &[u8], wanted: u8) -> usize {
    let mut quoted = false;
    let mut count = 0;
    for byte in text {
        quoted ^= *byte == b'"';
        count += usize::from(!quoted && *byte == wanted);
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_separator_is_the_one_there_are_most_of() {
        for (header, separator) in [
            ("t;v1;v2\n", b';'),
            ("t,v1,v2\n", b','),
            ("t\tv1\tv2\n", b'\t'),
            ("\"t, s\";\"v, km/h\"\n", b';'),
            ("t\n", b','),
        ] {
            assert_eq!(NumberStyle::separator_of(header.as_bytes()), separator, "{header}");
        }
    }

    #[test]
    fn a_comma_is_a_point_unless_there_are_both() {
        let found = NumberStyle { separator: b';', decimal: None };
        assert_eq!(found.point("12,5").unwrap(), "12.5");
        assert_eq!(found.point("12.5").unwrap(), "12.5");
        assert!(found.point("1.012,5").unwrap_err().contains("thousands"));
        let said = NumberStyle { separator: b';', decimal: Some(',') };
        assert!(said.point("12.5").unwrap_err().contains("decimal comma"));
    }
}

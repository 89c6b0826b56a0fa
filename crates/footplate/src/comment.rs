//! Comments in lines of text for the program: all behind `#`.

/// The sign that begins a comment.
const SIGN: char = '#';

/// The part of a line before its comment, with the spaces in front of it.
pub(crate) fn without_comment(line: &str) -> &str {
    line.split_once(SIGN).map_or(line, |(before, _)| before)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_sign_begins_the_comment() {
        assert_eq!(without_comment("stop 24 # at C13 # later"), "stop 24 ");
        assert_eq!(without_comment("#"), "");
        assert_eq!(without_comment("  halt"), "  halt");
        assert_eq!(without_comment(""), "");
    }
}

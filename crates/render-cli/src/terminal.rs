//! What a reader's terminal can show: its width, its colours, no control characters.

use std::{
    env,
    io::{self, IsTerminal},
};

/// How to lay out text for standard output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terminal {
    /// Characters in a line, in 40..=200.
    pub columns: usize,
    /// Whether text may be coloured.
    pub colors: bool,
}

impl Terminal {
    /// As the environment says: `COLUMNS` (80 if unset), and colours on a terminal unless
    /// `NO_COLOR` is set.
    pub fn from_environment() -> Self {
        let columns = env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
        let no_color = env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
        let dumb = env::var_os("TERM").is_some_and(|term| term == "dumb");
        Self {
            columns: columns.unwrap_or(80).clamp(40, 200),
            colors: io::stdout().is_terminal() && !no_color && !dumb,
        }
    }

    /// `text` in lines of at most `columns` characters, broken at spaces; the second line and
    /// those after it begin with `indent` spaces. A word that is wider than a line stays whole.
    pub fn wrap(self, text: &str, indent: usize) -> String {
        let mut wrapped = String::new();
        let mut used = 0;
        for (at, word) in text.split(' ').enumerate() {
            let width = word.chars().count();
            if at > 0 && used + 1 + width > self.columns {
                wrapped.push('\n');
                wrapped.extend(std::iter::repeat_n(' ', indent));
                used = indent;
            } else if at > 0 {
                wrapped.push(' ');
                used += 1;
            }
            wrapped.push_str(word);
            used += width;
        }
        wrapped
    }
}

/// `text` with `·` for control characters, which could make a terminal do as a file says.
pub fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { '·' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const NARROW: Terminal = Terminal { columns: 10, colors: false };

    #[test]
    fn text_is_wrapped_at_spaces() {
        assert_eq!(NARROW.wrap("one two three four", 2), "one two\n  three\n  four");
        assert_eq!(NARROW.wrap("exactly 10", 2), "exactly 10");
        assert_eq!(NARROW.wrap("a äöüäöüäöüäöü b", 2), "a\n  äöüäöüäöüäöü\n  b");
        assert_eq!(NARROW.wrap("  a   b c d", 4), "  a   b c\n    d");
        assert_eq!(NARROW.wrap("", 2), "");
    }

    #[test]
    fn control_characters_are_shown_not_obeyed() {
        assert_eq!(printable("a\x1b[2J\tü"), "a·[2J·ü");
    }
}

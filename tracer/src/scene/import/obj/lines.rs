//! The logical lines of an OBJ or MTL text: without comments, with joined continuations, numbered as in the file.

use std::borrow::Cow;

use super::super::text::physical_lines;
use super::numbers::is_in_a_number;

/// A logical line: a keyword and what follows it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Line<'t> {
    /// Number of the first physical line, counted from 1.
    pub(super) number: usize,
    /// Text without surrounding blanks, not empty.
    pub(super) text: Cow<'t, str>,
}

impl Line<'_> {
    pub(super) fn keyword(&self) -> &str {
        keyword(&self.text)
    }

    /// The text behind the keyword.
    pub(super) fn rest(&self) -> &str {
        self.text.get(self.keyword().len()..).unwrap_or_default().trim_ascii_start()
    }
}

fn keyword(text: &str) -> &str {
    text.split_ascii_whitespace().next().unwrap_or_default()
}

/// Whether the rest of a line with this keyword is a name: names may contain `#`, and paths may end in a backslash.
fn holds_a_name(keyword: &str) -> bool {
    const NAMED: [&str; 10] =
        ["o", "g", "usemtl", "mtllib", "newmtl", "bump", "disp", "decal", "norm", "refl"];
    NAMED.iter().any(|named| keyword.eq_ignore_ascii_case(named))
        || keyword.get(..4).is_some_and(|start| start.eq_ignore_ascii_case("map_"))
}

/// The logical lines of a text.
pub(super) fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    let mut physical = physical_lines(text).zip(1..);
    std::iter::from_fn(move || {
        loop {
            let (line, number) = physical.next()?;
            let line = line.trim_ascii();
            if holds_a_name(keyword(line)) {
                return Some(Line { number, text: Cow::Borrowed(line) });
            }
            let mut end = without_comment(line);
            let mut joined = String::new();
            while let Some(continued) = end.strip_suffix('\\') {
                joined.push_str(continued);
                joined.push(' ');
                end = physical.next().map_or("", |(line, _)| without_comment(line.trim_ascii()));
            }
            let text = if joined.is_empty() {
                Cow::Borrowed(end)
            } else {
                Cow::Owned((joined + end).trim_ascii().to_owned())
            };
            if !text.is_empty() {
                return Some(Line { number, text });
            }
        }
    })
}

fn without_comment(line: &str) -> &str {
    let mut hashes = line.match_indices('#').map(|(at, _)| at);
    let end = hashes.find(|&at| !is_in_a_number(line, at)).unwrap_or(line.len());
    line.get(..end).unwrap_or_default().trim_ascii_end()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Vec<(usize, String)> {
        lines(text).map(|line| (line.number, line.text.into_owned())).collect()
    }

    fn owned(expected: &[(usize, &str)]) -> Vec<(usize, String)> {
        expected.iter().map(|(number, text)| (*number, (*text).to_owned())).collect()
    }

    #[test]
    fn comments_and_blank_lines_are_removed_and_numbers_kept() {
        let text = "# head\\\n\nv 1 2 3 # first\r\n  f 1 2 3#x\n#\n\tv 4\t5 6  ";
        assert_eq!(read(text), owned(&[(3, "v 1 2 3"), (4, "f 1 2 3"), (6, "v 4\t5 6")]));
    }

    #[test]
    fn continuations_are_joined_under_the_first_number() {
        let text = "f 1 2 \\\r\n3 \\\n 4 # end\nv 1 2\\\n";
        assert_eq!(read(text), owned(&[(1, "f 1 2  3  4"), (4, "v 1 2")]));
        assert_eq!(read("f 1 \\"), owned(&[(1, "f 1")]));
        assert_eq!(read("\\\n\\\n"), []);
    }

    #[test]
    fn special_numbers_are_no_comments() {
        let text = "vn -1.#IND 0 1.#QNAN # odd\nv 1.# 2\nv 1.#x\nvn 0 0 1.#INF#";
        let expected = [(1, "vn -1.#IND 0 1.#QNAN"), (2, "v 1."), (3, "v 1."), (4, "vn 0 0 1.#INF")];
        assert_eq!(read(text), owned(&expected));
    }

    #[test]
    fn names_keep_their_hashes_and_backslashes() {
        let text = "usemtl red#2\nmtllib C:\\models\\\nmap_Kd a#b.png\nv 1 2 3";
        let expected =
            [(1, "usemtl red#2"), (2, "mtllib C:\\models\\"), (3, "map_Kd a#b.png"), (4, "v 1 2 3")];
        assert_eq!(read(text), owned(&expected));
        let line = lines("usemtl  dark red").next().unwrap();
        assert_eq!((line.keyword(), line.rest()), ("usemtl", "dark red"));
    }
}

#!/usr/bin/env python3
"""Checks that comments, messages and documents use no word of scripts/words.txt.

Prints file, line, word and replacement of each finding, and ends with status 1 if there is one. `--report` counts the findings
by folder and by word instead, and ends with status 0.
"""

import argparse
import io
import re
import subprocess
import sys
import tokenize
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from checks import rust_text  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
LIST = ROOT / "scripts" / "words.txt"
# The list itself, and the checks, which quote it.
LEFT_OUT = {"scripts/words.txt", "scripts/check_words.py"}
SECTION = re.compile(r"\[(prose|names)(?: except (\S+))?\]$")
# A space of a pattern: spaces, or a line break with indentation.
GAP = r"(?:[ ]+|[ ]*\n[ ]*)"
FENCE = re.compile(r"^( *)(```|~~~).*?(?:^ *\2[`~]*[ ]*$|\Z)", re.MULTILINE | re.DOTALL)
INLINE_CODE = re.compile(r"(`+)(?!`).+?(?<!`)\1(?!`)", re.DOTALL)
LINK_TARGET = re.compile(r"\]\([^)\s]*\)")


class BadList(Exception):
    """An invalid line of words.txt."""


@dataclass(frozen=True)
class Word:
    """A line of words.txt."""

    source: str
    instead: str
    is_name: bool
    # A folder in which the word is allowed.
    exception: str = ""

    def is_refused_in(self, file):
        return not (self.exception and Path(file).is_relative_to(self.exception))


@dataclass(frozen=True)
class Finding:
    """A word in a file."""

    file: str
    line: int
    text: str
    word: Word

    def __str__(self):
        return f"{self.file}:{self.line}: '{self.text}': write {self.word.instead}"


def read_list(text):
    """The words of a list in the format of words.txt."""
    words, kind, exception = [], None, ""
    for number, line in enumerate(text.splitlines(), 1):
        line = line.strip()
        if not line or line.startswith("#"):
            continue
        if section := SECTION.match(line):
            kind, exception = section[1], section[2] or ""
            continue
        source, arrow, instead = (part.strip() for part in line.partition(" => "))
        if not arrow or not instead or kind is None:
            raise BadList(f"words.txt:{number}: expected 'PATTERN => REPLACEMENT' in a section, found '{line}'")
        try:
            re.compile(source)
        except re.error as error:
            raise BadList(f"words.txt:{number}: {error}") from error
        words.append(Word(source, instead, kind == "names", exception))
    return words


def without_code(text):
    """Prose without what is in backticks, in fences, or the target of a link; all positions stay."""
    for pattern in (FENCE, INLINE_CODE, LINK_TARGET):
        text = pattern.sub(lambda found: rust_text.blank(found.group()), text)
    return text


def rust_prose(source):
    """Comments without their marks, and strings."""
    comments = rust_text.only(source, {rust_text.COMMENT})
    comments = re.sub(r"^( *)(//[/!]?|/\*+!?|\*(?!/))", lambda mark: " " * len(mark.group()), comments, flags=re.MULTILINE)
    strings = rust_text.only(source, {rust_text.STRING})
    # A string that continues in the next line.
    return without_code(comments), strings.replace("\\\n", " \n")


def python_prose(source):
    """Comments and strings."""
    kept = [" " * len(line) for line in source.splitlines()]
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in (tokenize.COMMENT, tokenize.STRING):
            continue
        for offset, text in enumerate(token.string.split("\n")):
            row, column = token.start[0] - 1 + offset, token.start[1] if offset == 0 else 0
            kept[row] = kept[row][:column] + text.replace("#", " ", 1) + kept[row][column + len(text) :]
    return without_code("\n".join(kept))


def texts(file, source):
    """(prose texts, code) of a file; positions in them are those in the file."""
    suffix = file.suffix
    # The comments and strings of C++ are near enough to those of Rust.
    if suffix in (".rs", ".cpp", ".hpp"):
        return rust_prose(source), rust_text.only(source, {rust_text.CODE})
    if suffix == ".py":
        return (python_prose(source),), ""
    if suffix == ".md":
        return (without_code(source),), ""
    # Shell, TOML and the like: comments only.
    comments = re.compile(r"(^|\s)#+(.*)$", re.MULTILINE)
    kept = list(rust_text.blank(source))
    for found in comments.finditer(source):
        kept[found.start(2) : found.end(2)] = found[2]
    return (without_code("".join(kept)),), ""


class Search:
    """Finds the words of a list. One expression looks for all of a kind: a separate search for each would take minutes."""

    def __init__(self, words):
        self.prose = self.expression([word for word in words if not word.is_name], re.IGNORECASE)
        self.names = self.expression([word for word in words if word.is_name], re.NOFLAG)

    @staticmethod
    def expression(words, flags):
        if not words:
            return None
        groups = "|".join(f"(?P<word{index}>{word.source.replace(' ', GAP)})" for index, word in enumerate(words))
        return words, re.compile(rf"(?<!\w)(?=\w)(?:{groups})(?!\w)", flags)

    def findings(self, name, source):
        """All in one file, in the order of lines."""
        prose, code = texts(Path(name), source)
        found = []
        for expression, parts in ((self.prose, prose), (self.names, (code,))):
            if expression is None:
                continue
            words, pattern = expression
            for text in parts:
                for match in pattern.finditer(text):
                    word = words[int(match.lastgroup.removeprefix("word"))]
                    if not word.is_refused_in(name):
                        continue
                    line = text.count("\n", 0, match.start()) + 1
                    found.append(Finding(name, line, re.sub(r"\s+", " ", match.group()), word))
        return sorted(found, key=lambda finding: finding.line)


def files(base):
    """The files that git tracks or would add, as paths below `base`."""
    listed = subprocess.run(
        ["git", "-C", str(base), "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        check=True,
        capture_output=True,
        text=True,
    ).stdout.split("\0")
    for name in sorted(set(listed)):
        path = base / name
        if not name or name in LEFT_OUT or not path.is_file():
            continue
        if path.suffix in (".rs", ".cpp", ".hpp", ".md", ".py", ".sh", ".toml", ".yml") or name in (".ci/run", "justfile"):
            yield name


def folder_of(name):
    """The folder by which a file is counted: up to three names deep."""
    parts = Path(name).parts[:-1]
    return "/".join(parts[:3]) or "."


def report(findings, words):
    by_folder, by_word = Counter(), Counter()
    for finding in findings:
        by_folder[folder_of(finding.file), finding.word.is_name] += 1
        by_word[finding.word] += 1
    print(f"{'folder':<36} {'prose':>6} {'names':>6}")
    for folder in sorted({folder for folder, _ in by_folder}):
        print(f"{folder:<36} {by_folder[folder, False]:>6} {by_folder[folder, True]:>6}")
    for kind, is_name in (("prose", False), ("names", True)):
        counts = [(by_word[word], word) for word in words if word.is_name == is_name]
        print(f"\n{kind}: {sum(count for count, _ in counts)}")
        for count, word in sorted(counts, key=lambda entry: -entry[0]):
            print(f"{count:>6}  {word.source}")


def self_test():
    """Runs the check on examples."""
    search = Search(read_list("[prose]\nwhoever => the worker\ngiven up => dropped\n(?<!Blinn-)Phong => Blinn-Phong\n"
                              "[names]\nDesk => State\n"
                              "[prose except a/b]\nstands => is\n"))
    cases = [
        ("a.rs", "// Whoever comes\n", [(1, "Whoever")]),
        ("a.rs", "//! is given\n//! up here\n", [(1, "given up")]),
        ("a.rs", 'let a = "is given up";\n', [(1, "given up")]),
        ("a.rs", 'let a = "is given \\\n    up";\n', [(1, "given up")]),
        ("a.rs", 'let a = r#"a "whoever" b"#; let b = \'"\'; // "given up"\n', [(1, "given up"), (1, "whoever")]),
        ("a.rs", "let whoever = 1; // `whoever`\n", []),
        ("a.rs", "struct Desk; // Desk\nstruct Desks;\n", [(1, "Desk")]),
        ("a.rs", "/* one\n/* whoever */ whoever */ whoever\n", [(2, "whoever"), (2, "whoever")]),
        ("a.rs", "/// ```\n/// // whoever\n/// ```\n/// whoever\n", [(4, "whoever")]),
        ("a.md", "# Whoever\n\n`whoever` [given up](given/up)\n```\nwhoever\n```\nPhong, Blinn-Phong\n",
         [(1, "Whoever"), (3, "given up"), (7, "Phong")]),
        ("a.md", "given\n\nup\n", []),
        ("a.py", 'whoever = 1  # whoever\n"""Given\n    up."""\n', [(1, "whoever"), (2, "Given up")]),
        ("a.sh", "whoever=1 # whoever\n", [(1, "whoever")]),
        ("a.toml", "a = 'given up' # so\n", []),
        ("a/b/c.md", "whoever stands\n", [(1, "whoever")]),
        ("a/bc.md", "whoever stands\n", [(1, "whoever"), (1, "stands")]),
    ]
    failed = 0
    for name, source, expected in cases:
        found = [(finding.line, finding.text) for finding in search.findings(name, source)]
        if found != expected:
            print(f"self-test {name} {source!r}: found {found}, expected {expected}")
            failed += 1
    for bad in ("whoever => x", "[prose]\nwhoever", "[prose]\n(who => x"):
        try:
            read_list(bad)
            print(f"self-test: {bad!r} was taken")
            failed += 1
        except BadList:
            pass
    return failed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--report", action="store_true", help="count the findings by folder and by word")
    parser.add_argument("--self-test", action="store_true", help="run the check on examples")
    parser.add_argument("paths", nargs="*", help="only files below these, seen from the root")
    arguments = parser.parse_args()
    if arguments.self_test:
        return 1 if self_test() else 0
    words = read_list(LIST.read_text(encoding="utf-8"))
    search, findings = Search(words), []
    for name in files(ROOT):
        if arguments.paths and not any(Path(name).is_relative_to(path) for path in arguments.paths):
            continue
        findings += search.findings(name, (ROOT / name).read_text(encoding="utf-8"))
    if arguments.report:
        report(findings, words)
        return 0
    for finding in findings:
        print(finding)
    print(f"{len(findings)} words of scripts/words.txt" if findings else "no word of scripts/words.txt")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())

"""Splits Rust source into code, comments and literals, by a lexer of the few tokens that matter for that."""

import re

CODE = "code"
COMMENT = "comment"
STRING = "string"
CHARACTER = "character"

# What may begin something other than code. A lifetime ('a) is code: a character needs its closing quote.
START = re.compile(
    r"""
    (?P<line>//[^\n]*)
  | (?P<block>/\*)
  | (?P<raw>(?<![A-Za-z0-9_])[bc]?r(?P<hashes>\#*)")
  | (?P<string>(?:(?<![A-Za-z0-9_])[bc])?"(?:\\.|[^"\\])*")
  | (?P<character>(?:(?<![A-Za-z0-9_])b)?'(?:\\(?:x[0-9a-fA-F]{2}|u\{[0-9a-fA-F_]+\}|.)|[^\\'\n])')
    """,
    re.VERBOSE | re.DOTALL,
)
BLOCK_EDGE = re.compile(r"/\*|\*/")


def end_of_block(source, position):
    """The index behind the block comment that begins at `position`: they nest."""
    depth = 0
    for edge in BLOCK_EDGE.finditer(source, position):
        depth += 1 if edge.group() == "/*" else -1
        if depth == 0:
            return edge.end()
    return len(source)


def pieces(source):
    """Yields (kind, start, end) of all of `source`, in order, without gaps."""
    position = 0
    while found := START.search(source, position):
        if found.start() > position:
            yield CODE, position, found.start()
        kind, end = COMMENT, found.end()
        if found["block"]:
            end = end_of_block(source, found.start())
        elif found["raw"]:
            closing = source.find('"' + found["hashes"], found.end())
            kind, end = STRING, len(source) if closing < 0 else closing + 1 + len(found["hashes"])
        elif found["string"]:
            kind = STRING
        elif found["character"]:
            kind = CHARACTER
        yield kind, found.start(), end
        position = end
    if position < len(source):
        yield CODE, position, len(source)


def blank(text):
    """Spaces in place of `text`; its line breaks stay, so that lines keep their numbers."""
    return re.sub(r"[^\n]", " ", text)


def only(source, kinds):
    """`source` with everything but the pieces of `kinds` blanked."""
    return "".join(
        source[start:end] if kind in kinds else blank(source[start:end]) for kind, start, end in pieces(source)
    )

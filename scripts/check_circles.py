#!/usr/bin/env python3
"""Checks that no folder of a crate takes part in a circle of imports.

At each level of a crate, the modules of one folder (files and folders) are points, and an arrow leads from one to another
where a `use` or a path in the code of the first (or of anything below it) leads to the second. Re-exports are followed. A
circle with a folder in it is an error; circles of files of one folder are allowed (`--files` shows them as well). Arrows
between a folder's mod.rs and what is in the folder do not count, and nor do tests.
"""

import argparse
import contextlib
import io
import itertools
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from checks import modules  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
LINES_OF_AN_ARROW = 3


def arrows(root):
    """{level: {(from, to): {(file, line): path}}}: a level is the path of a folder, `from` and `to` are names in it."""
    found = defaultdict(lambda: defaultdict(dict))
    for module in root.walk():
        for reference in module.references:
            for owner in module.owners(reference.path):
                edge = split(module.path, owner.path)
                if edge:
                    level, source, target = edge
                    found[level][source, target].setdefault((module.file, reference.line), reference.path)
    return found


def split(source, target):
    """The level at which two paths part, and their names there; none where one is inside the other."""
    shared = 0
    while shared < min(len(source), len(target)) and source[shared] == target[shared]:
        shared += 1
    if shared in (len(source), len(target)):
        return None
    return source[:shared], source[shared], target[shared]


def circles(edges):
    """The groups of two or more names each of which reaches all others (strongly connected components), sorted."""
    following = defaultdict(set)
    for source, target in edges:
        following[source].add(target)

    def reached(start):
        seen, open_names = set(), [start]
        while open_names:
            for name in following[open_names.pop()]:
                if name not in seen:
                    seen.add(name)
                    open_names.append(name)
        return seen

    reach = {name: reached(name) for name in list(following)}
    groups = set()
    for name, others in reach.items():
        group = frozenset(other for other in others if name in reach.get(other, ()))
        if len(group) > 1:
            groups.add(group)
    return sorted(sorted(group) for group in groups)


def below(root, level):
    module = root
    for name in level:
        module = module.children[name]
    return module


def check(file, base, files_too, all_lines):
    """Prints the circles of one crate; returns their number."""
    root = modules.read_crate(file)
    count = 0
    for level, edges in sorted(arrows(root).items()):
        here = below(root, level)
        for group in circles(edges):
            folders = [name for name in group if here.children[name].is_folder]
            if not folders and not files_too:
                continue
            count += 1
            place = "/".join((str(file.parent.relative_to(base)),) + level)
            names = ", ".join(name + "/" * here.children[name].is_folder for name in group)
            print(f"{place}: a circle of {len(group)}: {names}")
            inside = [(edge, lines) for edge, lines in edges.items() if set(edge) <= set(group)]
            # Arrows with the fewest uses first: they are the easiest to remove.
            for (source, target), lines in sorted(inside, key=lambda arrow: (len(arrow[1]), arrow[0])):
                print(f"  {source} -> {target}: {len(lines)} " + ("line" if len(lines) == 1 else "lines"))
                for (where, line), path in itertools.islice(lines.items(), None if all_lines else LINES_OF_AN_ARROW):
                    print(f"    {where.relative_to(base)}:{line}: {'::'.join(path)}")
    return count


def check_all(base, files_too=False, all_lines=False):
    return sum(check(file, base, files_too, all_lines) for file in modules.crate_roots(base))


def self_test():
    """Runs the check on examples."""
    clean = {
        "lib.rs": "mod a; mod b; pub use b::Deep;",
        "a/mod.rs": "mod inner; use crate::b::Deep; pub(in crate::b) struct Own; // use crate::b::c",
        "a/inner.rs": "use super::Own; #[cfg(test)] mod tests { use crate::b; } fn f() { \"crate::b::g()\"; }",
        "b/mod.rs": "mod deep; pub use deep::Deep; #[cfg(test)] use crate::a::Own;",
        "b/deep.rs": "pub struct Deep; struct S { #[cfg(test)] seen: crate::a::Own, lane: [u8; 'a' as usize] }",
    }
    cases = [
        ("clean", {}, 0),
        ("by use", {"b/deep.rs": "use crate::a; pub struct Deep;"}, 1),
        ("by a path in code", {"b/deep.rs": "pub struct Deep(crate::a::Own);"}, 1),
        ("by super", {"b/deep.rs": "pub struct Deep(super::super::a::Own);"}, 1),
        ("by a group", {"b/deep.rs": "use crate::{a::{Own, self}}; pub struct Deep;"}, 1),
        (
            "through the root's re-export",
            {"lib.rs": "mod a; mod b; pub use a::Own; pub use b::Deep;", "b/deep.rs": "use crate::Own; pub struct Deep;"},
            1,
        ),
        (
            "through a glob",
            {"lib.rs": "mod a; mod b; pub use a::*;", "b/deep.rs": "use crate::Own; pub struct Deep;"},
            1,
        ),
        ("with a file", {"lib.rs": "mod a; mod b; mod c;", "c.rs": "use crate::a::Own;", "b/deep.rs": "use crate::c::f;",
                         "a/mod.rs": "use crate::b; pub struct Own;"}, 1),
        ("files only", {"a/mod.rs": "mod inner; mod other;", "a/inner.rs": "use super::other::x;",
                        "a/other.rs": "use super::inner::y;"}, 0),
        ("one level down", {"a/mod.rs": "mod inner; mod p;", "a/inner.rs": "use super::p::X;",
                            "a/p/mod.rs": "mod x;", "a/p/x.rs": "use super::super::inner::y; pub struct X;"}, 1),
    ]
    failed = 0
    for name, changes, expected in cases:
        with tempfile.TemporaryDirectory() as folder:
            base = Path(folder)
            (base / "Cargo.toml").write_text("[package]\n", encoding="utf-8")
            for path, text in {**clean, **changes}.items():
                file = base / "src" / path
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(text, encoding="utf-8")
            with contextlib.redirect_stdout(io.StringIO()):
                found = check_all(base)
        if found != expected:
            print(f"self-test '{name}': {found} circles, expected {expected}")
            failed += 1
    return failed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--files", action="store_true", help="show circles of files of one folder as well")
    parser.add_argument("--lines", action="store_true", help=f"show all lines of an arrow, not {LINES_OF_AN_ARROW}")
    parser.add_argument("--self-test", action="store_true", help="try the check on made-up crates")
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT)
    arguments = parser.parse_args()
    if arguments.self_test:
        return 1 if self_test() else 0
    count = check_all(arguments.folder.resolve(), arguments.files, arguments.lines)
    print(f"{count} circles of folders" if count else "no folder imports in a circle")
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())

"""The modules of a crate and the paths by which they refer to each other, read from its source without a compiler.

Code under `#[cfg(test)]` is left out: a test may use anything. Visibilities (`pub(in crate::x)`) are not references.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

from checks import rust_text

TOKEN = re.compile(r"\$?(?:r#)?[A-Za-z_][A-Za-z0-9_]*|::|[^\s\w]|\d[\w.]*")
NAME = re.compile(r"\$?[A-Za-z_]\w*$")
ITEM_KEYWORDS = {"struct", "enum", "union", "trait", "fn", "type", "const", "static"}
ITEM_STARTS = ITEM_KEYWORDS | {"mod", "use", "impl", "unsafe", "async", "extern", "macro_rules", "let"}
OPENING, CLOSING = {"{", "(", "["}, {"}", ")", "]"}
# Re-exports of re-exports of ...: no real tree is deeper.
MOST_STEPS = 32


@dataclass
class Reference:
    """A path in the code of a module."""

    path: tuple
    line: int
    is_glob: bool = False


@dataclass
class Module:
    """A module of a crate: a file, or a `mod name { ... }` in one."""

    path: tuple
    file: Path
    parent: "Module" = None
    children: dict = field(default_factory=dict)
    imports: dict = field(default_factory=dict)  # name -> path, by `use`
    globs: list = field(default_factory=list)  # paths P of `use P::*`
    items: set = field(default_factory=set)
    references: list = field(default_factory=list)

    @property
    def is_folder(self):
        """Whether files belong to it besides its own; files of tests do not count."""
        return any(child.file != self.file for child in self.children.values())

    def walk(self):
        """This module and all below it."""
        yield self
        for child in self.children.values():
            yield from child.walk()

    def owners(self, path, steps=0):
        """The modules that `path`, as written in this module, leads through to an item.

        The last one has the item; the others re-export it. Empty for paths to other crates.
        """
        if steps > MOST_STEPS or not path:
            return []
        first, rest = path[0], list(path[1:])
        if first in ("crate", "$crate"):
            here = self.root()
        elif first == "self":
            here = self
        elif first == "super":
            here = self.parent
            if here is None:
                return []
        elif first in self.children:
            here = self.children[first]
        elif first in self.imports and self.imports[first][0] != first:
            return self.owners(self.imports[first] + tuple(rest), steps + 1)
        else:
            return []
        while rest and rest[0] == "super" and here.parent is not None:
            here = here.parent
            rest.pop(0)
        return here.descend(rest, steps)

    def descend(self, rest, steps):
        """The owners of the path `rest` below this module."""
        if not rest:
            return [self]
        name, below = rest[0], tuple(rest[1:])
        if name in self.children:
            return self.children[name].descend(below, steps)
        if name in self.imports and name not in self.items:
            return [self] + self.owners(self.imports[name] + below, steps + 1)
        if name not in self.items:
            for glob in self.globs:
                for target in self.owners(glob, steps + 1)[-1:]:
                    if target is not self and target.offers(name):
                        return [self] + target.descend(rest, steps + 1)
        return [self]

    def offers(self, name):
        return name in self.items or name in self.children or name in self.imports

    def root(self):
        return self if self.parent is None else self.parent.root()


class Parser:
    """One file: fills a module, and parses the files of the modules that it declares."""

    def __init__(self, module, folder):
        source = module.file.read_text(encoding="utf-8")
        code = rust_text.only(source, {rust_text.CODE})
        self.tokens = []
        for number, line in enumerate(code.split("\n"), 1):
            self.tokens += [(text, number) for text in TOKEN.findall(line)]
        self.position = 0
        self.module = module
        self.folder = folder
        self.open_modules = []  # (depth of its brace, module around it)
        self.depth = 0

    def text(self, ahead=0):
        at = self.position + ahead
        return self.tokens[at][0] if 0 <= at < len(self.tokens) else ""

    def line(self):
        return self.tokens[self.position][1]

    def parse(self):
        while self.position < len(self.tokens):
            self.step()

    def step(self):
        token = self.text()
        if token == "#" and self.text(1) in ("[", "!"):
            self.attribute()
        elif token == "pub" and self.text(1) == "(":
            self.position += 1
            self.skip_group()
        elif token == "mod" and NAME.match(self.text(1)) and self.text(2) in (";", "{"):
            self.declaration()
        elif token == "use" and self.text(-1) != "::":
            self.use()
        elif token in ITEM_KEYWORDS and NAME.match(self.text(1)):
            self.item(self.text(1))
            self.position += 2
        elif token == "macro_rules" and self.text(1) == "!":
            self.item(self.text(2))
            self.position += 3
        elif NAME.match(token) and self.text(1) == "::" and self.text(-1) != "::":
            self.expression()
        else:
            self.brace(token)
            self.position += 1

    def item(self, name):
        """Notes an item of the module; those of its functions and of types are not its own."""
        own_depth = self.open_modules[-1][0] + 1 if self.open_modules else 0
        if self.depth == own_depth:
            self.module.items.add(name)

    def brace(self, token):
        if token == "{":
            self.depth += 1
        elif token == "}":
            self.depth -= 1
            if self.open_modules and self.open_modules[-1][0] == self.depth:
                self.module = self.open_modules.pop()[1]

    def skip_group(self):
        """Moves behind the bracket that closes the one here; returns the tokens between."""
        depth, start = 0, self.position
        while self.position < len(self.tokens):
            token = self.text()
            depth += (token in OPENING) - (token in CLOSING)
            self.position += 1
            if depth == 0:
                break
        return [text for text, _ in self.tokens[start + 1 : self.position - 1]]

    def attribute(self):
        inner = self.text(1) == "!"
        self.position += 2 if inner else 1
        words = self.skip_group()
        is_test = words[:3] == ["cfg", "(", "test"] or words[:5] == ["cfg", "(", "all", "(", "test"] or words == ["test"]
        if is_test and inner:
            self.position = len(self.tokens)
        elif is_test:
            self.skip_item()

    def skip_item(self):
        """Moves behind what an attribute belongs to: an item, or a field, an arm, an argument."""
        while self.text() == "#":
            self.position += 1
            self.skip_group()
        start = self.text()
        if start == "pub":
            after = 1
            if self.text(1) == "(":
                while self.text(after) != ")":
                    after += 1
                after += 1
            start = self.text(after)
        is_item = start in ITEM_STARTS
        while self.position < len(self.tokens):
            token = self.text()
            if token in OPENING:
                self.skip_group()
                if is_item and token == "{":
                    return
            elif token in CLOSING:
                return
            else:
                self.position += 1
                if token == ";" or (token == "," and not is_item):
                    return

    def declaration(self):
        name, opens = self.text(1), self.text(2) == "{"
        path = self.module.path + (name,)
        if opens:
            child = Module(path, self.module.file, self.module)
            self.module.children[name] = child
            self.position += 2  # to the brace, which the next step counts
            self.open_modules.append((self.depth, self.module))
            self.module = child
            return
        self.position += 3
        inside = self.folder.joinpath(*self.module.path[self.base() :])
        for file, folder in ((inside / f"{name}.rs", inside / name), (inside / name / "mod.rs", inside / name)):
            if file.exists():
                child = Module(path, file, self.module)
                self.module.children[name] = child
                Parser(child, folder).parse()

    def base(self):
        """Number of names in the path of the module that is the file itself."""
        outermost = self.open_modules[0][1] if self.open_modules else self.module
        return len(outermost.path)

    def use(self):
        line = self.line()
        self.position += 1
        for path, name, is_glob in self.use_tree(()):
            self.module.references.append(Reference(path, line, is_glob))
            if is_glob:
                self.module.globs.append(path)
            elif name != "_":
                self.module.imports.setdefault(name, path)

    def use_tree(self, prefix):
        """All (path, name, is a glob) of a `use`, from behind `prefix`."""
        path = prefix
        while self.position < len(self.tokens):
            token = self.text()
            self.position += 1
            if token == "{":
                while self.text() not in ("}", ""):
                    yield from self.use_tree(path)
                    if self.text() == ",":
                        self.position += 1
                self.position += 1
                return
            if token == "*":
                yield path, "", True
                return
            if token == "::":
                continue
            if NAME.match(token):
                path += (token,) if not (token == "self" and path) else ()
                if self.text() == "::":
                    continue
                name = path[-1]
                if self.text() == "as":
                    name = self.text(1)
                    self.position += 2
                yield path, name, False
            return

    def expression(self):
        """A path in code."""
        line, path = self.line(), (self.text(),)
        self.position += 1
        while self.text() == "::" and NAME.match(self.text(1)):
            path += (self.text(1),)
            self.position += 2
        if path[0] in ("crate", "$crate", "super") or path[0] in self.module.imports:
            self.module.references.append(Reference(path, line))


def crate_roots(folder):
    """The root files of all libraries and programs below `folder`, by the names of their packages' folders."""
    for manifest in sorted(folder.rglob("Cargo.toml")):
        if "target" in manifest.relative_to(folder).parts or "[package]" not in manifest.read_text(encoding="utf-8"):
            continue
        for root in ("lib.rs", "main.rs"):
            file = manifest.parent / "src" / root
            if file.exists():
                yield file


def read_crate(file):
    """The tree of modules of the crate whose root is `file`."""
    root = Module((), file)
    Parser(root, file.parent).parse()
    return root

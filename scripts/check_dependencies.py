#!/usr/bin/env python3
"""Checks licences, bans and sources of all dependencies against deny.toml, without cargo-deny and without the network.

Reads `cargo metadata --offline`. From deny.toml it takes the allowed licences, the banned crates, whether `*` may be a
required version, and whether sources other than crates.io are refused; cargo-deny, which compiles for minutes, checks
advisories as well.
"""

import argparse
import json
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

try:
    import tomllib
except ModuleNotFoundError:
    sys.exit("check_dependencies.py needs Python 3.11 or later")

ROOT = Path(__file__).resolve().parent.parent
CRATES_IO = ("registry+https://github.com/rust-lang/crates.io-index", "sparse+https://index.crates.io/")
LICENSE_TOKEN = re.compile(r"\(|\)|[^\s()]+")
COMPARISON = re.compile(r"(>=|<=|>|<|=)?\s*(\d+(?:\.\d+)*)$")


class License:
    """An SPDX expression: licences joined by AND, OR and WITH. AND binds closer than OR; `/` is an old form of OR."""

    def __init__(self, text):
        self.tokens = LICENSE_TOKEN.findall(text.replace("/", " OR "))

    def is_satisfied_by(self, allowed):
        satisfied = self.alternatives(allowed)
        return satisfied and not self.tokens

    def next_is(self, word):
        if self.tokens and self.tokens[0].upper() == word:
            self.tokens.pop(0)
            return True
        return False

    def alternatives(self, allowed):
        satisfied = self.conjunction(allowed)
        while self.next_is("OR"):
            satisfied |= self.conjunction(allowed)
        return satisfied

    def conjunction(self, allowed):
        satisfied = self.single(allowed)
        while self.next_is("AND"):
            satisfied &= self.single(allowed)
        return satisfied

    def single(self, allowed):
        if self.next_is("("):
            satisfied = self.alternatives(allowed)
            return self.next_is(")") and satisfied
        name = self.tokens.pop(0) if self.tokens else ""
        if self.next_is("WITH") and self.tokens:
            name += " WITH " + self.tokens.pop(0)
        return name in allowed


def version(text):
    """Numbers of a version, without a pre-release and build."""
    return tuple(int(part) for part in re.split(r"[-+]", text)[0].split("."))


def matches(required, found):
    """Whether a version meets all comparisons of a requirement such as `>=3, <4`; a bare number is a prefix."""
    for part in required.split(","):
        comparison = COMPARISON.match(part.strip())
        if not comparison:
            raise ValueError(f"deny.toml: version '{required}' is not understood")
        operator, bound = comparison[1], version(comparison[2])
        width = max(len(bound), len(found))
        left, right = (numbers + (0,) * (width - len(numbers)) for numbers in (found, bound))
        holds = {
            ">=": left >= right,
            "<=": left <= right,
            ">": left > right,
            "<": left < right,
            "=": left == right,
            None: found[: len(bound)] == bound,
        }
        if not holds[operator]:
            return False
    return True


def problems(metadata, rules):
    """Yields a text for each rule that a package breaks."""
    own = set(metadata["workspace_members"])
    allowed = set(rules["licenses"]["allow"])
    bans = rules["bans"]
    for package in metadata["packages"]:
        name = f"{package['name']} {package['version']}"
        is_own = package["id"] in own
        license = package["license"] or ""
        if not (is_own and rules["licenses"].get("private", {}).get("ignore")):
            if not License(license).is_satisfied_by(allowed):
                yield f"{name}: licence '{license}' is not allowed"
        for ban in bans.get("deny", []):
            if ban["name"] == package["name"] and matches(ban.get("version", ">=0"), version(package["version"])):
                yield f"{name}: banned: {ban.get('reason', 'no reason given')}"
        if rules["sources"].get("unknown-registry") == "deny" and package["source"] not in (None, *CRATES_IO):
            yield f"{name}: source '{package['source']}' is not crates.io"
        if is_own and bans.get("wildcards") == "deny":
            for dependency in package["dependencies"]:
                if dependency["req"] == "*" and not dependency.get("path"):
                    yield f"{name}: any version of {dependency['name']} is accepted"


def duplicates(metadata):
    """The packages of which several versions are in the tree."""
    versions = defaultdict(set)
    for package in metadata["packages"]:
        versions[package["name"]].add(package["version"])
    return {name: sorted(found) for name, found in sorted(versions.items()) if len(found) > 1}


def self_test():
    failed = []
    for text, expected in [
        ("MIT", True),
        ("GPL-3.0", False),
        ("MIT OR GPL-3.0", True),
        ("GPL-3.0/MIT", True),
        ("MIT AND GPL-3.0", False),
        ("(GPL-3.0 OR MIT) AND Zlib", True),
        ("GPL-3.0 OR MIT AND GPL-2.0", False),
        ("Apache-2.0 WITH LLVM-exception", True),
        ("Apache-2.0", False),
        ("(MIT", False),
        ("MIT MIT", False),
        ("", False),
    ]:
        if License(text).is_satisfied_by({"MIT", "Zlib", "Apache-2.0 WITH LLVM-exception"}) != expected:
            failed.append(f"licence '{text}'")
    for required, found, expected in [
        (">=3", "3.0.0", True),
        (">=3", "2.9.1", False),
        (">=1, <2", "1.5.0-beta", True),
        ("1.2", "1.2.9", True),
        ("1.2", "1.3.0", False),
        ("=0.4", "0.4.0", True),
    ]:
        if matches(required, version(found)) != expected:
            failed.append(f"{found} for '{required}'")
    package = {"id": "a", "name": "a", "version": "1.0.0", "license": "MIT", "source": None,
               "dependencies": [{"name": "b", "req": "*"}, {"name": "c", "req": "*", "path": "../c"}]}
    foreign = {**package, "id": "wide", "name": "wide", "license": "GPL-3.0", "source": "git+https://example.com"}
    rules = {"licenses": {"allow": ["MIT"]}, "bans": {"wildcards": "deny", "deny": [{"name": "wide"}]},
             "sources": {"unknown-registry": "deny"}}
    found = list(problems({"workspace_members": ["a"], "packages": [package, foreign]}, rules))
    if len(found) != 4:
        failed.append(f"problems {found}")
    for text in failed:
        print(f"self-test: {text}")
    return len(failed)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--duplicates", action="store_true", help="list packages with several versions as well")
    parser.add_argument("--self-test", action="store_true", help="try the check on made-up packages")
    arguments = parser.parse_args()
    if arguments.self_test:
        return 1 if self_test() else 0
    rules = tomllib.loads((ROOT / "deny.toml").read_text(encoding="utf-8"))
    command = ["cargo", "metadata", "--offline", "--locked", "--format-version", "1"]
    if rules.get("graph", {}).get("all-features"):
        command.append("--all-features")
    metadata = json.loads(subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout)
    found = list(problems(metadata, rules))
    for text in found:
        print(text)
    if arguments.duplicates:
        for name, versions in duplicates(metadata).items():
            print(f"{name}: {', '.join(versions)}")
    count = len(metadata["packages"])
    print(f"{len(found)} of {count} packages break a rule of deny.toml" if found else f"{count} packages, all as deny.toml allows")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

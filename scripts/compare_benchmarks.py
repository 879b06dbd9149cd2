#!/usr/bin/env python3
"""Compares two benchmark records (CSV) and prints a Markdown table of their ratios.

Columns that describe the run (cpu, commit, date, load, rounds) are notes. Columns of measurements (value, ms, fps, ratio,
...) are figures. All other columns are the key: rows with equal keys are compared. Accepted are the files in
docs/benchmarks/ and those of bench_tracer.sh --csv, bench_peers.sh --csv and tradeoff.

A lower figure is better, except for rates, scores and shares (fps, rays per second, PSNR, SSIM, share).

Exit status: 0 compared; 1 with --fail-above, if a figure is worse by more than that; 2 wrong use or no common rows.
"""

import argparse
import csv
import sys
from pathlib import Path

NOTES = {"cpu", "cores", "commit", "date", "load", "rounds", "source", "simd_level", "front"}
FIGURES = {
    "value", "ms", "median_ms", "min_ms", "fps", "rayfarm", "embree", "ratio", "ratio_min", "ratio_max", "max_error",
    "rmse", "psnr_db", "ssim", "flip", "efficiency", "share", "seconds", "bytes",
}  # fmt: skip
HIGHER_IS_BETTER = ("fps", "per second", "rays/s", "psnr", "ssim", "efficiency", "share")


class WrongUse(Exception):
    """A file that cannot be compared; the text has the reason."""


class Record:
    """The figures of one file by their key, and its notes."""

    def __init__(self, path, figures=None):
        self.path = path
        try:
            with open(path, newline="", encoding="utf-8") as file:
                reader = csv.DictReader(file, strict=True)
                rows = list(reader)
                columns = reader.fieldnames or []
        except (OSError, UnicodeDecodeError, csv.Error) as error:
            raise WrongUse(f"{path}: {error}") from error
        self.figures = [column for column in columns if column in (figures or FIGURES)]
        if not self.figures:
            raise WrongUse(f"{path}: no column of figures; it has {', '.join(columns) or 'no columns'}")
        self.keys = [column for column in columns if column not in FIGURES | NOTES | set(self.figures)]
        self.notes = {name: sorted({row[name] for row in rows if row.get(name)}) for name in columns if name in NOTES}
        self.values = {}
        for line, row in enumerate(rows, start=2):
            self.add(line, row)

    def add(self, line, row):
        if None in row or None in row.values():
            raise WrongUse(f"{self.path}, line {line}: another number of fields than in the first line")
        for column in self.figures:
            if row[column] == "":
                continue
            key = (*((name, row[name]) for name in self.keys), ("figure", column))
            if key in self.values:
                raise WrongUse(f"{self.path}, line {line}: a second row for {label(key)}")
            try:
                self.values[key] = float(row[column])
            except ValueError as error:
                raise WrongUse(f"{self.path}, line {line}: {column}: {row[column]!r} is not a number") from error


def label(key):
    """A key as text; numbers with the names of their columns."""
    parts = [(name, part) for name, part in key if part and (name, part) != ("figure", "value")]
    return ", ".join(f"{name} {part}" if part.replace(".", "").isdigit() else part for name, part in parts)


def higher_is_better(key):
    text = label(key).lower()
    return any(word in text for word in HIGHER_IS_BETTER)


def percent_worse(key, old, new):
    """Per cent by which the new figure is worse than the old one: negative if better, None if undefined."""
    if old == new:
        return 0.0
    worse, better = (old, new) if higher_is_better(key) else (new, old)
    return None if better <= 0 or worse < 0 else (worse / better - 1) * 100


def in_words(worse):
    if worse is None:
        return ""
    if worse == 0:
        return "same"
    return f"{abs(worse):.1f} % {'worse' if worse > 0 else 'better'}"


def table(old, new, least_percent):
    """Lines of the table, and the largest loss in per cent."""
    lines, largest = [], 0.0
    for key, before in old.values.items():
        if key not in new.values:
            continue
        after = new.values[key]
        worse = percent_worse(key, before, after)
        largest = max(largest, worse or 0.0)
        if worse is not None and abs(worse) < least_percent:
            continue
        ratio = f"{after / before:.3f}" if before else ""
        lines.append(f"| {label(key)} | {before:g} | {after:g} | {ratio} | {in_words(worse)} |")
    return lines, largest


def describe(record):
    notes = {name: values for name, values in record.notes.items() if values and name != "front"}
    notes = "; ".join(f"{name} {', '.join(values)}" for name, values in notes.items())
    return f"{record.path}: {notes or 'no notes'}"


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old", type=Path, help="the earlier record")
    parser.add_argument("new", type=Path, help="the later record")
    parser.add_argument("--figures", metavar="COLUMN,...", help="columns that are compared (default: all known ones)")
    parser.add_argument("--least", metavar="PERCENT", type=float, default=0.0, help="hide smaller changes (default 0)")
    parser.add_argument("--fail-above", metavar="PERCENT", type=float, help="status 1 if a figure is worse by more")
    return parser.parse_args()


def compare(asked):
    figures = set(asked.figures.split(",")) if asked.figures else None
    old, new = Record(asked.old, figures), Record(asked.new, figures)
    if old.keys != new.keys:
        raise WrongUse(f"the records have different keys: {', '.join(old.keys)}, and {', '.join(new.keys)}")
    common = old.values.keys() & new.values.keys()
    if not common:
        raise WrongUse("the records have no row in common")
    lines, largest = table(old, new, asked.least)
    print(f"Old: {describe(old)}\nNew: {describe(new)}\n")
    if old.notes.get("cpu") != new.notes.get("cpu"):
        print("The records are of different machines: ratios say nothing about the program alone.\n")
    print("| figure | old | new | new / old | change |\n| --- | --- | --- | --- | --- |")
    print("\n".join(lines) if lines else "| (no change to show) | | | | |")
    missing = [(old, len(old.values) - len(common)), (new, len(new.values) - len(common))]
    for record, count in missing:
        if count:
            print(f"\n{count} figures are only in {record.path}.")
    return asked.fail_above is not None and largest > asked.fail_above


def main():
    asked = arguments()
    try:
        sys.exit(1 if compare(asked) else 0)
    except WrongUse as problem:
        print(f"compare_benchmarks.py: {problem}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()

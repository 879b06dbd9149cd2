#!/usr/bin/env python3
"""Makes the tables of bench_tracer.sh.

Reads a folder: `criterion/` as criterion left it; `stages.tsv` as the benchmark `stages` printed it; and, where instructions
were counted, `instructions.tsv` as the benchmark `instructions` printed it, with `callgrind.N` for its Nth line.
"""

import argparse
import csv
import json
import re
from pathlib import Path

STAGES = ["visible", "surfaces", "shading", "shadows", "secondary", "encoding"]


def criterion(folder, group):
    """(function, parameter, rays, milliseconds of the median frame and of the least), in the order of measuring."""
    found = sorted(folder.rglob("new/benchmark.json"), key=lambda path: path.stat().st_mtime_ns)
    for path in found:
        benchmark = json.loads(path.read_text(encoding="utf-8"))
        if benchmark["group_id"] != group:
            continue
        estimates = json.loads((path.parent / "estimates.json").read_text(encoding="utf-8"))
        median = estimates["median"]["point_estimate"]
        samples = json.loads((path.parent / "sample.json").read_text(encoding="utf-8"))
        least = min(time / count for time, count in zip(samples["times"], samples["iters"]))
        rays = benchmark["throughput"]["Elements"]
        yield benchmark["function_id"], benchmark["value_str"], rays, median / 1e6, least / 1e6


def lines(path):
    """The fields of each line; none where there is no such file."""
    if not path.exists():
        return []
    return [line.split("\t") for line in path.read_text(encoding="utf-8").splitlines()]


def print_table(title, head, rows):
    if not rows:
        return
    print(f"\n{title}\n\n| " + " | ".join(head) + " |\n| " + " | ".join("---" for _ in head) + " |")
    for row in rows:
        print("| " + " | ".join(str(cell) for cell in row) + " |")


class Report:
    """Prints tables, and keeps each figure for the CSV."""

    def __init__(self, folder):
        self.folder = folder
        self.figures = []

    def keep(self, part, scene, measure, value, samples="", threads=""):
        row = {"part": part, "scene": scene, "samples": samples, "threads": threads}
        self.figures.append({**row, "measure": measure, "value": round(value, 4)})

    def frames(self):
        rows = []
        for scene, parameter, rays, ms, least in criterion(self.folder / "criterion", "frames"):
            samples, threads = re.findall(r"\d+", parameter)
            rows.append([scene, samples, threads, f"{rays:,}", f"{ms:.1f}", f"{least:.1f}", f"{rays / ms / 1e3:.1f}"])
            self.keep("frames", scene, "ms", ms, samples, threads)
            self.keep("frames", scene, "least ms", least, samples, threads)
            self.keep("frames", scene, "rays", rays, samples, threads)
        print_table(
            "Whole frames (medians; rays: shadow rays included)",
            ["scene", "samples", "threads", "rays", "ms", "least", "million rays/s"],
            rows,
        )

    def stages(self):
        times = {}
        for scene, samples, stage, ms in lines(self.folder / "stages.tsv")[1:]:
            times.setdefault((scene, samples), {})[stage] = float(ms)
            self.keep("stages", scene, f"{stage} ms", float(ms), samples, 1)
        rows = []
        for (scene, samples), of in times.items():
            total = sum(of[stage] for stage in STAGES)
            cells = [f"{of[stage]:.1f} ({100 * of[stage] / total:.0f}%)" for stage in STAGES]
            rows.append([scene, samples, *cells, f"{total:.1f}", f"{of['whole']:.1f}"])
        print_table(
            "Stages, 1 thread (ms, and share of their sum; whole: the same frame without a clock)",
            ["scene", "samples", *STAGES, "sum", "whole"],
            rows,
        )

    def features(self):
        times, rows = {}, []
        for name, other, rays, _, least in criterion(self.folder / "criterion", "features"):
            times[name] = least
            ratio = f"{least / times[other]:.2f}" if other in times else ""
            rows.append([name, f"{least:.2f}", f"{rays / least / 1e3:.1f}", other, ratio])
            self.keep("features", name, "least ms", least, threads=1)
        print_table(
            "What each feature costs, 1 thread (least times, because they are compared; ratio: of the two frames)",
            ["variant", "ms", "million rays/s", "compared with", "ratio"],
            rows,
        )

    def instructions(self):
        frames, rows = {}, []
        for index, (name, other, rays) in enumerate(lines(self.folder / "instructions.tsv"), start=1):
            dump = (self.folder / f"callgrind.{index}").read_text(encoding="utf-8")
            count = int(re.search(r"^totals: (\d+)", dump, re.MULTILINE)[1])
            frames[name] = count
            ratio = f"{count / frames[other]:.3f}" if other in frames else ""
            rows.append([name, f"{int(rays):,}", f"{count / int(rays):.1f}", other, ratio])
            self.keep("instructions", name, "instructions per ray", count / int(rays))
        print_table(
            "Instructions, by callgrind, of smaller frames (ratio: of the two frames)",
            ["scene or variant", "rays", "instructions per ray", "compared with", "ratio"],
            rows,
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--csv", help="write the figures there as well")
    parser.add_argument("--note", action="append", default=[], help="KEY=VALUE: a column of the CSV")
    arguments = parser.parse_args()
    report = Report(arguments.folder)
    report.frames()
    report.stages()
    report.features()
    report.instructions()
    if arguments.csv and report.figures:
        notes = dict(note.split("=", 1) for note in arguments.note)
        with open(arguments.csv, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, [*report.figures[0], *notes])
            writer.writeheader()
            writer.writerows({**row, **notes} for row in report.figures)


if __name__ == "__main__":
    main()

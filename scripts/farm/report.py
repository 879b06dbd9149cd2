"""The report in Markdown, with facts about the machine."""

import os
import platform
import re
import subprocess
from datetime import date
from pathlib import Path


def machine(root):
    """(fact, value) pairs about the machine and the build."""
    return [
        ("processor", processor()),
        ("cores", os.cpu_count()),
        ("system", f"{platform.system()} {platform.release()}"),
        ("commit", commit(root)),
        ("date", date.today().isoformat()),
        ("load when it began", f"{os.getloadavg()[0]:.2f}"),
    ]


def processor():
    try:
        known = re.search(r"^model name\s*:\s*(.*)$", Path("/proc/cpuinfo").read_text(encoding="utf-8"), re.MULTILINE)
    except OSError:
        known = None
    return known[1] if known else platform.machine()


def commit(root):
    described = subprocess.run(["git", "-C", root, "describe", "--always", "--dirty"], capture_output=True, text=True)
    return described.stdout.strip() or "unknown"


def table(head, rows):
    """Lines of a table, and nothing where there are no rows."""
    if not rows:
        return []
    lines = [head, ["---"] * len(head), *rows]
    return ["", *("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)]


def section(found):
    lines = ["", f"## {found.title}", "", found.text]
    for plot in found.plots:
        lines += ["", f"![{found.title}]({plot}.png)", "", f"[as SVG]({plot}.svg)"]
    lines += table(found.head, found.rows)
    lines += ["", "Figures: " + ", ".join(f"[{name}.csv]({name}.csv)" for name in found.tables)]
    return lines


def write(path, bench, facts, sections, quick):
    lines = ["# Measurements of the farm", ""]
    if quick:
        lines += ["**A quick run that tests the script: its figures are no measurements.**", ""]
    lines += [
        f"`{bench.scene.name}`, {bench.frames} frames a run, each run {bench.repeats} times; points are medians, bars reach from "
        "the least to the greatest. A worker is a process of one thread that represents a machine; the workers are all on "
        f"the machine below, so that more than {bench.cores} share its cores, with the master. The first frame of a run "
        "carries the scene and does not count. Every run of a scene ended with the same picture, byte for byte.",
        *table(["", ""], facts),
    ]
    for found in sections:
        lines += section(found)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")

"""Runs of rayfarm-master, and what they measure."""

import csv
import json
import re
import shlex
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

# Frames over which a rate is averaged. The rate of a single frame says little: two frames may arrive almost simultaneously after
# a pause.
WINDOW = 10


class Failure(Exception):
    """A program failed; the text names the program and the reason."""


@dataclass(frozen=True)
class Run:
    """One call of `render`: workers, frames and segments."""

    scene: Path
    frames: int
    workers: int
    threads: int
    policy: str  # static, smart or adaptive
    rows: int = 0  # of a segment; none for adaptive
    options: tuple = ()  # of movement and size

    @property
    def segment(self):
        return f"{self.policy}:{self.rows}" if self.rows else self.policy

    def arguments(self):
        workers = ["--local-workers", self.workers, "--wait-for-workers", self.workers, "--threads", self.threads]
        frames = ["--frames", self.frames, "--segment", self.segment, *self.options]
        # A free port, so that runs do not disturb each other.
        reports = ["--listen", "127.0.0.1:0", "--json", "--quiet"]
        return ["render", self.scene, "-o", "none", *workers, *frames, *reports]

    def picture(self):
        """Key of the last picture. Runs with the same key must end with the same bytes: trees of a model share a file name."""
        return (self.scene.name, self.frames, self.options)

    def __str__(self):
        return f"{self.scene.name}, {self.workers} x {self.threads} threads, {self.segment}"


class Master:
    """The program rayfarm-master. With `dry_run` it prints the commands, and every result is empty."""

    def __init__(self, program, dry_run=False):
        self.program = program
        self.dry_run = dry_run
        self.pictures = {}

    def call(self, *arguments):
        """Standard output of one call."""
        command = [str(self.program), *(str(argument) for argument in arguments)]
        if self.dry_run:
            print(shlex.join(command))
            return ""
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True)
        if done.returncode != 0:
            raise Failure(f"{shlex.join(command)}\nexit status {done.returncode}: {done.stderr.strip()}")
        return done.stdout

    def call_json(self, *arguments):
        text = self.call(*arguments)
        return json.loads(text) if text else {}

    def render(self, run):
        """(the row of the table, frames per second in each window of frames) of one run; ({}, []) in a dry run."""
        with tempfile.TemporaryDirectory() as folder:
            log = Path(folder) / "frames.csv"
            report = self.call_json(*run.arguments(), "--fps-log", log)
            if not report:
                return {}, []
            with log.open(newline="", encoding="utf-8") as file:
                seconds = [float(line["seconds"]) for line in csv.DictReader(file)]
        known = self.pictures.setdefault(run.picture(), report["blake3"])
        if known != report["blake3"]:
            raise Failure(f"{run}: the last picture is not the one that other runs ended with")
        windows = rates(seconds)
        row = {
            "scene": run.scene.name,
            "workers": run.workers,
            "threads": run.threads,
            "policy": run.policy,
            "rows": run.rows or "",
            "frames": run.frames,
            "fps": round(rate(seconds), 3),
            "fps_worst": round(min(windows), 3),
            "fps_best": round(max(windows), 3),
        }
        return {**row, **numbers(report, skip=row)}, windows

    def bench(self, scene, threads, frames, options):
        """Frames per second of the tracer in one process, without a farm; None in a dry run."""
        moving = ("--orbit", "--spin", "--size")
        report = self.call_json(
            "bench", scene, "--threads", threads, "--frames", frames, "--json", *pick(options, moving)
        )
        return 1e3 / report["ms_per_frame"]["median"] if report else None

    def compile(self, model, output, quality):
        """Seconds that reading a model and building its tree took; None in a dry run."""
        output_text = self.call("compile", model, "-o", output, "--quality", quality)
        return float(re.search(r"read and built in ([\d.]+) s", output_text)[1]) if output_text else None


def pick(options, names):
    """Options with their values, of which only those in `names` are kept."""
    pairs = zip(options[::2], options[1::2])
    return [word for pair in pairs if pair[0] in names for word in pair]


def rate(seconds):
    """Frames per second. The first frame is left out: it carries the scene to the workers."""
    return (len(seconds) - 1) / max(seconds[-1] - seconds[0], 1e-6)


def rates(seconds):
    """Frames per second of each WINDOW frames in a row (of all frames where there are fewer)."""
    span = min(WINDOW, len(seconds) - 1)
    return [rate(seconds[start : start + span + 1]) for start in range(len(seconds) - span)]


def numbers(report, skip, prefix=""):
    """All single figures of a report, with dots in the names of nested ones."""
    found = {}
    for name, value in report.items():
        if isinstance(value, dict):
            found.update(numbers(value, skip, f"{prefix}{name}."))
        elif not isinstance(value, list) and name not in skip:
            found[prefix + name] = value
    return found


def measure(master, runs, repeats):
    """A row for each run and repeat. All runs are repeated in turn, so that a pause of the machine affects several runs."""
    rows, total = [], len(runs) * repeats
    for repeat in range(repeats):
        for run in runs:
            row, _ = master.render(run)
            if row:
                rows.append({**row, "repeat": repeat})
                print(f"[{len(rows)}/{total}] {run}: {row['fps']:.1f} FPS", file=sys.stderr)
    return rows


def write_csv(path, rows):
    """One table; columns in the order in which the rows first name them."""
    columns = list(dict.fromkeys(column for row in rows for column in row))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(rows)

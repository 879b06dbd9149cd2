"""The experiments: each measures, writes its table and plots, and describes them.

A function takes a Bench and returns a Section, or None in a dry run.
"""

import json
import shutil
import sys
from dataclasses import dataclass, field
from pathlib import Path

from farm.runs import WINDOW, Run, measure, pick, write_csv

QUALITIES = ["fast", "default", "high"]
# A model that turns by 1/39.789 radians a frame, in degrees.
SPIN = "1.44"


@dataclass
class Section:
    """Section of the report about an experiment."""

    title: str
    text: str
    plots: list = field(default_factory=list)  # names, without folder and extension
    head: list = field(default_factory=list)  # of a table
    rows: list = field(default_factory=list)
    tables: list = field(default_factory=list)  # names of CSV files


@dataclass
class Bench:
    """Parameters of all experiments, and the output folder."""

    master: object
    folder: Path
    scene: Path
    model: Path
    frames: int
    turns: int  # frames of the turning model
    repeats: int
    sizes: list
    workers: list
    threads: list
    few_sizes: list  # of segments, for experiments that do not use all sizes
    options: tuple
    cores: int
    simulated: list  # numbers of workers
    kept: list = None

    def farm(self):
        """Every number of workers, policy and segment size; measured once, for all experiments that use it."""
        if self.kept is None:
            self.kept = measure(self.master, self.farm_runs(), self.repeats)
        return self.kept

    def farm_runs(self):
        cuts = [(policy, rows) for policy in ("static", "smart") for rows in self.sizes] + [("adaptive", 0)]
        return [self.run(count, 1, policy, rows) for count in self.workers for policy, rows in cuts]

    def run(self, workers, threads, policy, rows=0):
        return Run(self.scene, self.frames, workers, threads, policy, rows, self.options)

    def save(self, name, rows, *plot):
        """Writes `name`.csv, and `name`.svg and .png by options of the command `plot`."""
        table = self.folder / f"{name}.csv"
        if not self.master.dry_run:
            write_csv(table, rows)
        self.plot(name, table, *plot)

    def plot(self, name, table, *options):
        outputs = [word for kind in ("svg", "png") for word in ("-o", self.folder / f"{name}.{kind}")]
        self.master.call("plot", table, *outputs, *options)


# Of simulated workers; the report says the same in words.
FARM = ["--speeds", "4", "--link", "1e9", "--rtt", "0.2", "--work", "1000", "--frames", "60"]
FPS = ["--y", "fps", "--y-label", "frames per second", "--from-zero"]
BY_ROWS = ["--x", "rows", "--x-label", "rows in a segment", "--log-x", *FPS]


def median(values):
    ordered = sorted(values)
    return (ordered[len(ordered) // 2] + ordered[(len(ordered) - 1) // 2]) / 2


def medians(rows, *columns):
    """Median FPS for each combination of texts in some columns, in the order of the rows."""
    groups = {}
    for row in rows:
        groups.setdefault(tuple(row[column] for column in columns), []).append(row["fps"])
    return {key: median(values) for key, values in groups.items()}


def best_of_each(rows):
    """(policy, rows in a segment, FPS) of each policy's best size."""
    best = {}
    for (policy, size), fps in medians(rows, "policy", "rows").items():
        if fps > best.get(policy, ("", 0.0))[1]:
            best[policy] = (size, fps)
    return [[policy, size or "its own", f"{fps:.1f}"] for policy, (size, fps) in best.items()]


def segment_size(bench):
    count = max(bench.workers)
    rows = [row for row in bench.farm() if row["workers"] == count]
    title = f"Segment size, {count} workers"
    bench.save("segment-size", rows, *BY_ROWS, "--series", "policy", "--title", title)
    text = "Adaptive chooses its own sizes: it is the level across the plot."
    return Section(title, text, ["segment-size"], ["policy", "best rows", "FPS"], best_of_each(rows), ["segment-size"])


def segment_size_by_workers(bench):
    rows, plots = bench.farm(), []
    table = bench.folder / "segment-size-by-workers.csv"
    # Adaptive next to each: a level in the colour of the same number of workers.
    named = [{**row, "series": f"{row['workers']} worker{'s' * (row['workers'] > 1)}"} for row in rows]
    if not bench.master.dry_run:
        write_csv(table, named)
    for policy in ("static", "smart"):
        name = f"segment-size-{policy}"
        part = [row for row in named if row["policy"] in (policy, "adaptive")]
        title = f"Segment size by workers: {policy} (dashed: adaptive)"
        bench.save(name, part, *BY_ROWS, "--series", "series", "--title", title)
        plots.append(name)
    found = medians(rows, "workers", "policy", "rows")
    lines = []
    for count in bench.workers:
        of = {key[1:]: fps for key, fps in found.items() if key[0] == count}
        tops = [max((fps, cut) for cut, fps in of.items() if cut[0] == policy) for policy in ("static", "smart") if of]
        cells = [f"{fps:.1f} ({cut[1]} rows)" for fps, cut in tops]
        lines.append([count, *cells, f"{of.get(('adaptive', ''), 0.0):.1f}"])
    head = ["workers", "static at its best", "smart at its best", "adaptive"]
    text = "Dashed: adaptive, with the same number of workers."
    return Section("Segment size, by the number of workers", text, plots, head, lines, ["segment-size-by-workers"])


def workers(bench):
    chosen = [row for row in bench.farm() if row["policy"] == "adaptive" or row["rows"] in bench.few_sizes]
    rows = [{**row, "series": f"{row['policy']} {row['rows']}".strip()} for row in chosen]
    alone = bench.master.bench(bench.scene, 1, bench.frames, bench.options)
    if alone:
        ideal = [(count, min(count, bench.cores) * alone) for count in bench.workers]
        rows += [{"workers": count, "series": "ideal", "fps": round(fps, 3)} for count, fps in ideal]
    title = "Workers of one thread"
    axes = ["--x", "workers", "--x-label", "workers", *FPS, "--series", "series", "--dashed", "ideal"]
    bench.save("workers", rows, *axes, "--title", title)
    found = medians(rows, "series", "workers")
    names = list(dict.fromkeys(name for name, _ in found))
    lines = [[name, *(f"{found[name, count]:.1f}" for count in bench.workers)] for name in names]
    text = (
        "The ideal is the sum of speeds: what the tracer does in one process with one thread, times the number of workers, "
        f"or of cores ({bench.cores}) where there are fewer."
    )
    return Section(title, text, ["workers"], ["FPS with workers:", *bench.workers], lines, ["workers"])


def threads(bench):
    size = bench.few_sizes[len(bench.few_sizes) // 2]
    cuts = [("static", size), ("smart", size), ("adaptive", 0)]
    runs = [bench.run(1, count, policy, rows) for count in bench.threads for policy, rows in cuts]
    rows = measure(bench.master, runs, bench.repeats)
    rows = [{**row, "series": f"{row['policy']} {row['rows']}".strip()} for row in rows]
    for count in bench.threads:
        alone = bench.master.bench(bench.scene, count, bench.frames, bench.options)
        if alone:
            rows.append({"threads": count, "series": "tracer alone", "fps": round(alone, 3)})
    title = "Threads of one worker"
    axes = ["--x", "threads", "--x-label", "render threads", *FPS, "--series", "series", "--dashed", "tracer alone"]
    bench.save("threads", rows, *axes, "--title", title)
    found = medians(rows, "series", "threads")
    names = list(dict.fromkeys(name for name, _ in found))
    lines = [[name, *(f"{found[name, count]:.1f}" for count in bench.threads)] for name in names]
    text = "One worker over TCP, compared with the same tracer in one process without a farm (`rayfarm-master bench`)."
    return Section(title, text, ["threads"], ["FPS with threads:", *bench.threads], lines, ["threads"])


def tree_quality(bench):
    """A turning model, compiled with each quality."""
    count = max(bench.workers)
    size = bench.few_sizes[len(bench.few_sizes) // 2]
    options = ("--spin", SPIN, *pick(bench.options, ["--size"]))
    table, frames, lines = [], [], []
    for quality in QUALITIES:
        model = bench.folder / quality / f"{bench.model.stem}.rfm"
        model.parent.mkdir(exist_ok=True)
        seconds = [bench.master.compile(bench.model, model, quality) for _ in range(bench.repeats)]
        for policy, rows in [("static", size), ("smart", size), ("adaptive", 0)]:
            row, windows = bench.master.render(Run(model, bench.turns, count, 1, policy, rows, options))
            if not row:
                continue
            print(f"{quality}, {policy}: {row['fps']:.1f} FPS", file=sys.stderr)
            build = median(seconds)
            table.append({"quality": quality, "build_seconds": build, **row})
            lines.append([quality, f"{build:.2f}", policy, *(f"{row[key]:.1f}" for key in ("fps_worst", "fps_best", "fps"))])
            frames += [
                {"quality": quality, "policy": policy, "frame": frame, "fps": round(fps, 3)}
                for frame, fps in enumerate(windows)
            ]
        shutil.rmtree(model.parent)
    title = f"A turning model by tree quality, {count} workers, adaptive"
    if not bench.master.dry_run:
        write_csv(bench.folder / "tree-quality.csv", table)
    axes = ["--x", "frame", "--x-label", "frame", *FPS, "--series", "quality", "--where", "policy=adaptive"]
    bench.save("tree-quality-frames", frames, *axes, "--title", title)
    text = (
        f"{bench.model.name} turns by {SPIN} degrees (1/39.789 radians) a frame for {bench.turns} frames. "
        f"Worst and best are of {WINDOW} frames in a row; build: reading the model and building its tree, seconds."
    )
    head = ["quality", "build, s", "policy", "FPS worst", "FPS best", "FPS average"]
    return Section(
        "A turning model, by the quality of its tree",
        text,
        ["tree-quality-frames"],
        head,
        lines,
        ["tree-quality", "tree-quality-frames"],
    )


def simulated(bench):
    """Far more workers than there are machines: the real scheduler, in virtual time."""
    plots, lines, tables = [], [], []
    for costs, what in [("bust", "a bust on a ground"), ("corner", "all cost in a corner that moves")]:
        rows = simulate(bench, costs)
        name = f"simulated-{costs}"
        best = best_cuts(rows)
        title = f"Simulated workers, {what}"
        axes = ["--x", "workers", "--x-label", "workers", "--log-x", "--series", "series"]
        fps = ["--y", "fps", "--y-label", "frames per second", "--log-y", "--dashed", "ideal"]
        bench.save(name, best, *axes, *fps, "--title", title)
        share = ["--y", "efficiency", "--y-label", "per cent of the ideal", "--from-zero"]
        bench.save(f"{name}-efficiency", best, *axes, *share, "--title", title)
        if rows:
            write_csv(bench.folder / f"{name}-all.csv", rows)
        found = {(row["series"], row["workers"]): row["efficiency"] for row in best if row["efficiency"] != ""}
        names = list(dict.fromkeys(series for series, _ in found))
        lines += [[costs, series, *(f"{found[series, count]:.0f} %" for count in bench.simulated)] for series in names]
        plots += [name, f"{name}-efficiency"]
        tables += [f"{name}-all", name, f"{name}-efficiency"]
    text = (
        "Not measured but simulated (`rayfarm-master simulate`): the scheduler itself with workers of one thread whose speeds "
        "differ up to 4 to 1, on gigabit links with 0.2 ms of round trip, and frames that are one second of work for an average "
        "worker. The ideal is the sum of speeds. Static and smart are shown with the best of "
        f"{', '.join(str(size) for size in bench.few_sizes)} rows for each number of workers."
    )
    return Section("Simulated workers", text, plots, ["costs", "efficiency with workers:", *bench.simulated], lines, tables)


def simulate(bench, costs):
    """A row for each number of workers and each way to cut frames."""
    sweep = ",".join(str(count) for count in bench.simulated)
    cuts = [f"{policy}:{rows}" for policy in ("static", "smart") for rows in bench.few_sizes] + ["adaptive"]
    rows = []
    for cut in cuts:
        said = bench.master.call("simulate", "--sweep", sweep, "--segment", cut, "--costs", costs, *FARM, "--json")
        for line in map(json.loads, said.splitlines()):
            efficiency = round(100 * line["fps"] / line["ideal_fps"], 2)
            rows.append({"costs": costs, "policy": cut.split(":")[0], **line, "efficiency": efficiency})
    return rows


def best_cuts(rows):
    """For each policy and number of workers the row with most frames per second, and the ideal."""
    best = {}
    for row in rows:
        key = (row["policy"], row["workers"])
        if key not in best or row["fps"] > best[key]["fps"]:
            best[key] = {"series": row["policy"], **row}
    ideal = {row["workers"]: row["ideal_fps"] for row in rows}
    return list(best.values()) + [
        {"series": "ideal", "workers": count, "fps": fps, "efficiency": ""} for count, fps in ideal.items()
    ]


ALL = {
    "segment-size": segment_size,
    "segment-size-by-workers": segment_size_by_workers,
    "workers": workers,
    "threads": threads,
    "tree-quality": tree_quality,
    "simulated": simulated,
}

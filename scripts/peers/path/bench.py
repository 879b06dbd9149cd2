#!/usr/bin/env python3
"""Compares the path integrator with Mitsuba, Cycles and Embree: the same scenes in turn, the pictures compared with each other, medians.

Started by `scripts/bench_peers.sh --path`, which installs the peers. Embree's path tracer renders with `--sky` only, and its pictures are not
compared.
"""

import argparse
import csv
import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path
from statistics import median

import numpy as np

import agreement

HERE = Path(__file__).resolve().parent


class Renderer:
    """A program that renders STEM with a number of samples."""

    has_pictures = True

    def __init__(self, name, python, program):
        self.name, self.python, self.program = name, python, program

    def run(self, stem, samples, threads, seed=0):
        """Picture and report of a run."""
        out = f"{stem}-{self.name}.npy"
        command = [self.python, str(HERE / self.program), stem, "--samples", str(samples), "--threads", str(threads)]
        report = _json_of(command + ["--seed", str(seed), "--out", out])
        return np.load(out), report


class Rayfarm(Renderer):
    def __init__(self, binary, python):
        super().__init__("rayfarm", python, "")
        self.binary = binary

    def run(self, stem, samples, threads, seed=0):
        scene, picture, out = f"{stem}-run.toml", f"{stem}-rayfarm.exr", f"{stem}-rayfarm.npy"
        text = Path(f"{stem}.toml").read_text(encoding="utf-8")
        text = re.sub(r"(?m)^samples = .*$", f"samples = {samples}\nseed = {seed}", text, count=1)
        Path(scene).write_text(text, encoding="utf-8")
        report = _json_of([self.binary, "render", scene, "-o", picture, "--threads", str(threads), "--json", "--quiet"])
        subprocess.run([self.python, str(HERE / "exr_to_npy.py"), picture, out], check=True)
        rays = report["rays_per_frame"]
        total = sum(value for value in rays.values() if isinstance(value, (int, float)))
        seconds = report["ms_per_frame"]["median"] / 1000.0
        paths = report["width"] * report["height"] * samples
        cpu = {"cpu_seconds": report["process_seconds"]}
        return np.load(out), {"seconds": seconds, "samples": samples, "paths": paths, "rays": total} | cpu


class Embree(Renderer):
    """The path tracer of Embree's tutorials."""

    has_pictures = False

    def run(self, stem, samples, threads, seed=0):
        command = [self.python, str(HERE / self.program), stem, "--samples", str(samples), "--threads", str(threads)]
        report = _json_of(command)
        return None, report | {"cpu_seconds": report["process_seconds"]}


def _json_of(command):
    """The last line of a program's output that is a JSON object, with the processor time of the program and those that it started."""
    before = os.times()
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    after = os.times()
    start = done.stdout.find("\n{") + 1 if not done.stdout.startswith("{") else 0
    report = json.JSONDecoder().raw_decode(done.stdout[start:])[0]
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return report | {"process_seconds": used}


class Measurements:
    """The speeds of a renderer. Each round has two numbers of samples, so that loading and building are no part of it."""

    def __init__(self, renderer, stem, arguments, threads):
        self.renderer, self.stem, self.arguments, self.threads = renderer, stem, arguments, threads
        self.speeds, self.times, self.rays, self.errors = [], [], [], []
        self.converged = None
        if renderer.has_pictures:
            self.converged, _ = renderer.run(stem, arguments.reference, threads, seed=1000)

    def add_round(self, turn):
        few, clock = max(1, self.arguments.samples // 4), "cpu_seconds" if self.arguments.cpu else "seconds"
        _, short = self.renderer.run(self.stem, few, self.threads, seed=turn)
        picture, long = self.renderer.run(self.stem, self.arguments.samples, self.threads, seed=turn)
        seconds = long[clock] - short[clock]
        if seconds <= 0.0:
            sys.exit(f"bench.py: {self.renderer.name}: too few samples to measure a time; raise --samples")
        per_path = seconds / (long["paths"] - short["paths"])
        self.speeds.append(1e-6 / per_path)
        self.times.append(per_path * long["paths"])
        if picture is not None:
            self.errors.append(agreement.rmse(picture, self.converged))
        if "rays" in long:
            self.rays.append((long["rays"] - short["rays"]) / seconds / 1e6)

    def row(self):
        return {
            "renderer": self.renderer.name,
            "msamples": median(self.speeds),
            "lowest": min(self.speeds),
            "highest": max(self.speeds),
            "mrays": median(self.rays) if self.rays else None,
            "seconds": median(self.times),
            "rmse": median(self.errors) if self.errors else None,
        }


def table(rows):
    """Markdown. The time to equal error assumes that the error falls with the root of the samples."""
    target = rows[0]["rmse"]
    print("| renderer | Msamples/s | lowest to highest | Mrays/s | RMSE | seconds to equal error | speed of rayfarm |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for row in rows:
        row["equal"] = row["seconds"] * (row["rmse"] / target) ** 2 if row["rmse"] else None
        row["ratio"] = rows[0]["msamples"] / row["msamples"]
        mrays, rmse, equal = (
            f"{row[key]:.{digits}f}" if row[key] else "-" for key, digits in (("mrays", 2), ("rmse", 5), ("equal", 2))
        )
        print(
            f"| {row['renderer']} | {row['msamples']:.3f} | {row['lowest']:.3f} to {row['highest']:.3f} | {mrays} | "
            f"{rmse} | {equal} | {row['ratio']:.2f} |"
        )


def write_csv(path, scene, threads, rows):
    """Appends the rows of a table."""
    fields = ["scene", "threads", *rows[0]]
    fresh = not os.path.exists(path)
    with open(path, "a", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, fields)
        if fresh:
            writer.writeheader()
        for row in rows:
            digits = {key: f"{value:.6g}" if isinstance(value, float) else value for key, value in row.items()}
            writer.writerow({"scene": scene, "threads": threads} | digits)


def main():
    parser = argparse.ArgumentParser(prog="bench_peers.sh --path", description=__doc__)
    parser.add_argument("--rayfarm", required=True, help=argparse.SUPPRESS)
    parser.add_argument("--mitsuba", required=True, help=argparse.SUPPRESS)
    parser.add_argument("--blender", default="", help=argparse.SUPPRESS)
    parser.add_argument("--embree", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--work", required=True, help=argparse.SUPPRESS)
    parser.add_argument("--scene", action="append", required=True, help="a scene file; may be given several times")
    parser.add_argument("--sky", action="store_true", help="put the scenes under a sky with a sun")
    parser.add_argument("--samples", type=int, default=64, help="paths a pixel of a measurement (default 64)")
    parser.add_argument("--reference", type=int, default=1024, help="paths a pixel of the converged picture (default 1024)")
    parser.add_argument("--rounds", type=int, default=3, help="measurements (default 3)")
    parser.add_argument("--threads", default="1", help='thread counts (default "1")')
    parser.add_argument("--width", type=int, default=256, help="width of the pictures (default 256)")
    parser.add_argument("--tolerance", type=float, default=0.03, help="difference of block means (default 0.03)")
    parser.add_argument("--cpu", action="store_true", help="measure processor seconds: for a machine that is not idle")
    parser.add_argument("--csv", help="append the figures to this file")
    arguments = parser.parse_args()
    renderers = [Rayfarm(arguments.rayfarm, arguments.mitsuba), Renderer("Mitsuba", arguments.mitsuba, "mitsuba_render.py")]
    if arguments.blender:
        renderers.append(Renderer("Cycles", arguments.blender, "blender_render.py"))
    if arguments.embree and arguments.sky:
        renderers.append(Embree("Embree", arguments.mitsuba, "embree_render.py"))
    differ = False
    for scene in arguments.scene:
        stem = os.path.join(os.path.abspath(arguments.work), Path(scene).stem)
        extra = ["--sky"] if arguments.sky else []
        command = [arguments.mitsuba, str(HERE / "prepare.py"), scene, stem, "--width", str(arguments.width), *extra]
        subprocess.run(command, check=True)
        for threads in map(int, arguments.threads.split()):
            unit = "processor seconds" if arguments.cpu else "seconds"
            print(f"\n{Path(scene).name}, {threads} threads, {unit}, {time.strftime('%F')}\n", flush=True)
            measured = [Measurements(renderer, stem, arguments, threads) for renderer in renderers]
            for turn in range(arguments.rounds):
                for renderer in measured:
                    renderer.add_round(turn)
            rows = [renderer.row() for renderer in measured]
            table(rows)
            if arguments.csv:
                write_csv(arguments.csv, Path(scene).stem, threads, rows)
            for row, other in zip(rows[1:], measured[1:]):
                if other.converged is None:
                    continue
                text, agrees = agreement.blocks(measured[0].converged, other.converged, arguments.tolerance)
                print(f"\nrayfarm and {row['renderer']}: {text}", flush=True)
                differ |= not agrees
    if differ:
        sys.exit("bench.py: pictures differ: their speeds cannot be compared")


if __name__ == "__main__":
    main()

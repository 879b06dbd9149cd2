#!/usr/bin/env python3
"""Compares the path integrator with Mitsuba and Cycles: the same scenes in turn, the pictures compared with each other, medians.

Started by `scripts/bench_peers.sh --path`, which installs the peers.
"""

import argparse
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
    """A program that renders STEM with a number of samples, and its measurements."""

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
        return np.load(out), {"seconds": seconds, "samples": samples, "paths": paths, "rays": total}


def _json_of(command):
    """The last line of a program's output that is a JSON object."""
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    start = done.stdout.find("\n{") + 1 if not done.stdout.startswith("{") else 0
    return json.JSONDecoder().raw_decode(done.stdout[start:])[0]


def measure(renderer, stem, arguments, threads):
    """Medians of the speed: two numbers of samples each round, so that loading and building are no part of it."""
    few = max(1, arguments.samples // 4)
    speeds, times, rays, errors = [], [], [], []
    converged, _ = renderer.run(stem, arguments.reference, threads, seed=1000)
    for turn in range(arguments.rounds):
        _, short = renderer.run(stem, few, threads, seed=turn)
        picture, long = renderer.run(stem, arguments.samples, threads, seed=turn)
        seconds = long["seconds"] - short["seconds"]
        if seconds <= 0.0:
            sys.exit(f"bench.py: {renderer.name}: too few samples to measure a time; raise --samples")
        per_path = seconds / (long["paths"] - short["paths"])
        speeds.append(1e-6 / per_path)
        times.append(per_path * long["paths"])
        errors.append(agreement.rmse(picture, converged))
        if "rays" in long:
            rays.append((long["rays"] - short["rays"]) / seconds / 1e6)
    return {
        "renderer": renderer.name,
        "msamples": median(speeds),
        "lowest": min(speeds),
        "highest": max(speeds),
        "mrays": median(rays) if rays else None,
        "seconds": median(times),
        "rmse": median(errors),
        "converged": converged,
    }


def table(rows):
    """Markdown. The time to equal error assumes that the error falls with the root of the samples."""
    target = rows[0]["rmse"]
    print("| renderer | Msamples/s | lowest to highest | Mrays/s | RMSE | seconds to equal error | speed of rayfarm |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for row in rows:
        equal = row["seconds"] * (row["rmse"] / target) ** 2
        mrays = f"{row['mrays']:.2f}" if row["mrays"] else "-"
        ratio = rows[0]["msamples"] / row["msamples"]
        print(
            f"| {row['renderer']} | {row['msamples']:.3f} | {row['lowest']:.3f} to {row['highest']:.3f} | {mrays} | "
            f"{row['rmse']:.5f} | {equal:.2f} | {ratio:.2f} |"
        )


def main():
    parser = argparse.ArgumentParser(prog="bench_peers.sh --path", description=__doc__)
    parser.add_argument("--rayfarm", required=True, help=argparse.SUPPRESS)
    parser.add_argument("--mitsuba", required=True, help=argparse.SUPPRESS)
    parser.add_argument("--blender", default="", help=argparse.SUPPRESS)
    parser.add_argument("--work", required=True, help=argparse.SUPPRESS)
    parser.add_argument("--scene", action="append", required=True, help="a scene file; may be given several times")
    parser.add_argument("--sky", action="store_true", help="put the scenes under a sky with a sun")
    parser.add_argument("--samples", type=int, default=64, help="paths a pixel of a measurement (default 64)")
    parser.add_argument("--reference", type=int, default=1024, help="paths a pixel of the converged picture (default 1024)")
    parser.add_argument("--rounds", type=int, default=3, help="measurements (default 3)")
    parser.add_argument("--threads", default="1", help='thread counts (default "1")')
    parser.add_argument("--width", type=int, default=256, help="width of the pictures (default 256)")
    parser.add_argument("--tolerance", type=float, default=0.03, help="difference of block means (default 0.03)")
    arguments = parser.parse_args()
    renderers = [Rayfarm(arguments.rayfarm, arguments.mitsuba), Renderer("Mitsuba", arguments.mitsuba, "mitsuba_render.py")]
    if arguments.blender:
        renderers.append(Renderer("Cycles", arguments.blender, "blender_render.py"))
    differ = False
    for scene in arguments.scene:
        stem = os.path.join(os.path.abspath(arguments.work), Path(scene).stem)
        extra = ["--sky"] if arguments.sky else []
        command = [arguments.mitsuba, str(HERE / "prepare.py"), scene, stem, "--width", str(arguments.width), *extra]
        subprocess.run(command, check=True)
        for threads in map(int, arguments.threads.split()):
            print(f"\n{Path(scene).name}, {threads} threads, {time.strftime('%F')}\n", flush=True)
            rows = [measure(renderer, stem, arguments, threads) for renderer in renderers]
            table(rows)
            for row in rows[1:]:
                text, agrees = agreement.blocks(rows[0]["converged"], row["converged"], arguments.tolerance)
                print(f"\nrayfarm and {row['renderer']}: {text}", flush=True)
                differ |= not agrees
    if differ:
        sys.exit("bench.py: pictures differ: their speeds cannot be compared")


if __name__ == "__main__":
    main()

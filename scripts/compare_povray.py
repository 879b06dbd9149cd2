#!/usr/bin/env python3
"""Compares pictures of rayfarm and of POV-Ray: mirrors, glass, and a soft shadow.

Each scene is written for both programs from one description (scripts/povray/scenes.py), rendered with one ray per pixel, and
compared in steps of 255. The output folder then contains the pictures and a map of their differences, times 16, as PNG.
The scenes themselves are kept with --keep. Standard output is a table in Markdown: docs/povray.md explains it.

Needs POV-Ray 3.7 (Debian: apt install povray) and a built rayfarm-master.

Exit status: 0 compared; 1 a program failed; 2 wrong use, or a program is missing.
"""

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "scripts"))

from povray import pictures, scenes  # noqa: E402  (in the folder of this file)

COLUMNS = (
    "scene", "mean", "RMSE", "above 0", "above 1", "above 2", "above 8", "smooth", "mean there", "largest there",
    "worst region",
)  # fmt: skip


class Failure(Exception):
    """A program failed; the text names the program and the reason."""


class Missing(Exception):
    """A program is not installed or not built; the text has the remedy."""


def size(text):
    """`400x300`."""
    width, height = map(int, text.split("x"))
    if min(width, height) < 1:
        raise ValueError
    return width, height


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rayfarm", type=Path, default=ROOT / "target/release/rayfarm-master", help="the program (%(default)s)")
    parser.add_argument("--povray", default="povray", help="the program, by name or path (%(default)s)")
    parser.add_argument("--out", type=Path, default=ROOT / "target/povray", help="output folder (%(default)s)")
    parser.add_argument("--only", choices=scenes.ALL, action="append", help="a scene to compare; all without it")
    parser.add_argument("--size", type=size, default=(400, 300), metavar="WxH", help="picture size in pixels (400x300)")
    parser.add_argument("--keep", action="store_true", help="keep the scenes (.toml, .pov) and pictures (.ppm) of both programs")
    return parser.parse_args()


def run(command, folder):
    """Standard output and standard error of a program that succeeds."""
    ended = subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace")
    text = ended.stdout + ended.stderr
    if ended.returncode != 0:
        raise Failure(f"{command[0]} ended with status {ended.returncode}:\n{text.strip()[-2000:]}")
    return text


def programs(options):
    """Paths of rayfarm-master and POV-Ray, and a line that names both versions."""
    povray = shutil.which(options.povray)
    if povray is None:
        raise Missing(f"{options.povray} is not installed: POV-Ray 3.7 is required (Debian: apt install povray)")
    rayfarm = options.rayfarm.resolve()
    if not rayfarm.is_file():
        raise Missing(f"{rayfarm} does not exist; build it with cargo build --release, or name it with --rayfarm")
    found = re.search(r"POV-Ray (\S+)", run([povray, "--version"], ROOT))
    version = found.group(1) if found else "of an unknown version"
    return rayfarm, povray, f"{run([str(rayfarm), '--version'], ROOT).strip()}, POV-Ray {version}"


def render(scene, folder, rayfarm, povray, width, height):
    """Writes both scenes and renders them: rayfarm's picture and that of POV-Ray."""
    ours, theirs = folder / f"{scene.name}-rayfarm.ppm", folder / f"{scene.name}-povray.ppm"
    toml, pov = folder / f"{scene.name}.toml", folder / f"{scene.name}.pov"
    toml.write_text(scene.toml(width, height), encoding="utf-8")
    pov.write_text(scene.pov(width, height), encoding="utf-8")
    run([str(rayfarm), "render", toml.name, "-o", ours.name, "--listen", "127.0.0.1:0", "--quiet"], folder)
    # PPM, sRGB, one ray through the centre of each pixel, no window.
    output = [f"+O{theirs.name}", "Output_File_Type=P", "File_Gamma=sRGB", "Bits_Per_Color=8"]
    run([povray, f"+I{pov.name}", *output, f"+W{width}", f"+H{height}", "+Q9", "-A", "-D", "-P", "Dither=off"], folder)
    return pictures.read_ppm(ours), pictures.read_ppm(theirs)


def row(name, difference):
    """A line of the table."""
    above = (f"{100 * share:.4f} %" for share in difference.above)
    x, y = difference.smooth_place
    left, top = difference.region
    cells = (
        name, f"{difference.mean:.4f}", f"{difference.rmse:.3f}", *above, f"{100 * difference.smooth_share:.1f} %",
        f"{difference.smooth_mean:+.4f}", f"{difference.smooth_largest} at ({x}, {y})",
        f"{difference.region_mean:.2f} at ({left}, {top})",
    )  # fmt: skip
    return "| " + " | ".join(cells) + " |"


def main():
    options = arguments()
    width, height = options.size
    rayfarm, povray, versions = programs(options)
    options.out.mkdir(parents=True, exist_ok=True)
    out = options.out.resolve()
    print(f"{versions}; {width}x{height}, one ray per pixel; steps of 255\n")
    print("| " + " | ".join(COLUMNS) + " |")
    print("| " + " | ".join("---" for _ in COLUMNS) + " |", flush=True)
    with tempfile.TemporaryDirectory(prefix="rayfarm-povray-") as temporary:
        folder = out if options.keep else Path(temporary)
        for name in options.only or scenes.ALL:
            ours, theirs = render(scenes.ALL[name], folder, rayfarm, povray, width, height)
            difference = pictures.compare(ours, theirs)
            pictures.write_png(out / f"{name}-rayfarm.png", ours)
            pictures.write_png(out / f"{name}-povray.png", theirs)
            pictures.write_png(out / f"{name}-difference.png", difference.map)
            print(row(name, difference), flush=True)


if __name__ == "__main__":
    try:
        main()
    except Missing as missing:
        print(f"compare_povray.py: {missing}", file=sys.stderr)
        sys.exit(2)
    except (Failure, pictures.BadPicture, OSError) as failure:
        print(f"compare_povray.py: {failure}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)

#!/usr/bin/env python3
"""Counts the pixels of two pictures (binary PPM) that differ, and fails above a limit.

Two tracers see different sides of an edge where rounding decides: single pixels differ, and they must be few.
"""

import argparse
import sys


def read_ppm(path):
    """Width, height and RGB8 bytes."""
    with open(path, "rb") as file:
        data = file.read()
    words = data.split(maxsplit=4)
    if len(words) < 5 or words[0] != b"P6" or words[3] != b"255":
        sys.exit(f"compare_pictures.py: {path}: not a PPM of 8 bits a channel")
    width, height = int(words[1]), int(words[2])
    return width, height, data[len(data) - width * height * 3 :]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("one")
    parser.add_argument("other")
    parser.add_argument("--steps", type=int, default=2, help="largest difference of equal pixels, in steps of 255 (default 2)")
    parser.add_argument("--percent", type=float, default=0.5, help="largest share of different pixels, in per cent (default 0.5)")
    arguments = parser.parse_args()
    one, other = read_ppm(arguments.one), read_ppm(arguments.other)
    if one[:2] != other[:2]:
        sys.exit(f"compare_pictures.py: {one[0]}x{one[1]} is not {other[0]}x{other[1]}")
    a, b = one[2], other[2]
    beyond = {i // 3 for i, (x, y) in enumerate(zip(a, b)) if abs(x - y) > arguments.steps}
    pixels = one[0] * one[1]
    percent = 100.0 * len(beyond) / pixels
    print(f"{len(beyond)} of {pixels} pixels ({percent:.3f} %) differ by more than {arguments.steps} steps")
    if percent > arguments.percent:
        sys.exit(f"compare_pictures.py: more than {arguments.percent} % differ: not the same picture")


if __name__ == "__main__":
    main()

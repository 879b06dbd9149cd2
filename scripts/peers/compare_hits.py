#!/usr/bin/env python3
"""Compares the distances of the hits of the same rays by two tracers: files of little-endian float32, -1 without a hit.

Exit status: 1 if more than one ray in a thousand differs by more than 1e-3 of the distance. A few rays graze an edge, or start
next to a surface.
"""

import array
import sys

TOLERANCE = 1e-3
MOST = 1e-3


def read(path):
    numbers = array.array("f")
    with open(path, "rb") as file:
        numbers.frombytes(file.read())
    if sys.byteorder == "big":
        numbers.byteswap()
    return numbers


def main():
    if len(sys.argv) != 3:
        sys.exit(f"usage: {sys.argv[0]} HITS HITS")
    ours, theirs = (read(path) for path in sys.argv[1:])
    if len(ours) != len(theirs) or not ours:
        sys.exit(f"compare_hits.py: {len(ours)} and {len(theirs)} rays")
    off = sum(abs(a - b) > TOLERANCE * max(abs(a), abs(b)) for a, b in zip(ours, theirs))
    print(f"{off} of {len(ours)} rays ({100 * off / len(ours):.3f} %) have another hit")
    sys.exit(off > MOST * len(ours))


if __name__ == "__main__":
    main()

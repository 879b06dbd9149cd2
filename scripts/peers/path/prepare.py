#!/usr/bin/env python3
"""Writes a scene for all renderers of the comparison: STEM.toml with OBJ files, STEM.json and STEM.npz."""

import argparse
import sys

import read_scene
import sky_picture
import write_scene


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", help="a scene file (.toml)")
    parser.add_argument("stem", help="where to write, an absolute path without extension")
    parser.add_argument("--width", type=int, help="with another width, the height in proportion")
    parser.add_argument("--sky", action="store_true", help="put the scene under a sky with a sun")
    arguments = parser.parse_args()
    notes = {}
    panorama = None
    if arguments.sky:
        panorama = f"{arguments.stem}-sky.hdr"
        sky_picture.write(panorama, sky_picture.with_sun())
    try:
        scene = read_scene.load(arguments.scene, arguments.stem, lambda what: notes.setdefault(what), panorama)
    except (OSError, ValueError, KeyError) as error:
        sys.exit(f"prepare.py: {arguments.scene}: {error!r}")
    if arguments.width:
        scene.height = max(1, round(scene.height * arguments.width / scene.width))
        scene.width = arguments.width
    scene.save(arguments.stem)
    write_scene.write(scene, arguments.stem, 64)
    for note in notes:
        print(f"{arguments.scene}: {note}", file=sys.stderr)


if __name__ == "__main__":
    main()

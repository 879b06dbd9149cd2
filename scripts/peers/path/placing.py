"""Maps of 4 x 4 numbers: places of models, boxes and groups."""

import numpy as np


def rotation(degrees):
    """About x, then y, then z."""
    turned = np.eye(3)
    for axis, angle in enumerate(degrees):
        s, c = np.sin(np.radians(angle)), np.cos(np.radians(angle))
        one, other = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[one, one] = turn[other, other] = c
        turn[one, other], turn[other, one] = -s, s
        turned = turn @ turned
    return turned


def of_keys(keys):
    """The map of `scale`, `rotate` and `translate`, or of `matrix`."""
    place = np.eye(4)
    if "matrix" in keys:
        place[:3] = keys["matrix"]
        return place
    scale = keys.get("scale", 1.0)
    place[:3, :3] = rotation(keys.get("rotate", [0.0, 0.0, 0.0])) @ np.diag(np.broadcast_to(scale, 3))
    place[:3, 3] = keys.get("translate", [0.0, 0.0, 0.0])
    return place


def of_groups(groups):
    """The map of each name that is a child of a group, through all groups above it."""
    parents = {child: group for group in groups for child in group["children"]}
    places = {}
    for child in parents:
        place, name = np.eye(4), child
        while name in parents:
            place = of_keys(parents[name]) @ place
            name = parents[name].get("name")
        places[child] = place
    return places


def apply(place, triangles):
    """Triangles at their place. A mirroring place swaps two corners, so that fronts remain fronts."""
    moved = np.asarray(triangles, dtype=np.float64) @ place[:3, :3].T + place[:3, 3]
    return moved[:, ::-1] if np.linalg.det(place[:3, :3]) < 0.0 else moved

"""Errors of pictures, and whether two renderers show the same picture."""

import numpy as np

BLOCK = 16
# Share of the blocks that may differ: edges of spheres that are triangles elsewhere.
FEW = 0.02


def rmse(picture, reference):
    return float(np.sqrt(np.mean((picture.astype(np.float64) - reference) ** 2)))


def blocks(one, other, tolerance):
    """Compares the means of blocks of 16 x 16 pixels: a text, and whether they agree.

    A block differs where its means are apart by more than `tolerance` of the larger one, and by more than 3 sigma of the
    difference of its pixels.
    """
    rows, columns = one.shape[0] // BLOCK, one.shape[1] // BLOCK
    shape = (rows, BLOCK, columns, BLOCK, 3)
    a, b = (picture[: rows * BLOCK, : columns * BLOCK].astype(np.float64).reshape(shape) for picture in (one, other))
    apart = np.abs(a.mean((1, 3)) - b.mean((1, 3)))
    sigma = np.sqrt(((a - b) ** 2).mean((1, 3))) / BLOCK
    most = np.maximum(a.mean((1, 3)), b.mean((1, 3)))
    differ = (apart > tolerance * most) & (apart > 3.0 * sigma)
    text = f"{differ.sum()} of {differ.size} block means differ; means {one.mean((0, 1))} and {other.mean((0, 1))}"
    return text, bool(differ.mean() <= FEW)

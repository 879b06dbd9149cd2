"""Pictures: reading PPM, writing PNG, and the differences of two pictures in steps of 255."""

import math
import re
import struct
import zlib
from dataclasses import dataclass

# Header of a binary PPM; a comment, as POV-Ray writes it, extends to the end of its line.
GAP = rb"(?:\s|#[^\n]*\n)+"
HEADER = re.compile(rb"P6" + GAP + rb"(\d+)" + GAP + rb"(\d+)" + GAP + rb"255\s")
# Side in pixels of the squares among which the one with the largest difference is reported.
REGION = 16
# A pixel is at an edge if a channel of one of its eight neighbours differs from its own by more than this many steps.
EDGE = 8


class BadPicture(Exception):
    """A picture that cannot be read or compared; the text has the reason."""


@dataclass(frozen=True)
class Picture:
    """RGB8, by rows from the top."""

    width: int
    height: int
    pixels: bytes

    def channels(self, x, y):
        start = 3 * (y * self.width + x)
        return self.pixels[start : start + 3]


def read_ppm(path):
    try:
        data = path.read_bytes()
    except OSError as error:
        raise BadPicture(f"{path}: {error}") from error
    header = HEADER.match(data)
    if header is None:
        raise BadPicture(f"{path}: not a binary PPM of 8 bits a channel")
    width, height = int(header.group(1)), int(header.group(2))
    pixels = data[header.end() :]
    if len(pixels) != 3 * width * height:
        raise BadPicture(f"{path}: {len(pixels)} bytes of pixels in place of {3 * width * height}")
    return Picture(width, height, pixels)


def write_png(path, picture):
    row = 3 * picture.width
    rows = (picture.pixels[start : start + row] for start in range(0, len(picture.pixels), row))
    # Each row begins with its filter: 0 is none.
    packed = zlib.compress(b"".join(b"\0" + pixels for pixels in rows), 9)
    header = struct.pack(">IIBBBBB", picture.width, picture.height, 8, 2, 0, 0, 0)

    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    chunks = chunk(b"IHDR", header) + chunk(b"IDAT", packed) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunks)


@dataclass(frozen=True)
class Difference:
    """Differences of two pictures, in steps of 255. A pixel differs by the largest difference of its channels."""

    mean: float  # of the channels, absolute
    rmse: float
    # Share of the pixels that differ by more than 0, 1, 2 and 8 steps.
    above: tuple
    # Of pixels that are at no edge in either picture: their share, their signed mean, the largest difference, and its place.
    smooth_share: float
    smooth_mean: float
    smooth_largest: int
    smooth_place: tuple
    # Mean of the channels over the worst region, and its top left corner.
    region_mean: float
    region: tuple
    map: Picture


def edges(picture):
    """Whether each pixel is at an edge."""
    width, height, pixels = picture.width, picture.height, picture.pixels
    found = bytearray(width * height)
    row = 3 * width
    for step in (3, row - 3, row, row + 3):
        for place in range(len(pixels) - step):
            if abs(pixels[place] - pixels[place + step]) > EDGE:
                found[place // 3] = found[(place + step) // 3] = 1
    return found


def worst_region(steps, width, height):
    """Mean of the channels, and the top left corner of the region."""
    worst = (-1.0, (0, 0))
    for top in range(0, height, REGION):
        for left in range(0, width, REGION):
            right = min(left + REGION, width)
            inside = [steps[3 * (y * width + left) : 3 * (y * width + right)] for y in range(top, min(top + REGION, height))]
            mean = sum(map(sum, inside)) / sum(map(len, inside))
            worst = max(worst, (mean, (left, top)), key=lambda found: found[0])
    return worst


def compare(one, other, factor=16):
    """`one` is rayfarm's. The map has the difference of each channel times `factor`."""
    if (one.width, one.height) != (other.width, other.height):
        raise BadPicture(f"{one.width}x{one.height} is not {other.width}x{other.height}")
    width, height = one.width, one.height
    signed = [a - b for a, b in zip(one.pixels, other.pixels)]
    steps = [abs(step) for step in signed]
    count = width * height
    largest = [max(steps[place : place + 3]) for place in range(0, 3 * count, 3)]
    at_edge = [a or b for a, b in zip(edges(one), edges(other))]
    smooth = [index for index in range(count) if not at_edge[index]]
    place = max(smooth, key=largest.__getitem__, default=0)
    region_mean, region = worst_region(steps, width, height)
    return Difference(
        mean=sum(steps) / len(steps),
        rmse=math.sqrt(sum(step * step for step in steps) / len(steps)),
        above=tuple(sum(step > limit for step in largest) / count for limit in (0, 1, 2, 8)),
        smooth_share=len(smooth) / count,
        smooth_mean=sum(sum(signed[3 * index : 3 * index + 3]) for index in smooth) / max(3 * len(smooth), 1),
        smooth_largest=largest[place] if smooth else 0,
        smooth_place=(place % width, place // width),
        region_mean=region_mean,
        region=region,
        map=Picture(width, height, bytes(min(factor * step, 255) for step in steps)),
    )

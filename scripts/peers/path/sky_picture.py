"""Panoramas in Radiance HDR: gradients, and a plain sky with a sun."""

import numpy as np


def directions(width, height):
    """The unit direction of each pixel: the centre of the picture is at -Z, its upper edge at +Y."""
    azimuth = 2.0 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    polar = np.pi * (np.arange(height) + 0.5) / height
    sine = np.sin(polar)[:, None]
    up = np.broadcast_to(np.cos(polar)[:, None], (height, width))
    return np.stack([np.sin(azimuth) * sine, up, -np.cos(azimuth) * sine], axis=-1)


def gradient(bottom, top, width=8, height=256):
    """Linear in (y + 1) / 2."""
    share = (directions(width, height)[..., 1:2] + 1.0) / 2.0
    return np.asarray(bottom) * (1.0 - share) + np.asarray(top) * share


def with_sun(width=512, height=256):
    """Blue above, grey below, and a sun 3 degrees across, 40 degrees high, from the front left of a camera that looks along -Z."""
    at = directions(width, height)
    sky = np.asarray([0.75, 0.8, 0.85]) + at[..., 1:2].clip(0.0) * np.asarray([-0.55, -0.45, -0.15])
    sky = np.where(at[..., 1:2] < 0.0, [0.2, 0.18, 0.16], sky)
    sun = np.asarray([-0.54, 0.643, 0.543])
    return np.where(at @ (sun / np.linalg.norm(sun)) > np.cos(np.radians(1.5)), 1.0, 0.0)[..., None] * 900.0 + sky


def write(path, picture):
    """Writes linear light as uncompressed Radiance HDR."""
    height, width, _ = picture.shape
    _, exponent = np.frexp(picture.max(axis=-1, keepdims=True).clip(1e-30))
    mantissas = np.floor(picture * np.exp2(8.0 - exponent)).clip(0.0, 255.0)
    pixels = np.concatenate([mantissas, exponent + 128.0], axis=-1).astype(np.uint8)
    with open(path, "wb") as file:
        file.write(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode("ascii"))
        file.write(pixels.tobytes())

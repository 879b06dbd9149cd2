#!/usr/bin/env python3
"""Reads a linear picture with Mitsuba and writes it as .npy: rows from the top, three channels."""

import sys

import mitsuba as mi
import numpy as np

if len(sys.argv) != 3:
    sys.exit("usage: exr_to_npy.py PICTURE.exr OUT.npy")
mi.set_variant("scalar_rgb")
np.save(sys.argv[2], np.array(mi.Bitmap(sys.argv[1]).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)))

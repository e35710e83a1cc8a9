#!/usr/bin/env python3
"""Writes expected.csv: errors of made-up pairs of pictures, by implementations that are not ours.

    python3 -m venv /tmp/oracle && /tmp/oracle/bin/pip install flip-evaluator==1.7 scikit-image==0.26.0 numpy==2.4.6
    /tmp/oracle/bin/python tests/metrics/oracle.py > tests/metrics/expected.csv

FLIP is that of its authors (PyPI: flip-evaluator), MSE that of scikit-image, the relative measures are written with NumPy
from the formulas at the head of src/core/stats/metrics.rs. tests/metrics/main.rs makes the same pictures and compares. Two
pairs of files may be named instead (`REFERENCE TEST` as EXR or PNG): then only FLIP is printed.
"""
import sys

import flip_evaluator
import numpy as np
from skimage.metrics import mean_squared_error

EPSILON = 0.01
PAIRS = 20


def scrambled(n):
    """A hash of 32 bits (Wang 2007), for every element."""
    n = n.astype(np.uint64) & 0xffffffff
    n = (n ^ 61 ^ (n >> 16)) & 0xffffffff
    n = (n * 9) & 0xffffffff
    n = n ^ (n >> 4)
    n = (n * 0x27d4eb2d) & 0xffffffff
    return n ^ (n >> 15)


def pair(k):
    """Reference and picture number k, as arrays of shape (height, width, 3)."""
    width, height = 37 + 7 * k, 29 + 5 * k
    y, x, c = np.meshgrid(np.arange(height), np.arange(width), np.arange(3), indexing="ij")
    chance = scrambled(((k * 3 + c) * 512 + y) * 512 + x) / 2.0 ** 32
    rare = scrambled((k * 512 + y) * 512 + x + 77_777_777) / 2.0 ** 32
    step = (x // (3 + k % 5) + y // 6) % 2
    level = 0.1 + 0.5 * ((c + k) % 3) + 0.8 * step * (x / width)
    reference = level * (1.0 + (k % 4) * 20.0 * (y / height) ** 4)
    noise = (0.05 + 0.1 * (k % 6)) * (chance - 0.5)
    image = reference * (1.0 + 0.03 * (k % 3 - 1) + noise)
    image = np.where(rare < 0.003, image * 40.0, image)
    if k % 5 == 4:  # something moved
        image = np.roll(image, 2, axis=1)
    return reference.astype(np.float32), image.astype(np.float32)


def flip(reference, image, kind):
    found, mean, facts = flip_evaluator.evaluate(
        np.ascontiguousarray(reference), np.ascontiguousarray(image), kind, inputsRGB=False, applyMagma=False)
    return np.asarray(found).squeeze(), mean, facts


def row(k):
    reference, image = pair(k)
    r, x = reference.astype(np.float64), image.astype(np.float64)
    height, width, _ = r.shape
    shown = [np.clip(v, 0, 1) for v in (reference, image)]
    ldr, ldr_mean, _ = flip(*shown, "LDR")
    hdr, hdr_mean, _ = flip(reference, image, "HDR")
    places = [(height // 2, width // 2), (0, 0), (height - 1, width // 3)]
    values = [
        mean_squared_error(r, x),
        np.mean((x - r) ** 2 / (r ** 2 + EPSILON)),
        np.mean(np.abs(x - r) / (np.abs(r) + EPSILON)),
        np.mean(np.abs(x - r) / (np.abs(x) + np.abs(r) + EPSILON)),
        ldr_mean, *[ldr[p] for p in places],
        hdr_mean, *[hdr[p] for p in places],
    ]
    return ",".join([str(k), str(width), str(height), *[f"{float(v):.7g}" for v in values]])


def main():
    if len(sys.argv) == 3:
        reference, image = sys.argv[1:]
        kind = "HDR" if reference.endswith(".exr") else "LDR"
        print(kind, flip_evaluator.evaluate(reference, image, kind, applyMagma=False)[1:])
        return
    print("pair,width,height,mse,rel_mse,mape,smape,flip_ldr,ldr_middle,ldr_first,ldr_last,flip_hdr,hdr_middle,hdr_first,hdr_last")
    for k in range(PAIRS):
        print(row(k), flush=True)


if __name__ == "__main__":
    main()

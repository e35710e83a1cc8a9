#!/usr/bin/env python3
"""Renders the torus in glass twice in the same time, without and with learning, and puts the pictures side by side.

    scenes/make_guided_picture.py --seconds 15 -o scenes/guided.png

Needs matplotlib, as the benches do.
"""
import argparse
import subprocess
import sys
from pathlib import Path

import matplotlib.image
import numpy

ROOT = Path(__file__).resolve().parent.parent


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lucerna", type=Path, default=ROOT / "target/release/lucerna")
    parser.add_argument("--seconds", type=float, default=15)
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "scenes/guided.png")
    arguments = parser.parse_args()
    folder = ROOT / "target/torus"
    subprocess.run([sys.executable, ROOT / "scenes/make_torus.py", "-o", folder], check=True)
    pictures = []
    for name, more in (("path", []), ("guided", ["--guide", "sd_tree"])):
        to = folder / f"{name}.png"
        command = [arguments.lucerna, "render", folder / "torus.xml", "-Dresx=384", "-Dresy=288", "--sampler", "sobol"]
        subprocess.run([*command, "--seconds", str(arguments.seconds), "-o", to, *more], check=True)
        pictures.append(matplotlib.image.imread(to)[..., :3])
    gap = numpy.ones((pictures[0].shape[0], 6, 3), dtype=pictures[0].dtype)
    matplotlib.image.imsave(arguments.output, numpy.concatenate([pictures[0], gap, pictures[1]], axis=1))


if __name__ == "__main__":
    main()

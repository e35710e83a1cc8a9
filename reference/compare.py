#!/usr/bin/env python3
"""Compares Lucerna with the reference renderer on any scene, at equal settings.

    reference/compare.py scene_v3.xml [more.xml ...] [--width 160] [--spp 1024] [--passes 16] [--lucerna PROGRAM]
                         [--scene OTHER.xml] [-o FOLDER]

Both render `passes` independent images of spp/passes samples per pixel with the sampler `independent`. Per scene one
line of a Markdown table: ratio of the image means (ours over the reference's) with its standard error, z of the mean,
share of 8x8 tiles whose means agree at 1 % (Welch's t-test; with a Sidak bound the worst tile), and both times.
--scene renders another file (say, the original of an old scene) with Lucerna against the same reference.
--reference-offsets lets Lucerna's rays start as far off surfaces as the reference's do, (1 + max|p|) 8.9e-5 scene
units, and pass where shading normals are tilted: what agrees only then differs by light that leaks so in the reference.
The exit code is 1 if a mean differs by more than 0.5 % and 3 standard errors, or a tile beyond the Sidak bound.
"""
import argparse
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ElementTree
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import render as reference_side  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
TILE = 8


def size_of(scene, width):
    """The picture's size at the given width, with the aspect of the scene's defaults."""
    defaults = {d.get("name"): d.get("value") for d in ElementTree.parse(scene).getroot().iter("default")}
    x, y = int(defaults.get("resx", 1)), int(defaults.get("resy", 1))
    return width, max(1, round(width * y / x))


def read(path):
    import mitsuba as mi
    import numpy as np
    bitmap = mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
    return np.array(bitmap).astype(np.float64)


def reference_passes(scene, width, height, spp, passes):
    import mitsuba as mi
    import numpy as np
    mi.set_variant("llvm_ad_rgb")
    loaded = mi.load_file(str(scene), resx=str(width), resy=str(height))
    images, seconds = [], 0.0
    mi.render(loaded, spp=1, seed=10_000)
    for index in range(passes):
        started = time.perf_counter()
        image = np.array(mi.render(loaded, spp=spp, seed=index)).astype(np.float64)
        seconds += time.perf_counter() - started
        images.append(image[..., :3] if image.shape[2] >= 3 else np.repeat(image[..., :1], 3, axis=2))
    return images, seconds


def lucerna_passes(program, scene, width, height, spp, passes, more=()):
    import json
    images, seconds = [], 0.0
    with tempfile.TemporaryDirectory() as folder:
        out, stats = Path(folder, "image.pfm"), Path(folder, "stats.json")
        for index in range(passes):
            command = [program, "render", str(scene), "-o", str(out), "--spp", str(spp), "--seed", str(1000 + index),
                       "--sampler", "independent", "--lenient", "-q", "--stats-json", str(stats),
                       "--size", f"{width}x{height}", *more]
            done = subprocess.run(command, stderr=subprocess.PIPE, text=True)
            if done.returncode != 0:
                raise RuntimeError(done.stderr.strip().splitlines()[-1])
            seconds += json.loads(stats.read_text())["render_seconds"]
            images.append(read(out))
    return images, seconds


def tiles(images):
    """Mean of every whole tile and channel, per pass: passes x tiles."""
    import numpy as np
    stack = np.stack(images)
    height, width = stack.shape[1] // TILE * TILE, stack.shape[2] // TILE * TILE
    cut = stack[:, :height, :width].reshape(len(images), height // TILE, TILE, width // TILE, TILE, 3)
    return cut.mean(axis=(2, 4)).reshape(len(images), -1)


def compare(ours, theirs):
    import numpy as np
    a, b = np.stack([i.mean() for i in ours]), np.stack([i.mean() for i in theirs])
    error = np.sqrt(a.var(ddof=1) / len(a) + b.var(ddof=1) / len(b))
    ratio, ratio_error, z = a.mean() / b.mean(), error / b.mean(), (a.mean() - b.mean()) / error
    ta, tb = tiles(ours), tiles(theirs)
    va, vb = ta.var(axis=0, ddof=1) / len(a), tb.var(axis=0, ddof=1) / len(b)
    scale = np.sqrt(va + vb)
    used = scale > 0
    t = np.abs(ta.mean(axis=0) - tb.mean(axis=0))[used] / scale[used]
    freedom = (va + vb)[used] ** 2 / ((va[used] ** 2 + vb[used] ** 2) / (len(a) - 1))
    p = student(t, freedom)
    bound = 1 - (1 - 0.01) ** (1 / len(p))
    return ratio, ratio_error, z, float((p > 0.01).mean()), float(t.max()), float(p.min()), bound


def student(t, freedom):
    """Two-sided p-values of Student's t by numerical integration (no SciPy needed)."""
    import math
    import numpy as np
    out = []
    for value, n in zip(t, freedom):
        # substitution x = sqrt(n) tan(a): the density becomes c cos(a)^(n-1)
        a = np.linspace(math.atan(value / math.sqrt(n)), math.pi / 2, 2001)
        whole = np.linspace(-math.pi / 2, math.pi / 2, 8001)
        out.append(2 * np.trapezoid(np.cos(a) ** (n - 1), a) / np.trapezoid(np.cos(whole) ** (n - 1), whole))
    return np.array(out)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--width", type=int, default=160)
    parser.add_argument("--spp", type=int, default=1024)
    parser.add_argument("--passes", type=int, default=16)
    parser.add_argument("--lucerna", default=str(ROOT / "target/release/lucerna"))
    parser.add_argument("--reference-offsets", action="store_true")
    parser.add_argument("--scene", type=Path, help="render this file with Lucerna instead")
    arguments = parser.parse_args()
    print("| scene | mean ratio | z | tiles at 1 % | worst tile t | p (bound) | reference s | Lucerna s | verdict |")
    print("|---|---|---|---|---|---|---|---|---|", flush=True)
    failed = False
    for scene in arguments.scenes:
        width, height = size_of(scene, arguments.width)
        spp = max(1, arguments.spp // arguments.passes)
        mine = arguments.scene or scene
        try:
            theirs, their_seconds = reference_passes(scene, width, height, spp, arguments.passes)
            more = ["--reference-order"] if arguments.reference_offsets else []
            ours, our_seconds = lucerna_passes(arguments.lucerna, mine, width, height, spp, arguments.passes, more)
            ratio, ratio_error, z, share, worst, p, bound = compare(ours, theirs)
        except RuntimeError as error:
            print(f"| {mine.parent.name}/{mine.name} | {error} |", flush=True)
            failed = True
            continue
        bad = (abs(ratio - 1) > 0.005 and abs(z) > 3) or p < bound
        failed |= bad
        print(f"| {mine.parent.name}/{mine.name} | {ratio:.5f} ± {ratio_error:.5f} | {z:+.2f} | {share:.4f} | {worst:.2f} "
              f"| {p:.1e} ({bound:.1e}) | {their_seconds:.1f} | {our_seconds:.1f} | {'differs' if bad else 'agrees'} |",
              flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    reference_side.enter_environment()
    sys.exit(main())

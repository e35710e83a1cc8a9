#!/usr/bin/env python3
"""How the cost of Lucerna grows: speed and memory against triangles, lights, samples per pixel and picture size.

    benches/growth.py                                all four series
    benches/growth.py lights --light-sampler light_tree
    benches/growth.py triangles --most 100000 --rounds 5 --csv out.csv --markdown out.md

The scenes are made on the spot: a field of hills under a sky, seen from above, of 10^3 to 10^7 triangles; and the same
field of 2000 triangles with 1 to 10^5 small lamps above it. Each render is a process of its own; the rounds go through
the whole series before one is repeated. Speed is that of the render alone, without loading, and is told as a ratio to the
first row of its series: medians of the rounds. Memory is the largest resident size of the process.
"""
import argparse
import array
import json
import math
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import tables
from side_by_side import ROOT

SIZE, SPP = 128, 16


def hills(path, triangles):
    """A height field over [-1, 1]² as a binary PLY file, of about so many triangles; returns how many."""
    n = max(2, round(math.sqrt(triangles / 2)))
    points = array.array("f")
    for j in range(n + 1):
        for i in range(n + 1):
            x, y = 2 * i / n - 1, 2 * j / n - 1
            points.extend((x, y, 0.1 * math.sin(9 * x) * math.cos(7 * y) + 0.01 * math.sin(61 * x + 53 * y)))
    faces = bytearray()
    for j in range(n):
        for i in range(n):
            a, b = j * (n + 1) + i, (j + 1) * (n + 1) + i
            faces += b"\x03" + array.array("i", (a, a + 1, b + 1)).tobytes() + b"\x03" + array.array("i", (a, b + 1, b)).tobytes()
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {(n + 1) ** 2}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += f"element face {2 * n * n}\nproperty list uchar int vertex_indices\nend_header\n"
    path.write_bytes(head.encode() + points.tobytes() + faces)
    return 2 * n * n


def lamps(count):
    """So many small lamps in rows above the field, each lighting its surroundings."""
    n = math.ceil(math.sqrt(count))
    for k in range(count):
        x, y = (2 * (k % n) + 1) / n - 1, (2 * (k // n) + 1) / n - 1
        size = 0.2 / n
        yield (f'<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="180"/><scale value="{size:.6f}"/>'
               f'<translate x="{x:.6f}" y="{y:.6f}" z="0.35"/></transform>'
               f'<emitter type="area"><rgb name="radiance" value="30, 25, 20"/></emitter></shape>\n')


def scene(path, mesh, lights, light_sampler=None):
    """Writes the field with a sky, or with lamps."""
    sky = '<emitter type="constant"/>\n' if not lights else "".join(lamps(lights))
    inside = f'<light_sampler type="{light_sampler}"/>' if light_sampler else ""
    path.write_text(f"""<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="5"/>{inside}</integrator>
<sensor type="perspective"><float name="fov" value="45"/>
<transform name="to_world"><lookat origin="0, -2.2, 1.4" target="0, 0, 0" up="0, 0, 1"/></transform>
<film type="hdrfilm"><integer name="width" value="{SIZE}"/><integer name="height" value="{SIZE}"/></film></sensor>
<shape type="ply"><string name="filename" value="{mesh}"/><boolean name="face_normals" value="true"/></shape>
{sky}</scene>
""")


def run(program, arguments, folder):
    """Msamples/s of the render and MiB of the process."""
    stats = folder / "stats.json"
    command = [program, "render", *map(str, arguments), "-q", "-o", folder / "x.pfm", "--stats-json", stats]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr.strip()}")
    found = json.loads(stats.read_text())
    return found["msamples_per_second"], found["peak_memory_mib"]


def powers(least, most):
    """10^k from least to most."""
    value = least
    while value <= most:
        yield value
        value *= 10


def series(name, options, folder):
    """Rows `(label, arguments of the render)` of a series."""
    file = folder / f"{name}.xml"
    if name == "triangles":
        for count in powers(1000, options.most or 10_000_000):
            mesh, file = folder / f"hills{count}.ply", folder / f"hills{count}.xml"
            made = hills(mesh, count)
            scene(file, mesh, 0)
            yield f"{made} triangles", (file, "--spp", SPP)
        return
    mesh = folder / "field.ply"
    hills(mesh, 2000)
    if name == "lights":
        for count in powers(1, options.most or 100_000):
            file = folder / f"lamps{count}.xml"
            scene(file, mesh, count, options.light_sampler)
            yield f"{count} lamps", (file, "--spp", SPP)
        return
    scene(file, mesh, 0)
    if name == "spp":
        for spp in (4, 16, 64, 256):
            yield f"{spp} spp", (file, "--spp", spp)
    else:
        for size in (64, 256, 1024):
            yield f"{size} x {size} pixels", (file, "--spp", 8, "--size", f"{size}x{size}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = ["triangles", "lights", "spp", "size"]
    parser.add_argument("series", nargs="*", choices=[[], *names], help="which (default: all)")
    parser.add_argument("--rounds", type=int, default=3, help="renders of each row")
    parser.add_argument("--most", type=int, help="largest number of triangles or lamps")
    parser.add_argument("--light-sampler", help="how lamps are chosen (default: as the scene's weights say)")
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/lucerna")
    tables.add_arguments(parser)
    options = parser.parse_args()
    tables.check_arguments(options)

    rows, text, groups = [], "| scene | Msamples/s over the first | least | largest | peak MiB |\n|---|---|---|---|---|\n", {}
    with tempfile.TemporaryDirectory() as temporary:
        for name in options.series or names:
            folder = Path(temporary)
            found = {}
            steps = list(series(name, options, folder))
            for _ in range(options.rounds):
                first = None
                for label, arguments in steps:
                    speed, memory = run(options.program, arguments, folder)
                    first = first or speed
                    found.setdefault(label, []).append((speed, speed / first, memory))
            for label, measured in found.items():
                ratios = [ratio for _, ratio, _ in measured]
                memory = max(memory for *_, memory in measured)
                median, least, largest = statistics.median(ratios), min(ratios), max(ratios)
                text += f"| {label} | {median:.2f} | {least:.2f} | {largest:.2f} | {memory} |\n"
                groups.setdefault(name, []).append((label, median, least, largest))
                rows.append({"series": name, "row": label, "ratio": median, "least": least, "largest": largest,
                             "msamples_per_second": statistics.median(speed for speed, *_ in measured), "peak_mib": memory})
    tables.report(options, text, rows, "growth of cost", groups)


if __name__ == "__main__":
    main()

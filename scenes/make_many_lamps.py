#!/usr/bin/env python3
"""Makes a scene with many lamps, of which each place sees few: an office of equal rooms with doors between them.

    scenes/make_many_lamps.py 10000 -o target/many_lamps.xml

Each room has 25 small lamps below its ceiling, whose strengths differ by up to three orders of magnitude. From the room
in the middle, with the camera, doors give a view of its neighbours. With fewer than 25 lamps there is one room. Nothing in
it comes from elsewhere, and the same number gives the same file.
"""
import argparse
import math
import random
from pathlib import Path

SIZE = 4.0  # of a room, in metres; walls are 2.5 high
HEIGHT = 2.5
DOOR = 1.0
A_ROW = 5  # lamps in a room, along each wall


def shape(kind, transform, inner):
    return f'    <shape type="{kind}"><transform name="to_world">{transform}</transform>{inner}</shape>\n'


def box(low, high):
    """A box of plaster from corner to corner."""
    scale = " ".join(f'{a}="{(h - l) / 2:.6g}"' for a, l, h in zip("xyz", low, high))
    middle = " ".join(f'{a}="{(h + l) / 2:.6g}"' for a, l, h in zip("xyz", low, high))
    return shape("cube", f"<scale {scale}/><translate {middle}/>", '<ref id="plaster"/>')


def wall(x, z, along_x, door):
    """From (x, z), one room long; with a door in its middle."""
    ends = [(0.0, SIZE)] if not door else [(0.0, (SIZE - DOOR) / 2), ((SIZE + DOOR) / 2, SIZE)]
    for a, b in ends:
        if along_x:
            yield box((x + a, 0, z - 0.05), (x + b, HEIGHT, z + 0.05))
        else:
            yield box((x - 0.05, 0, z + a), (x + 0.05, HEIGHT, z + b))


def lamp(rng, x, z):
    size = rng.uniform(0.01, 0.06)
    radiance = math.exp(rng.uniform(0.0, math.log(1000.0)))
    colour = " ".join(f"{radiance * c:.4g}" for c in (1.0, rng.uniform(0.6, 1.0), rng.uniform(0.3, 1.0)))
    place = f'<scale value="{size:.4g}"/><rotate x="1" angle="90"/><translate x="{x:.5g}" y="{HEIGHT - 0.1}" z="{z:.5g}"/>'
    return shape("rectangle", place, f'<emitter type="area"><rgb name="radiance" value="{colour}"/></emitter>')


def furniture(rng, x, z):
    for _ in range(4):
        w, h, d = rng.uniform(0.1, 0.5), rng.uniform(0.2, 1.4), rng.uniform(0.1, 0.5)
        a, b = x + rng.uniform(0.4, SIZE - 0.9), z + rng.uniform(0.4, SIZE - 0.9)
        yield box((a, 0, b), (a + w, h, b + d))


def scene(count):
    rng = random.Random(1)
    rooms = max(1, math.ceil(count / A_ROW**2))
    side = math.ceil(math.sqrt(rooms))
    middle = side // 2
    x, z = middle * SIZE, middle * SIZE
    yield f"""<scene version="3.0.0">
    <!-- {count} lamps in {side} x {side} rooms; made by scenes/make_many_lamps.py -->
    <default name="spp" value="64"/>
    <integrator type="path"><integer name="max_depth" value="4"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="75"/>
        <transform name="to_world">
            <lookat origin="{x + 0.3}, 1.7, {z + 0.4}" target="{x + SIZE}, 1.1, {z + 2.4}" up="0, 1, 0"/>
        </transform>
        <film type="hdrfilm">
            <integer name="width" value="256"/><integer name="height" value="192"/>
            <rfilter type="box"/>
        </film>
        <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
    </sensor>
    <bsdf type="diffuse" id="plaster"><rgb name="reflectance" value="0.7, 0.68, 0.65"/></bsdf>
    <bsdf type="roughplastic" id="floor">
        <rgb name="diffuse_reflectance" value="0.3, 0.2, 0.12"/><float name="alpha" value="0.15"/>
    </bsdf>
"""
    extent = side * SIZE
    half = f'x="{extent / 2}" y="{extent / 2}"'
    flat = f'<scale {half}/><rotate x="1" angle="{{}}"/><translate x="{extent / 2}" y="{{}}" z="{extent / 2}"/>'
    yield shape("rectangle", flat.format(-90, 0), '<ref id="floor"/>')
    yield shape("rectangle", flat.format(90, HEIGHT), '<ref id="plaster"/>')
    left = count
    order = sorted((abs(i - middle) + abs(j - middle), i, j) for i in range(side) for j in range(side))
    for _, i, j in order:
        x, z = i * SIZE, j * SIZE
        yield from wall(x, z, True, j > 0)
        yield from wall(x, z, False, i > 0)
        if i == side - 1:
            yield from wall(x + SIZE, z, False, False)
        if j == side - 1:
            yield from wall(x, z + SIZE, True, False)
        yield from furniture(rng, x, z)
        here = min(left, A_ROW**2)
        left -= here
        for k in rng.sample(range(A_ROW**2), here):
            step = SIZE / A_ROW
            yield lamp(rng, x + (k % A_ROW + rng.uniform(0.3, 0.7)) * step, z + (k // A_ROW + rng.uniform(0.3, 0.7)) * step)
    yield "</scene>\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lamps", type=int, nargs="?", default=10000)
    parser.add_argument("-o", "--output", type=Path, default=Path("target/many_lamps.xml"))
    arguments = parser.parse_args()
    if arguments.lamps < 1:
        parser.error("at least one lamp")
    arguments.output.parent.mkdir(parents=True, exist_ok=True)
    arguments.output.write_text("".join(scene(arguments.lamps)))


if __name__ == "__main__":
    main()

"""Writes the golden tables of emitters and textures with the reference renderer (mitsuba 3.9.1, scalar_rgb).

    python3 reference/golden_lights.py

Lines of plugins/emitters/golden.txt: case, reference point, two random numbers, then what the light's
`sample_direction` gives: direction, distance (0 if infinite), density, weight.
Lines of plugins/textures/golden.txt: case, u, v, then colour, scalar, gradient.
Lines of plugins/textures/golden_positions.txt: case, two random numbers, then u, v, density.
"""

from pathlib import Path

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
T = mi.ScalarTransform4f
ROOT = Path(__file__).resolve().parent.parent / "plugins"
rng = np.random.default_rng(1)


def pattern(width, height, channels):
    y, x, c = np.meshgrid(np.arange(height), np.arange(width), np.arange(channels), indexing="ij")
    return (((7 * x * x + 13 * y + 5 * c + x * y) % 11) / 4).astype(np.float32)


def bitmap(values):
    return mi.Bitmap(values)


def write(name, lines):
    text = "\n".join(" ".join([case] + [f"{float(v):.8g}" for v in values]) for case, values in lines)
    (ROOT / name).write_text(text + "\n")


def lights():
    color = {"type": "rgb", "value": [3, 2, 1]}
    placed = T().look_at([1, 2, 3], [0.3, -0.1, 1.5], [0, 1, 0])
    panorama = bitmap(pattern(6, 5, 3))
    turn = T().rotate([0, 1, 0], np.degrees(0.5)) @ T().rotate([1, 0, 0], np.degrees(1.0))
    rectangle = {"type": "rectangle", "to_world": T().rotate([1, 0, 0], 180).scale([1.5, 0.5, 1])}
    slide = {"type": "bitmap", "bitmap": bitmap(pattern(4, 3, 3)), "raw": True}
    nearest = dict(slide, filter_type="nearest")
    cases = {
        "constant": {"type": "constant", "radiance": color},
        "point": {"type": "point", "position": [1, 2, 3], "intensity": color},
        "directional": {"type": "directional", "direction": [1, 2, 3], "irradiance": color},
        "spot": {"type": "spot", "to_world": placed, "intensity": color, "cutoff_angle": 60.0, "beam_width": 10.0},
        "spot_default": {"type": "spot", "to_world": placed},
        "envmap": {"type": "envmap", "bitmap": panorama},
        "envmap_turned": {"type": "envmap", "bitmap": panorama, "scale": 2.5, "to_world": turn},
        "envmap_compensated": {"type": "envmap", "bitmap": panorama, "mis_compensation": True},
        "area": dict(rectangle, emitter={"type": "area", "radiance": color}),
        "area_bilinear": dict(rectangle, emitter={"type": "area", "radiance": slide}),
        "area_nearest": dict(rectangle, emitter={"type": "area", "radiance": nearest}),
    }
    for case, description in cases.items():
        owner = mi.load_dict(description)
        far = case in ("constant", "directional") or case.startswith("envmap")
        # A light does not keep its shape alive.
        light = owner.emitter() if case.startswith("area") else owner
        for _ in range(12):
            it = mi.Interaction3f()
            it.p = rng.uniform([-1, -1, -2], [1, 1, -0.5]) if case.startswith("area") else rng.uniform(-1, 1, 3)
            u = rng.random(2).astype(np.float32)
            ds, weight = light.sample_direction(it, mi.Point2f(*u))
            yield case, [*it.p, *u, *ds.d, 0 if far else ds.dist, ds.pdf, *weight]


if __name__ == "__main__":
    write("emitters/golden.txt", lights())

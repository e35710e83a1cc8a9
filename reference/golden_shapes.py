"""Writes what the reference renderer says about shapes and cameras: the tables that the unit tests compare with.

    python reference/golden_shapes.py        (needs the package `mitsuba`, 3.9.1)

Makes plugins/shapes/golden/{shapes.txt,bumpy.obj,bumpy.ply} and prints the table of plugins/sensors/tests.rs.
A line of shapes.txt is a word and numbers:
  shape TYPE key=value ...    begins a shape; `to_world` has twelve numbers, row by row
  hit O D T P N NS S UV DU DV a ray, and the surface where it hits: normal, shading frame, derivatives
  area U P UV PDF             a point sampled by area
  direct FROM U P D PDF       a point sampled as a light
"""
import pathlib

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
T = mi.ScalarTransform4f
ROOT = pathlib.Path(__file__).resolve().parent.parent / "plugins"
FOLDER = ROOT / "shapes" / "golden"
RNG = np.random.default_rng(1)

TURN = T().rotate([0.6, 0.8, 0], 40)
PLACEMENTS = {
    "unit": T(),
    "moved": T().translate([1, 2, 3]) @ TURN @ T().scale(0.5),
    "mirrored": T().translate([1, 2, 3]) @ TURN @ T().scale([1, 1, -1]),
}
STRETCHED = T().translate([-1, 0.5, 0]) @ TURN @ T().scale([2, 0.5, 3])


def numbers(*groups):
    return " ".join(f"{float(x):.8g}" for group in groups for x in np.atleast_1d(np.array(group)))


def write_meshes():
    """A bumpy sheet of 3 x 3 vertices, as OBJ with texture coordinates and as PLY with a vertex attribute."""
    grid = [(x, y, 0.4 * np.sin(2 * x + y)) for y in (-1, 0, 1) for x in (-1, 0, 1)]
    faces = [f for j in (0, 1) for i in (0, 1) for a in [3 * j + i] for f in ((a, a + 1, a + 4), (a, a + 4, a + 3))]
    lines = [f"v {x} {y} {z:.6f}" for x, y, z in grid]
    lines += [f"vt {(x + 1) / 2 + 0.1 * y} {(y + 1) / 2}" for x, y, _ in grid]
    lines += ["f " + " ".join(f"{v + 1}/{v + 1}" for v in face) for face in faces]
    (FOLDER / "bumpy.obj").write_text("\n".join(lines) + "\n")
    header = ["ply", "format ascii 1.0", f"element vertex {len(grid)}"]
    header += [f"property float {c}" for c in "xyzrgb"]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    rows = [f"{x} {y} {z:.6f} {abs(x)} {abs(y)} {0.25}" for x, y, z in grid]
    rows += ["3 " + " ".join(map(str, face)) for face in faces]
    (FOLDER / "bumpy.ply").write_text("\n".join(header + rows) + "\n")


def describe(out, kind, placement, **parameters):
    matrix = np.array(placement.matrix)
    words = [f"{key}={','.join(f'{float(x):.9g}' for x in np.atleast_1d(value))}" if not isinstance(value, (bool, str))
             else f"{key}={str(value).lower() if isinstance(value, bool) else value}" for key, value in parameters.items()]
    words.append("to_world=" + ",".join(f"{x:.9g}" for x in matrix[:3].ravel()))
    out.append(" ".join(["shape", kind] + words))
    loaded = {key: str(FOLDER / value) if key == "filename" else
              [float(x) for x in value] if isinstance(value, list) else value for key, value in parameters.items()}
    description = {"type": kind, "to_world": placement, **loaded}
    scene = mi.load_dict({"type": "scene", "shape": description})
    shape = scene.shapes()[0]
    low, high = np.array(scene.bbox().min), np.array(scene.bbox().max)
    center, reach = (low + high) / 2, float(np.linalg.norm(high - low))
    found = 0
    for _ in range(400):
        target = center + (RNG.random(3) - 0.5) * (high - low)
        way = RNG.normal(size=3)
        o = (target + 2 * reach * way / np.linalg.norm(way)).astype(np.float32)
        d = (target - o) / np.linalg.norm(target - o)
        ray = mi.Ray3f(o.tolist(), d.tolist())
        si = scene.ray_intersect(ray)
        if si.is_valid() and found < 8 and abs(float(np.dot(np.array(si.n), d))) > 0.1:
            out.append("hit " + numbers(ray.o, ray.d, si.t, si.p, si.n, si.sh_frame.n, si.sh_frame.s, si.uv, si.dp_du, si.dp_dv))
            found += 1
    for _ in range(6):
        u = RNG.random(2).astype(np.float32)
        ps = shape.sample_position(0.0, u.tolist())
        out.append("area " + numbers(u, ps.p, ps.uv, ps.pdf))
    for far in (0.0, 0.3, 1.0, 1.0, 3.0, 3.0):
        way = RNG.normal(size=3)
        it = mi.SurfaceInteraction3f()
        it.p = (center + (0.05 + far) * reach * way / np.linalg.norm(way)).tolist()
        u = RNG.random(2).astype(np.float32)
        ds = shape.sample_direction(it, u.tolist())
        out.append("direct " + numbers(it.p, u, ds.p, ds.d, ds.pdf))


def shapes():
    out = []
    for placement in PLACEMENTS.values():
        for kind in ("rectangle", "disk", "cylinder", "sphere"):
            describe(out, kind, placement)
        describe(out, "cube", placement)
    for kind in ("rectangle", "disk"):
        describe(out, kind, STRETCHED, flip_normals=True)
    describe(out, "cube", STRETCHED, flip_normals=True)
    moved = PLACEMENTS["moved"]
    describe(out, "sphere", moved, center=[1, -2, 0.5], radius=3.0, flip_normals=True)
    describe(out, "cylinder", moved, p0=[1, -2, 0.5], p1=[0, 1, 1], radius=0.3, flip_normals=True)
    describe(out, "obj", STRETCHED, filename="bumpy.obj")
    describe(out, "obj", PLACEMENTS["mirrored"], filename="bumpy.obj", flip_tex_coords=False, face_normals=True)
    describe(out, "ply", PLACEMENTS["mirrored"], filename="bumpy.ply", flip_normals=True)
    (FOLDER / "shapes.txt").write_text("\n".join(out) + "\n")


CAMERAS = [
    {"type": "perspective", "principal_point_offset_x": 0.1, "principal_point_offset_y": -0.2, "fov": 50, "fov_axis": "y"},
    {"type": "perspective"},
    {"type": "perspective", "fov": 60, "fov_axis": "diagonal"},
    {"type": "perspective", "fov": 60, "fov_axis": "smaller"},
    {"type": "perspective", "fov": 60, "fov_axis": "larger"},
    {"type": "perspective", "focal_length": "24mm"},
    {"type": "thinlens", "aperture_radius": 0.3, "focus_distance": 4, "fov": 50},
    {"type": "orthographic"},
]


def floats(values):
    return "[" + ", ".join(t if "." in t or "e" in t else t + ".0" for t in (f"{float(x):.7g}" for x in values)) + "]"


def cameras():
    for camera in CAMERAS:
        for upright in (False, True):
            x = -1 if upright else 1
            matrix = mi.ScalarMatrix4f([[0.8 * x, 0, 0.6, 1], [0, 1, 0, 2], [-0.6 * x, 0, 0.8, 3], [0, 0, 0, 1]])
            film = {"type": "hdrfilm", "width": 20 if upright else 40, "height": 50 if upright else 30}
            sensor = mi.load_dict({**camera, "film": film, "to_world": T(matrix), "near_clip": 0.5, "far_clip": 100})
            ray, _ = sensor.sample_ray(0.0, 0.5, [0.3, 0.6], [0.2, 0.9])
            parameters = ", ".join(f'"{key}={value}"' for key, value in camera.items() if key != "type")
            end = floats([ray.maxt])[1:-1]
            print(f'    ("{camera["type"]}", &[{parameters}], {str(upright).lower()}, {floats(ray.o)}, {floats(ray.d)}, {end}),')


if __name__ == "__main__":
    write_meshes()
    shapes()
    cameras()

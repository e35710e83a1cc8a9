#!/usr/bin/env python3
"""Makes the small textures and meshes that scenes/tests uses, in scenes/tests/assets.

The output is committed. Every picture and shape is made from formulas, so nothing in it comes from elsewhere.
Runs under the interpreter of reference/render.py: only its `mitsuba` can write JPEG and RGBE.
"""
import struct
import sys
import zlib
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "reference"))
import render  # noqa: E402

OUT = HERE / "tests" / "assets"


def write_png(path, pixels, bits=8):
    """Writes an integer array (H, W, C), C = 1 grey, 2 grey + alpha, 3 RGB, 4 RGBA; bits = 8 or 16."""
    height, width, channels = pixels.shape
    kind = {1: 0, 2: 4, 3: 2, 4: 6}[channels]
    lines = pixels.astype(">u2" if bits == 16 else "u1")
    raw = b"".join(b"\0" + line.tobytes() for line in lines)

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0))
                     + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))


def picture(numpy, size=16):
    """Linear RGB in [0,1]: red grows to the right, green downwards, with an F in blue that shows every flip."""
    axis = (numpy.arange(size) + 0.5) / size
    image = numpy.zeros((size, size, 3))
    image[..., 0], image[..., 1] = axis[None, :], axis[:, None]
    image[..., 2] = 0.1
    unit = size // 16
    for top, left, height, width in ((3, 4, 10, 2), (3, 4, 2, 8), (7, 4, 2, 5)):
        image[top * unit:(top + height) * unit, left * unit:(left + width) * unit] = (0.1, 0.1, 0.9)
    return image


def to_srgb(numpy, linear):
    return numpy.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def textures(numpy, mi):
    folder = OUT / "textures"
    folder.mkdir(parents=True, exist_ok=True)
    linear = picture(numpy)
    bytes8 = numpy.round(to_srgb(numpy, linear) * 255)
    write_png(folder / "picture.png", bytes8)
    write_png(folder / "picture16.png", numpy.round(to_srgb(numpy, linear) * 65535), 16)
    grey = numpy.round(to_srgb(numpy, linear.mean(axis=2, keepdims=True)) * 255)
    write_png(folder / "grey.png", grey)
    write_png(folder / "grey_alpha.png", numpy.concatenate([grey, 255 - grey], axis=2))
    axis = (numpy.arange(16) + 0.5) / 16
    radius = numpy.hypot(axis[None, :] - 0.5, axis[:, None] - 0.5)
    write_png(folder / "picture_alpha.png", numpy.concatenate([bytes8, numpy.where(radius < 0.4, 255, 0)[..., None]], axis=2))
    large = numpy.round(to_srgb(numpy, picture(numpy, 32)) * 255).astype(numpy.uint8)
    mi.Bitmap(large).write(str(folder / "picture.jpg"), quality=95)
    render.write_exr(folder / "picture.exr", linear.astype(numpy.float32), ["R", "G", "B"])
    render.write_exr(folder / "luminance.exr", linear[..., :1].astype(numpy.float32), ["Y"])
    mi.Bitmap(linear.astype(numpy.float32)).write(str(folder / "picture.hdr"))
    mi.Bitmap(linear.astype(numpy.float32)).write(str(folder / "picture.pfm"))

    # A parameter in [0,1] that varies to the right and downwards: roughness, weight, opacity.
    ramp = 0.05 + 0.5 * axis[None, :] * (0.3 + 0.7 * axis[:, None])
    write_png(folder / "ramp.png", numpy.round(ramp[..., None] * 255))
    # Bumps: height cos(2 pi 2 u) cos(2 pi 2 v), and the normals of the same surface.
    fine = (numpy.arange(32) + 0.5) / 32
    wave = 4 * numpy.pi * fine
    height = 0.5 + 0.5 * numpy.cos(wave[None, :]) * numpy.cos(wave[:, None])
    write_png(folder / "height.png", numpy.round(height[..., None] * 255))
    slope_u = -0.35 * numpy.sin(wave[None, :]) * numpy.cos(wave[:, None])
    slope_v = -0.35 * numpy.cos(wave[None, :]) * numpy.sin(wave[:, None])
    normals = numpy.stack([-slope_u, -slope_v, numpy.ones_like(height)], axis=2)
    normals /= numpy.linalg.norm(normals, axis=2, keepdims=True)
    write_png(folder / "normals.png", numpy.round((0.5 * normals + 0.5) * 255))

    # A sky: gradient, a warm sun at u = 0.3, a dark ground, and a blue mark at u = 0.7 just above the horizon.
    u, v = (numpy.arange(32) + 0.5) / 32, (numpy.arange(16) + 0.5) / 16
    sky = numpy.zeros((16, 32, 3))
    sky[:] = numpy.where(v < 0.5, 0.3 + 0.6 * (1 - 2 * v), 0.08)[:, None, None]
    sky += numpy.exp(-((u[None, :] - 0.3) ** 2 * 4 + (v[:, None] - 0.25) ** 2) / 0.004)[..., None] * (18, 12, 6)
    sky[6:8, 21:24] = (0.1, 0.3, 2.0)
    render.write_exr(folder / "sky.exr", sky.astype(numpy.float32), ["R", "G", "B"])
    mi.Bitmap(sky.astype(numpy.float32)).write(str(folder / "sky.hdr"))
    render.write_exr(folder / "even.exr", numpy.full((4, 8, 3), 0.5, numpy.float32), ["R", "G", "B"])


def vase(numpy, around=16, up=8):
    """A closed-looking surface of revolution about Z with a dent at angle 0: positions, normals, uv, quads."""
    turn, rise = numpy.meshgrid(numpy.arange(around + 1) / around, numpy.arange(up + 1) / up)
    angle = 2 * numpy.pi * turn

    def surface(turn_angle, t):
        radius = 0.45 + 0.2 * numpy.cos(5 * t) + 0.12 * numpy.cos(turn_angle)
        return numpy.stack([radius * numpy.cos(turn_angle), radius * numpy.sin(turn_angle), 1.4 * t], axis=-1)

    step = 1e-5
    along = (surface(angle + step, rise) - surface(angle - step, rise)) / (2 * step)
    upward = (surface(angle, rise + step) - surface(angle, rise - step)) / (2 * step)
    normal = numpy.cross(along, upward)
    normal /= numpy.linalg.norm(normal, axis=-1, keepdims=True)
    row = around + 1
    quads = [(j * row + i, j * row + i + 1, (j + 1) * row + i + 1, (j + 1) * row + i) for j in range(up) for i in range(around)]
    uv = numpy.stack([turn, rise], axis=-1)
    return surface(angle, rise).reshape(-1, 3), normal.reshape(-1, 3), uv.reshape(-1, 2), quads


def triangles(quads):
    return [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]


def write_obj(path, points, normals, uv, faces):
    lines = ["# made by scenes/make_assets.py", "o vase"]
    lines += [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in points]
    if uv is not None:
        lines += [f"vt {u:.5f} {v:.5f}" for u, v in uv]
    if normals is not None:
        lines += [f"vn {x:.5f} {y:.5f} {z:.5f}" for x, y, z in normals]

    def corner(i):
        texture = i + 1 if uv is not None else ""
        return str(i + 1) + (f"/{texture}/{i + 1}" if normals is not None else f"/{texture}" if texture else "")

    lines += ["s 1"] + ["f " + " ".join(corner(i) for i in face) for face in faces]
    path.write_text("\n".join(lines) + "\n")


def write_ply(path, layout, points, normals, uv, faces, colors=None):
    """layout: ascii, binary_little_endian or binary_big_endian."""
    names, columns = ["x", "y", "z"], [*points.T]
    for group, data in (("nx ny nz", normals), ("u v", uv), ("r g b", colors)):
        if data is not None:
            names += group.split()
            columns += [*data.T]
    header = ["ply", f"format {layout} 1.0", "comment made by scenes/make_assets.py", f"element vertex {len(points)}"]
    header += [f"property float {name}" for name in names]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    head = ("\n".join(header) + "\n").encode()
    rows = list(zip(*columns))
    if layout == "ascii":
        body = "".join(" ".join(f"{v:.6g}" for v in row) + "\n" for row in rows)
        body += "".join(f"{len(f)} " + " ".join(map(str, f)) + "\n" for f in faces)
        path.write_bytes(head + body.encode())
    else:
        order = "<" if layout == "binary_little_endian" else ">"
        body = b"".join(struct.pack(f"{order}{len(row)}f", *row) for row in rows)
        body += b"".join(struct.pack(f"{order}B{len(f)}i", len(f), *f) for f in faces)
        path.write_bytes(head + body)


def serialized_shape(points, normals, uv, faces, version=4, double=False, face_normals=False, name=b"vase"):
    """One shape of the `serialized` format of 0.x."""
    flags = (1 if normals is not None else 0) | (2 if uv is not None else 0)
    flags |= (0x2000 if double else 0x1000) | (0x10 if face_normals else 0)
    real = "<f8" if double else "<f4"
    body = struct.pack("<I", flags) + (name + b"\0" if version == 4 else b"") + struct.pack("<QQ", len(points), len(faces))
    for data in (points, normals, uv):
        body += data.astype(real).tobytes() if data is not None else b""
    body += b"".join(struct.pack("<3I", *face) for face in faces)
    return struct.pack("<HH", 0x041C, version) + zlib.compress(body, 9)


def write_serialized(path, shapes, version=4):
    offsets, data = [], b""
    for shape in shapes:
        offsets.append(len(data))
        data += shape
    path.write_bytes(data + b"".join(struct.pack("<Q" if version == 4 else "<I", o) for o in offsets) + struct.pack("<I", len(offsets)))


def meshes(numpy):
    folder = OUT / "meshes"
    folder.mkdir(parents=True, exist_ok=True)
    points, normals, uv, quads = vase(numpy)
    faces = triangles(quads)
    colors = 0.1 + 0.8 * numpy.stack([uv[:, 0], uv[:, 1], 1 - uv[:, 0]], axis=1)
    write_obj(folder / "vase.obj", points, normals, uv, quads)
    write_obj(folder / "vase_plain.obj", points, None, None, faces)
    write_ply(folder / "vase_ascii.ply", "ascii", points, None, uv, faces)
    write_ply(folder / "vase_little.ply", "binary_little_endian", points, normals, uv, faces)
    write_ply(folder / "vase_big.ply", "binary_big_endian", points, normals, uv, faces)
    write_ply(folder / "vase_colors.ply", "binary_little_endian", points, normals, uv, faces, colors)
    cube_points = numpy.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0.0, 1.0)])
    cube_quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    write_serialized(folder / "two.serialized", [
        serialized_shape(cube_points, None, None, triangles(cube_quads), face_normals=True, name=b"block"),
        serialized_shape(points, normals, uv, faces)])
    write_serialized(folder / "double.serialized", [serialized_shape(points, normals, uv, faces, double=True)])
    write_serialized(folder / "version3.serialized", [serialized_shape(points, normals, uv, faces, version=3)], version=3)


def main():
    render.enter_environment()
    import mitsuba as mi
    import numpy
    mi.set_variant("scalar_rgb")
    textures(numpy, mi)
    meshes(numpy)
    (OUT / "spectra").mkdir(parents=True, exist_ok=True)
    (OUT / "spectra" / "orange.spd").write_text(
        "# reflectance of an imagined orange paint\n400 0.05\n500 0.08\n560 0.35\n600 0.75\n700 0.82\n")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Makes a scene whose light comes through glass twice: a torus inside a block of glass, lit by one small lamp.

    scenes/make_torus.py -o target/torus

What is seen of the torus and of the floor below the block is lit through the glass only, so no sampling of lights finds
it: a path has to run into the lamp by itself. After the scene of Müller, Gross and Novák 2017 ("Practical path guiding
for efficient light-transport simulation", figure 1) in its idea, not in its data. The folder gets `torus.xml` and
`torus.ply`; nothing in them comes from elsewhere.
"""
import argparse
import math
import struct
from pathlib import Path

RINGS, SIDES = 96, 48
RADIUS, TUBE = 0.55, 0.22

SCENE = """<scene version="3.0.0">
    <!-- made by scenes/make_torus.py -->
    <default name="spp" value="64"/>
    <default name="resx" value="256"/>
    <default name="resy" value="192"/>
    <default name="max_depth" value="12"/>
    <integrator type="path"><integer name="max_depth" value="$max_depth"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="46"/>
        <transform name="to_world"><lookat origin="2.6, 2.2, 3.4" target="0, 0.75, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm">
            <integer name="width" value="$resx"/><integer name="height" value="$resy"/>
            <rfilter type="box"/>
        </film>
        <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
    </sensor>
    <bsdf type="diffuse" id="plaster"><rgb name="reflectance" value="0.6, 0.6, 0.58"/></bsdf>
    <shape type="rectangle">
        <transform name="to_world"><scale x="6" y="6"/><rotate x="1" angle="-90"/></transform>
        <ref id="plaster"/>
    </shape>
    <shape type="rectangle">
        <transform name="to_world"><scale x="6" y="6"/><translate y="3" z="-2.5"/></transform>
        <ref id="plaster"/>
    </shape>
    <shape type="cube">
        <transform name="to_world"><scale x="1" y="0.7" z="1"/><translate y="0.75"/></transform>
        <bsdf type="dielectric"><float name="int_ior" value="1.5"/></bsdf>
    </shape>
    <shape type="ply">
        <string name="filename" value="torus.ply"/>
        <transform name="to_world"><rotate x="1" angle="35"/><translate y="0.75"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.75, 0.35, 0.12"/></bsdf>
    </shape>
    <shape type="rectangle">
        <transform name="to_world">
            <scale value="0.12"/><lookat origin="1.4, 4, 1.6" target="0, 0.75, 0" up="0, 1, 0"/>
        </transform>
        <emitter type="area"><rgb name="radiance" value="400, 370, 320"/></emitter>
    </shape>
</scene>
"""


def torus():
    """Vertices with normals, and triangles, as a PLY file."""
    rows = []
    for i in range(RINGS):
        a = 2 * math.pi * i / RINGS
        for j in range(SIDES):
            b = 2 * math.pi * j / SIDES
            n = (math.cos(a) * math.cos(b), math.sin(b), math.sin(a) * math.cos(b))
            p = (math.cos(a) * RADIUS + TUBE * n[0], TUBE * n[1], math.sin(a) * RADIUS + TUBE * n[2])
            rows.append(struct.pack("<6f", *p, *n))
    faces = []
    for i in range(RINGS):
        for j in range(SIDES):
            a, b = i * SIDES + j, (i + 1) % RINGS * SIDES + j
            c, d = (i + 1) % RINGS * SIDES + (j + 1) % SIDES, i * SIDES + (j + 1) % SIDES
            faces += [struct.pack("<B3i", 3, a, d, c), struct.pack("<B3i", 3, a, c, b)]
    properties = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n{properties}"
        f"element face {len(faces)}\nproperty list uchar int vertex_index\nend_header\n"
    )
    return head.encode() + b"".join(rows) + b"".join(faces)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("target/torus"), help="folder")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / "torus.ply").write_bytes(torus())
    (arguments.output / "torus.xml").write_text(SCENE)


if __name__ == "__main__":
    main()

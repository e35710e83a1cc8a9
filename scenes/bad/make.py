#!/usr/bin/env python3
"""Makes the bad scenes that are too large to commit:  scenes/bad/make.py OUTPUT_FOLDER

Each case is a folder NAME with NAME.xml in it, like the committed ones beside this file.
"""
import struct
import sys
import zlib
from pathlib import Path

HEAD = '<integrator type="path"/>\n<sensor type="perspective"/>\n<emitter type="constant"/>\n'


def scene(body):
    return f'<scene version="3.0.0">\n{HEAD}{body}</scene>\n'


def mesh(kind, name):
    return scene(f'<shape type="{kind}">\n<string name="filename" value="{name}"/>\n</shape>\n')


def bomb(chunk=1 << 20, count=2000):
    """A `serialized` file of about 2 MB that inflates to 2 GB behind a mesh of one triangle."""
    body = struct.pack("<I", 0x1000) + b"m\0" + struct.pack("<QQ", 3, 1)
    body += struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) + struct.pack("<3I", 0, 1, 2)
    packer = zlib.compressobj(9)
    packed = packer.compress(body) + b"".join(packer.compress(bytes(chunk)) for _ in range(count)) + packer.flush()
    return struct.pack("<HH", 0x041C, 4) + packed + struct.pack("<QI", 0, 1)


CASES = {
    # 200 000 nested elements: the reference overflows its stack.
    "i04_depth_200000": (lambda: '<scene version="3.0.0">' + '<shape type="shapegroup">' * 200_000 + "</shape>" * 200_000 + "</scene>\n", {}),
    "i04_depth_200000_unclosed": (lambda: '<scene version="3.0.0">' + '<bsdf type="twosided">' * 200_000, {}),
    "i04_wide_100000": (lambda: scene('<shape type="sphere"/>\n' * 100_000 + "<wrong/>\n"), {}),
    "i15_obj_long_line": (lambda: mesh("obj", "mesh.obj"), {"mesh.obj": lambda: b"v 0 0 0\nv 1 0 0\nv 0 1 0\n# " + b"x" * 1_000_000 + b"\nf 1 2 " + b"9" * 1_000_000 + b"\n"}),
    "i15_obj_200_corners": (lambda: mesh("obj", "mesh.obj"), {"mesh.obj": lambda: ("".join(f"v {i} {i * i} 0\n" for i in range(200)) + "f " + " ".join(str(i + 2) for i in range(200)) + "\n").encode()}),
    "i16_serialized_bomb_2gb": (lambda: mesh("serialized", "mesh.serialized"), {"mesh.serialized": bomb}),
    "i02_attribute_10_mb": (lambda: scene('<shape type="sphere">\n<float name="radius" value="' + "1" * 10_000_000 + 'x"/>\n</shape>\n'), {}),
    "i10_parameter_growth": (lambda: scene("".join(f'<default name="p{i}" value="{f"$p{i - 1}" * 10 if i else "1"}"/>\n' for i in range(12)) + '<shape type="sphere">\n<float name="radius" value="$p11"/>\n</shape>\n'), {}),
}


def main():
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    for name, (xml, files) in CASES.items():
        folder = Path(sys.argv[1]) / name
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.xml").write_text(xml())
        for file, content in files.items():
            (folder / file).write_bytes(content())


if __name__ == "__main__":
    main()

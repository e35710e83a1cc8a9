#!/usr/bin/env python3
"""Renders reference images with the pinned `mitsuba` package.

    reference/render.py scenes/cornell-box.xml                   mean, variance and manifest entry
    reference/render.py scene.xml -o out.exr --spp 512 -D res=64 one image, chosen settings
    reference/render.py --all [--stale] [WORD ...]               every committed reference
    reference/render.py --exact [SCENE ...]                      noise-for-noise images of scalar_rgb
    reference/render.py --check                                  recompute hashes, render nothing
    reference/render.py --sheet sheet.png [WORD ...]             one picture of all the references

A reference is the mean of N independent passes (N >= 16, seeds seed .. seed+N-1), stored as float32 EXR
rounded to 16 bits of mantissa (8e-6). Beside it, `name.var.exr` holds the variance *of that mean*, estimated
from the spread of the passes and rounded to 5 bits: with 16 passes it is known to about a third only.

An exact image is one run of `scalar_rgb` at 1 or 4 samples per pixel. A renderer that draws the same
random numbers in the same order reproduces its noise, so it is compared at float tolerance. Block edges are
those of up to three threads: 32 pixels, 16 for pictures of one block.

A scene may set its own reference in a comment:  <!-- reference: spp=256 variant=scalar_rgb exact=no -->
Keys: variant, spp, passes, seed, size (WxH), exact (yes|no), twin (a file to render instead, relative to
the scene), define.NAME (as -D NAME=).

The first use makes a virtual environment in reference/.venv from requirements.txt;
LUCERNA_REFERENCE_PYTHON names an interpreter to use instead.
"""
import argparse
import hashlib
import os
import re
import struct
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
import zlib
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from passes import Job  # noqa: E402

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
MANIFEST = HERE / "manifest.toml"
IMAGES = HERE / "images"
EXACT = HERE / "exact"
DEFAULTS = {"variant": "llvm_ad_rgb", "spp": "128", "passes": "16", "seed": "0", "exact": "yes"}


def environment():
    """The interpreter that has `mitsuba`: LUCERNA_REFERENCE_PYTHON, or that of reference/.venv, made when missing."""
    chosen = os.environ.get("LUCERNA_REFERENCE_PYTHON")
    if chosen:
        return Path(chosen)
    folder = HERE / ".venv"
    python = folder / "bin" / "python"
    if not (folder / "ready").exists():
        subprocess.check_call([sys.executable, "-m", "venv", str(folder)])
        subprocess.check_call([str(python), "-m", "pip", "install", "--quiet", "-r", str(HERE / "requirements.txt")])
        (folder / "ready").touch()
    return python


def enter_environment():
    """Restarts the running script under the interpreter that has `mitsuba`."""
    if not os.environ.get("LUCERNA_REFERENCE_ENTERED"):
        os.environ["LUCERNA_REFERENCE_ENTERED"] = "1"
        python = str(environment())
        os.execv(python, [python, os.path.abspath(sys.argv[0]), *sys.argv[1:]])


# ---- scenes and their files -----------------------------------------------------------------------

def all_scenes():
    """Every scene that has a committed reference, in a fixed order."""
    tests = ROOT / "scenes" / "tests"
    found = sorted(tests.glob("*/*.xml"))
    return [ROOT / "scenes" / "cornell-box.xml", *found]


def exact_runs(name):
    """The (seed, samples per pixel) of the exact images of a scene."""
    return [(0, 1), (0, 4), (3, 1), (3, 4)] if name == "cornell-box" else [(0, 1), (3, 4)]


def directive(scene):
    """The settings of the scene's `<!-- reference: ... -->` comment over the defaults."""
    settings = dict(DEFAULTS)
    match = re.search(r"<!--\s*reference:\s*(.*?)-->", scene.read_text("utf-8"), re.S)
    if match:
        settings.update(word.split("=", 1) for word in match.group(1).split())
    return settings


def rendered_file(scene, settings):
    """The file the reference renderer loads: the scene, or its hand-written twin in today's language."""
    return (scene.parent / settings.get("twin", scene.name)).resolve()


def files_of(scene, defines):
    """The scene and every existing file it names, directly or by `include`, in order of first mention."""
    values, seen, search = dict(defines), [], []

    def fill(text):
        for key in sorted(values, key=len, reverse=True):
            text = text.replace("$" + key, str(values[key]))
        return text

    def visit(path):
        if path in seen:
            return
        seen.append(path)
        for node in ElementTree.parse(path).iter():
            if node.tag == "default":
                values.setdefault(node.get("name"), node.get("value"))
            elif node.tag == "path":
                search.insert(0, path.parent / fill(node.get("value")))
            named = node.get("filename") or (node.get("value") if node.get("name") == "filename" else None)
            if not named:
                continue
            for folder in [*search, path.parent, scene.parent]:
                file = (folder / fill(named)).resolve()
                if not file.is_file():
                    continue
                if node.tag == "include":
                    visit(file)
                elif file not in seen:
                    seen.append(file)
                break

    visit(scene.resolve())
    return seen


def scene_hash(scene, defines):
    """SHA-256 over the sorted lines `<path relative to the scene> <SHA-256 of the file>\\n`."""
    total = hashlib.sha256()
    folder = scene.resolve().parent
    for name, file in sorted((os.path.relpath(file, folder), file) for file in files_of(scene, defines)):
        total.update(f"{name} {hashlib.sha256(file.read_bytes()).hexdigest()}\n".encode())
    return total.hexdigest()


# ---- manifest -------------------------------------------------------------------------------------

def read_manifest():
    return tomllib.loads(MANIFEST.read_text()) if MANIFEST.exists() else {}


def write_manifest(manifest):
    """Sorted tables, sorted keys: the same entries give the same bytes."""
    lines = ["# Written by reference/render.py; one table per image. See its head for the meaning of the hash.\n"]
    for kind in sorted(manifest):
        for name in sorted(manifest[kind]):
            lines.append(f'\n[{kind}."{name}"]\n')
            for key, value in sorted(manifest[kind][name].items()):
                if isinstance(value, str):
                    value = '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
                elif isinstance(value, list):
                    value = "[" + ", ".join(f'"{v}"' for v in value) + "]"
                lines.append(f"{key} = {value}\n")
    temporary = MANIFEST.with_suffix(".tmp")
    temporary.write_text("".join(lines))
    temporary.replace(MANIFEST)


def record(kind, name, entry):
    manifest = read_manifest()
    manifest.setdefault(kind, {})[name] = entry
    write_manifest(manifest)


def prune():
    """Drops images and manifest entries whose scene is gone or no longer asks for them."""
    wanted = {"image": set(), "exact": set()}
    for scene in all_scenes():
        name = reference_name(scene)
        wanted["image"].add(name)
        if directive(scene)["exact"] == "yes":
            wanted["exact"].update(f"{name}-seed{seed}-spp{spp}" for seed, spp in exact_runs(name))
    manifest = read_manifest()
    for kind, folder in (("image", IMAGES), ("exact", EXACT)):
        manifest[kind] = {key: entry for key, entry in manifest.get(kind, {}).items() if key in wanted[kind]}
        for file in folder.rglob("*.exr"):
            if file.relative_to(folder).as_posix().removesuffix(".exr").removesuffix(".var") not in wanted[kind]:
                file.unlink()
    write_manifest(manifest)


# ---- rendering ------------------------------------------------------------------------------------

def rounded(values, bits):
    """The values as float32 with `bits` bits of mantissa, which compress better."""
    import numpy
    drop = 23 - bits
    words = numpy.ascontiguousarray(values, dtype=numpy.float32).view(numpy.uint32)
    return ((words + numpy.uint32(1 << (drop - 1))) & ~numpy.uint32((1 << drop) - 1)).view(numpy.float32)


def write_exr(path, array, channels):
    """Writes (H, W, C) as a float32 scanline EXR with ZIP compression; the same input gives the same bytes."""
    import numpy
    path.parent.mkdir(parents=True, exist_ok=True)
    height, width, _ = array.shape
    order = sorted(range(len(channels)), key=lambda index: channels[index].encode())
    planes = numpy.ascontiguousarray(array[:, :, order].transpose(0, 2, 1), dtype="<f4")  # line, channel, column

    def attribute(name, kind, value):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value

    float32 = struct.pack("<iB3xii", 2, 0, 1, 1)
    names = b"".join(channels[index].encode() + b"\0" + float32 for index in order) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    long_names = 0x400 if any(len(name) > 31 for name in channels) else 0
    header = struct.pack("<ii", 20000630, 2 | long_names) + b"".join([
        attribute("channels", "chlist", names), attribute("compression", "compression", b"\x03"),
        attribute("dataWindow", "box2i", window), attribute("displayWindow", "box2i", window),
        attribute("lineOrder", "lineOrder", b"\0"), attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
        attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        attribute("screenWindowWidth", "float", struct.pack("<f", 1)), b"\0"])
    chunks = []
    for first in range(0, height, 16):
        raw = planes[first:first + 16].tobytes()
        mixed = numpy.frombuffer(raw[0::2] + raw[1::2], numpy.uint8).astype(numpy.int16)
        mixed[1:] = mixed[1:] - mixed[:-1] + 128  # the predictor of the format
        packed = zlib.compress(mixed.astype(numpy.uint8).tobytes(), 9)
        data = packed if len(packed) < len(raw) else raw
        chunks.append(struct.pack("<ii", first, len(data)) + data)
    offset, table = len(header) + 8 * len(chunks), b""
    for chunk in chunks:
        table, offset = table + struct.pack("<Q", offset), offset + len(chunk)
    path.write_bytes(header + table + b"".join(chunks))


def parse_integrator(text):
    """`path:max_depth=5` as a plugin dictionary."""
    if not text:
        return None
    kind, _, rest = text.partition(":")
    plugin = {"type": kind}
    for pair in filter(None, rest.split(",")):
        key, value = pair.split("=", 1)
        plugin[key] = {"true": True, "false": False}.get(value) if value in ("true", "false") else (
            int(value) if re.fullmatch(r"-?\d+", value) else float(value) if re.fullmatch(r"[-\d.e]+", value) else value)
    return plugin


def entry_of(scene, source, job, settings, defines, shape, integrator):
    entry = {
        "scene": os.path.relpath(scene, ROOT), "scene_sha256": scene_hash(source, defines),
        "variant": settings["variant"], "spp": int(settings["spp"]), "seed": int(settings["seed"]),
        "passes": int(settings["passes"]), "width": shape[1], "height": shape[0], "mitsuba": job.mi.__version__,
    }
    if source != scene.resolve():
        entry["twin"] = os.path.relpath(source, ROOT)
    if defines:
        entry["define"] = [f"{k}={v}" for k, v in sorted(defines.items())]
    if integrator:
        entry["integrator"] = integrator
    return entry


def defines_of(settings, given=()):
    named = {k[len("define."):]: v for k, v in settings.items() if k.startswith("define.")}
    named.update(pair.split("=", 1) for pair in given)
    return named


def size_of(text):
    return [int(v) for v in text.split("x")] if text else None


def reference_name(scene):
    """`integrators/path_depth` for scenes/tests/integrators/path_depth.xml; None outside scenes/."""
    scene = scene.resolve()
    for base in (ROOT / "scenes" / "tests", ROOT / "scenes"):
        if scene.is_relative_to(base):
            return scene.relative_to(base).with_suffix("").as_posix()
    return None


def render_reference(scene, settings, given=(), integrator=None, output=None):
    """Writes mean and variance of one scene and, for images of this repository, the manifest entry."""
    import numpy
    passes = int(settings["passes"])
    if passes < 16:
        raise SystemExit("at least 16 passes are needed for a variance")
    defines, source = defines_of(settings, given), rendered_file(scene, settings)
    job = Job(source, settings["variant"], defines, size_of(settings.get("size")), parse_integrator(integrator))
    total = squares = 0.0
    for index in range(passes):
        image = job.render(int(settings["spp"]), int(settings["seed"]) + index).astype(numpy.float64)
        total, squares = total + image, squares + image * image
    mean = total / passes
    variance = numpy.maximum(squares / passes - mean * mean, 0.0) / (passes - 1)
    channels = job.channels()
    name = reference_name(scene)
    output = output or (IMAGES / f"{name}.exr" if name else Path(f"{scene.stem}.exr"))
    write_exr(output, rounded(mean, 16), channels)
    write_exr(output.with_suffix(".var.exr"), rounded(variance, 5), channels)
    if not numpy.isfinite(mean).all():
        print(f"warning: {scene}: not every pixel is finite")
    if output.resolve().is_relative_to(IMAGES):
        key = output.resolve().relative_to(IMAGES).with_suffix("").as_posix()
        record("image", key, entry_of(scene.resolve(), source, job, settings, defines, mean.shape, integrator))
    return mean, variance


def render_exact(scene, settings):
    """Writes the noise-for-noise images of one scene."""
    defines, source = defines_of(settings), rendered_file(scene, settings)
    name = reference_name(scene)
    size = size_of(settings.get("exact_size") or settings.get("size"))
    job = Job(source, "scalar_rgb", defines, size)
    for seed, spp in exact_runs(name):
        image = job.render(spp, seed)
        key = f"{name}-seed{seed}-spp{spp}"
        write_exr(EXACT / f"{key}.exr", image, job.channels())
        own = dict(settings, variant="scalar_rgb", spp=spp, seed=seed, passes=1)
        record("exact", key, entry_of(scene.resolve(), source, job, own, defines, image.shape, None))


def is_fresh(scene, settings, kind):
    """Whether the stored image was made from these very files and settings."""
    name = reference_name(scene)
    defines, source = defines_of(settings), rendered_file(scene, settings)
    table = read_manifest().get(kind, {})
    runs = [(None, name)] if kind == "image" else [
        (s, f"{name}-seed{s[0]}-spp{s[1]}") for s in exact_runs(name)]
    for run, key in runs:
        entry = table.get(key)
        path = (IMAGES if kind == "image" else EXACT) / f"{key}.exr"
        if not entry or not path.exists() or entry["scene_sha256"] != scene_hash(source, defines):
            return False
        if kind == "image" and any(str(entry[k]) != settings[k] for k in ("variant", "spp", "passes", "seed")):
            return False
    return True


def expectations(scene):
    """Pairs (value, relative tolerance) of the `<!-- expect mean = V within P% -->` comments."""
    found = re.findall(r"<!--\s*expect mean = ([-\d.e]+) within ([\d.]+)%", scene.read_text("utf-8"))
    return [(float(value), float(percent) / 100) for value, percent in found]


def contact_sheet(scenes, output):
    """Tiles the RGB part of every reference into one PNG, in the order of `scenes` (names are printed)."""
    import mitsuba as mi
    import numpy
    mi.set_variant("scalar_rgb")
    tile, columns = 96, 12
    images = [s for s in scenes if (IMAGES / f"{reference_name(s)}.exr").exists()]
    sheet = numpy.zeros((-(-len(images) // columns) * tile, columns * tile, 3), numpy.float32)
    for index, scene in enumerate(images):
        data = numpy.array(mi.Bitmap(str(IMAGES / f"{reference_name(scene)}.exr")))
        data = numpy.atleast_3d(data)
        data = data[..., :3] if data.shape[2] >= 3 else numpy.repeat(data[..., :1], 3, axis=2)
        row, column = divmod(index, columns)
        step = -(-max(data.shape[:2]) // (tile - 2))
        data = data[::step, ::step]
        height, width = data.shape[:2]
        sheet[row * tile:row * tile + height, column * tile:column * tile + width] = data
        print(f"{row},{column} {reference_name(scene)}")
    mi.util.write_bitmap(str(output), sheet)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", help="scene files; with --all, --exact, --check and --sheet: words to look for")
    parser.add_argument("--all", action="store_true", help="every committed reference, means and exact images")
    parser.add_argument("--stale", action="store_true", help="skip images whose files and settings are unchanged")
    parser.add_argument("--exact", action="store_true", help="only the exact images")
    parser.add_argument("--check", action="store_true", help="report references that are stale or missing")
    parser.add_argument("--sheet", type=Path, help="write a contact sheet of the references")
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--variant")
    parser.add_argument("--spp", type=int, help="samples per pixel of one pass")
    parser.add_argument("--passes", type=int)
    parser.add_argument("--seed", type=int)
    parser.add_argument("--size", help="WxH")
    parser.add_argument("-D", dest="define", action="append", default=[], metavar="NAME=VALUE")
    parser.add_argument("--integrator", help="instead of the scene's, such as path:max_depth=5")
    arguments = parser.parse_args()

    many = arguments.all or arguments.check or arguments.sheet
    chosen = all_scenes() if many or (arguments.exact and not arguments.scenes) else [Path(s) for s in arguments.scenes]
    if many and arguments.scenes:
        chosen = [s for s in chosen if any(word in s.as_posix() for word in arguments.scenes)]
    if arguments.check:
        stale = [f"{kind} {reference_name(s)}" for s in chosen for kind in ("image", "exact")
                 if (kind == "image" or directive(s)["exact"] == "yes") and not is_fresh(s, directive(s), kind)]
        print("\n".join(stale) or "all references are up to date")
        raise SystemExit(1 if stale else 0)

    enter_environment()
    if arguments.sheet:
        return contact_sheet(chosen, arguments.sheet)
    if not chosen:
        parser.error("name a scene, or use --all")
    failed = []
    for scene in chosen:
        settings = directive(scene)
        for key in ("variant", "spp", "passes", "seed", "size"):
            if getattr(arguments, key) is not None:
                settings[key] = str(getattr(arguments, key))
        try:
            if not arguments.exact and not (arguments.stale and is_fresh(scene, settings, "image")):
                mean, variance = render_reference(scene, settings, arguments.define, arguments.integrator, arguments.output)
                noise = float(variance.mean()) ** 0.5 / max(abs(float(mean.mean())), 1e-9)
                line = f"{scene}: mean {mean.mean():.5f}, noise {100 * noise:.2f}%"
                for value, tolerance in expectations(scene):
                    if abs(float(mean.mean()) - value) > tolerance * abs(value):
                        failed.append(f"{scene}: mean {mean.mean():.5f}, expected {value} within {100 * tolerance:g}%")
                    line += f", expected {value}"
                print(line, flush=True)
            if (arguments.all or arguments.exact) and settings["exact"] == "yes":
                if not (arguments.stale and is_fresh(scene, settings, "exact")):
                    render_exact(scene, settings)
        except Exception as error:
            failed.append(f"{scene}: {str(error)[:400]}")
            print(failed[-1], flush=True)
    if arguments.all:
        prune()
    if failed:
        raise SystemExit("\n".join(["failed:", *failed]))


if __name__ == "__main__":
    main()

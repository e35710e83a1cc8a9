#!/usr/bin/env python3
"""Times the reference renderer and Lucerna on the same scenes, in turns.

    benches/side_by_side.py                                      scenes/cornell-box.xml
    benches/side_by_side.py a.xml b.xml --spp 64 --rounds 7      scenes of one's own
    benches/side_by_side.py -D res=512 --csv out.csv --markdown out.md

Three contestants: `mitsuba` scalar_rgb, `mitsuba` llvm_ad_rgb and the `lucerna` program. They run one after
another, A B C A B C ..., so that a slow moment of the machine hits all of them; the table gives medians, and ratios
to Lucerna with the smallest and largest ratio of any round. Three times are told apart:

    render    steady state: the render call alone. `mitsuba` is timed inside a worker process after one warm-up
              (which compiles the llvm kernels); Lucerna reports its own (`--stats-json`).
    process   from the start of a fresh process to its end: start, load, compile, render, write the picture.
    start     the same with one sample per pixel: how long until a picture is there.

Beside the fresh processes stands the most memory they took at any time; it cannot be told if it is less than that of this
script, some 20 MiB.

All get the same samples per pixel, picture size and depth: whatever the scene or -D says. The picture means are
compared as well, since a fast wrong picture is worth nothing.
"""
import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "reference"))
import render as reference  # noqa: E402
import tables  # noqa: E402

WORKER = r"""
import json, sys, time
import mitsuba as mi
import numpy
variant, scene_file, spp, defines, threads, output = json.loads(sys.argv[1])
mi.set_log_level(mi.LogLevel.Error)
mi.set_variant(variant)
import drjit
if threads:
    drjit.set_thread_count(threads)
scene = mi.load_file(scene_file, **defines)
sensor = scene.sensors()[0]
width, height = sensor.film().crop_size()

def once(seed):
    start = time.perf_counter()
    image = numpy.array(mi.render(scene, spp=spp, seed=seed))
    return time.perf_counter() - start, image

def report(seconds, image):
    actual = sensor.sampler().sample_count()
    print(json.dumps({"render_seconds": seconds, "samples": int(width) * int(height) * int(actual),
                      "mean": float(image[..., :3].mean())}), flush=True)

if output:                       # whole process: render once, write, leave
    seconds, image = once(0)
    sensor.film().write(output)
    report(seconds, image)
else:                            # steady state: one render for each line read
    once(0)
    print("ready", flush=True)
    for line in sys.stdin:
        report(*once(int(line)))
"""


def fresh(command, name):
    """Runs a process: its seconds, the most memory it took in MiB, and its output."""
    with tempfile.TemporaryFile("w+") as output, tempfile.TemporaryFile("w+") as errors:
        start = time.perf_counter()
        process = subprocess.Popen([str(word) for word in command], stdin=subprocess.DEVNULL, stdout=output, stderr=errors)
        _, status, usage = os.wait4(process.pid, 0)
        seconds = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        errors.seek(0)
        if process.returncode != 0:
            raise SystemExit(f"{name} failed:\n{errors.read() or output.read()}")
        # Bytes on macOS, KiB elsewhere.
        return seconds, usage.ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10), output.read()


class Mitsuba:
    """A variant of the reference in a worker process that has loaded, compiled and warmed up."""

    def __init__(self, variant, python, scene, arguments):
        self.name, self.python, self.variant = f"mitsuba {variant}", python, variant
        self.scene, self.arguments = scene, arguments
        self.worker = subprocess.Popen(self.command(arguments.spp, None), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        if self.worker.stdout.readline().strip() != "ready":
            raise SystemExit(f"{self.name}: the worker did not start on {scene}")

    def command(self, spp, output):
        request = [self.variant, str(self.scene), spp, self.arguments.defines, self.arguments.threads, output]
        return [str(self.python), "-c", WORKER, json.dumps(request)]

    def steady(self, round_index):
        self.worker.stdin.write(f"{round_index + 1}\n")
        self.worker.stdin.flush()
        return json.loads(self.worker.stdout.readline())

    def process(self, folder, spp):
        seconds, mebibytes, output = fresh(self.command(spp, str(folder / "mitsuba.exr")), self.name)
        return seconds, mebibytes, json.loads(output.splitlines()[-1])

    def close(self):
        self.worker.stdin.close()
        self.worker.wait()


class Lucerna:
    """The program, started anew for each run; it reports the time of its render phase."""

    name = "lucerna"

    def __init__(self, program, scene, arguments):
        self.program, self.scene, self.arguments = program, scene, arguments
        self.folder = tempfile.TemporaryDirectory()

    def run(self, round_index, spp):
        folder = Path(self.folder.name)
        stats, image = folder / "stats.json", folder / "image.exr"
        command = [self.program, "render", self.scene, "-o", image, "--spp", spp, "--stats-json", stats, "--seed", round_index + 1]
        command += [f"-D{key}={value}" for key, value in self.arguments.defines.items()]
        command += ["--threads", self.arguments.threads] if self.arguments.threads else []
        seconds, mebibytes, _ = fresh(command, f"lucerna on {self.scene}")
        return seconds, mebibytes, dict(json.loads(stats.read_text()), image=str(image))

    def steady(self, round_index):
        return self.run(round_index, self.arguments.spp)[2]

    def process(self, _folder, spp):
        return self.run(-1, spp)

    def close(self):
        self.folder.cleanup()


def mean_of(python, image):
    """Mean of the colour channels of an EXR, read by the reference."""
    script = ("import sys, numpy, mitsuba as mi; mi.set_variant('scalar_rgb'); "
              "print(float(numpy.array(mi.Bitmap(sys.argv[1]))[..., :3].mean()))")
    return float(subprocess.run([str(python), "-c", script, image], check=True, capture_output=True, text=True).stdout)


def measure(scene, arguments, python):
    """Rows of one scene: contestant, kind of time, seconds and peak memory of each round, samples, picture mean."""
    contestants = [Mitsuba(variant, python, scene, arguments) for variant in arguments.variants]
    if arguments.lucerna.exists():
        contestants.append(Lucerna(arguments.lucerna, scene, arguments))
    else:
        print(f"{arguments.lucerna} does not exist: only the reference is timed", file=sys.stderr)
    kinds = {"process": arguments.spp, "start": 1}
    rows = {(c.name, kind): {"seconds": [], "mebibytes": [], "samples": 0, "mean": None}
            for kind in ("render", *kinds) for c in contestants}
    with tempfile.TemporaryDirectory() as folder:
        for round_index in range(arguments.rounds):
            for contestant in contestants:
                result = contestant.steady(round_index)
                row = rows[contestant.name, "render"]
                row["seconds"].append(result["render_seconds"])
                row["samples"], row["mean"] = result["samples"], result.get("mean", row["mean"])
                if "image" in result and round_index == arguments.rounds - 1:
                    row["mean"] = mean_of(python, result["image"])
        for _ in range(arguments.process_rounds):
            for kind, spp in kinds.items():
                for contestant in contestants:
                    seconds, mebibytes, result = contestant.process(Path(folder), spp)
                    row = rows[contestant.name, kind]
                    row["seconds"].append(seconds)
                    row["mebibytes"].append(mebibytes)
                    row["samples"] = result["samples"]
    for contestant in contestants:
        contestant.close()
    return rows


def summarise(scene, rows):
    """Table lines with medians in Msamples/s and ratios `lucerna / other` of the rates (above 1: Lucerna is faster)."""
    table = []
    for (name, kind), row in rows.items():
        if not row["seconds"]:
            continue
        rates = [row["samples"] / s / 1e6 for s in row["seconds"]]
        line = {"scene": scene.name, "kind": kind, "renderer": name, "rounds": len(rates),
                "seconds": statistics.median(row["seconds"]), "msamples_per_second": statistics.median(rates),
                "peak_mebibytes": max(row["mebibytes"], default=None), "mean": row["mean"], "ratio": None, "ratio_min": None, "ratio_max": None}
        ours = rows.get(("lucerna", kind))
        if ours and ours["seconds"] and name != "lucerna":
            ratios = [ours["samples"] / a / (row["samples"] / b) for a, b in zip(ours["seconds"], row["seconds"])]
            line.update(ratio=statistics.median(ratios), ratio_min=min(ratios), ratio_max=max(ratios))
        table.append(line)
    return table


def markdown(table, arguments):
    lines = [f"{arguments.spp} samples per pixel, {arguments.rounds} rounds, {os.cpu_count()} cores"
             + (f", {arguments.threads} threads" if arguments.threads else "") + ". Ratio: rate of Lucerna over that of the other (min to max).", "",
             "| scene | time | renderer | s | Msamples/s | peak MiB | picture mean | ratio |", "|---|---|---|--:|--:|--:|--:|---|"]
    for line in table:
        ratio = f"{line['ratio']:.2f} ({line['ratio_min']:.2f} to {line['ratio_max']:.2f})" if line["ratio"] else ""
        mean = f"{line['mean']:.5f}" if line["mean"] is not None else ""
        memory = f"{line['peak_mebibytes']:.0f}" if line["peak_mebibytes"] is not None else ""
        lines.append(f"| {line['scene']} | {line['kind']} | {line['renderer']} | {line['seconds']:.3f} | "
                     f"{line['msamples_per_second']:.2f} | {memory} | {mean} | {ratio} |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", type=Path, default=[ROOT / "scenes" / "cornell-box.xml"])
    parser.add_argument("--lucerna", type=Path, default=ROOT / "target" / "release" / "lucerna")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--process-rounds", type=int, default=3)
    parser.add_argument("--threads", type=int, default=0, help="threads of each renderer; 0: their own choice")
    parser.add_argument("--variants", nargs="+", default=["scalar_rgb", "llvm_ad_rgb"])
    parser.add_argument("-D", dest="define", action="append", default=[], metavar="NAME=VALUE")
    tables.add_arguments(parser)
    arguments = parser.parse_args()
    tables.check_arguments(arguments)
    arguments.defines = dict(pair.split("=", 1) for pair in arguments.define)

    python = reference.environment()
    table = []
    for scene in arguments.scenes:
        table += summarise(scene, measure(scene.resolve(), arguments, python))
    groups = {}
    for line in table:
        if line["ratio"]:
            row = (f"{line['scene']}, {line['kind']}", line["ratio"], line["ratio_min"], line["ratio_max"])
            groups.setdefault(f"to {line['renderer']}", []).append(row)
    title = f"Whole renders, {arguments.spp} samples per pixel"
    tables.report(arguments, markdown(table, arguments), table, title, groups)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Times the reference renderer and Lucerna on the same scenes, in turns.

    benches/side_by_side.py                                      scenes/cornell-box.xml
    benches/side_by_side.py a.xml b.xml --spp 64 --rounds 7      scenes of one's own
    benches/side_by_side.py -D res=512 --csv out.csv --markdown out.md

Three contestants: `mitsuba` scalar_rgb, `mitsuba` llvm_ad_rgb and the `lucerna` program. They run one after
another, A B C A B C ..., so that a slow moment of the machine hits all of them; the table gives medians, and ratios
to Lucerna with the smallest and largest ratio of any round. Two times are told apart:

    render    steady state: the render call alone. `mitsuba` is timed inside a worker process after one warm-up
              (which compiles the llvm kernels); Lucerna reports its own (`--stats-json`).
    process   from the start of a fresh process to its end: start, load, compile, render, write the picture.

All get the same samples per pixel, picture size and depth: whatever the scene or -D says. The picture means are
compared as well, since a fast wrong picture is worth nothing.
"""
import argparse
import csv
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


class Mitsuba:
    """A variant of the reference in a worker process that has loaded, compiled and warmed up."""

    def __init__(self, variant, python, scene, arguments):
        self.name, self.python, self.variant = f"mitsuba {variant}", python, variant
        self.scene, self.arguments = scene, arguments
        self.worker = subprocess.Popen(self.command(None), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        if self.worker.stdout.readline().strip() != "ready":
            raise SystemExit(f"{self.name}: the worker did not start on {scene}")

    def command(self, output):
        request = [self.variant, str(self.scene), self.arguments.spp, self.arguments.defines, self.arguments.threads, output]
        return [str(self.python), "-c", WORKER, json.dumps(request)]

    def steady(self, round_index):
        self.worker.stdin.write(f"{round_index + 1}\n")
        self.worker.stdin.flush()
        return json.loads(self.worker.stdout.readline())

    def process(self, folder):
        start = time.perf_counter()
        done = subprocess.run(self.command(str(folder / "mitsuba.exr")), check=True, capture_output=True, text=True)
        return time.perf_counter() - start, json.loads(done.stdout.splitlines()[-1])

    def close(self):
        self.worker.stdin.close()
        self.worker.wait()


class Lucerna:
    """The program, started anew for each run; it reports the time of its render phase."""

    name = "lucerna"

    def __init__(self, program, scene, arguments):
        self.program, self.scene, self.arguments = program, scene, arguments
        self.folder = tempfile.TemporaryDirectory()

    def run(self, round_index):
        folder = Path(self.folder.name)
        stats, image = folder / "stats.json", folder / "image.exr"
        command = [str(self.program), "render", str(self.scene), "-o", str(image), "--spp", str(self.arguments.spp),
                   "--stats-json", str(stats), "--seed", str(round_index + 1)]
        command += [f"-D{key}={value}" for key, value in self.arguments.defines.items()]
        command += ["--threads", str(self.arguments.threads)] if self.arguments.threads else []
        start = time.perf_counter()
        done = subprocess.run(command, capture_output=True, text=True)
        seconds = time.perf_counter() - start
        if done.returncode != 0:
            raise SystemExit(f"lucerna failed on {self.scene}:\n{done.stderr or done.stdout}")
        return seconds, dict(json.loads(stats.read_text()), image=str(image))

    def steady(self, round_index):
        return self.run(round_index)[1]

    def process(self, _folder):
        return self.run(-1)

    def close(self):
        self.folder.cleanup()


def mean_of(python, image):
    """Mean of the colour channels of an EXR, read by the reference."""
    script = ("import sys, numpy, mitsuba as mi; mi.set_variant('scalar_rgb'); "
              "print(float(numpy.array(mi.Bitmap(sys.argv[1]))[..., :3].mean()))")
    return float(subprocess.run([str(python), "-c", script, image], check=True, capture_output=True, text=True).stdout)


def measure(scene, arguments, python):
    """Rows of one scene: contestant, kind of time, seconds of each round, samples, picture mean."""
    contestants = [Mitsuba(variant, python, scene, arguments) for variant in arguments.variants]
    if arguments.lucerna.exists():
        contestants.append(Lucerna(arguments.lucerna, scene, arguments))
    else:
        print(f"{arguments.lucerna} does not exist: only the reference is timed", file=sys.stderr)
    rows = {(c.name, kind): {"seconds": [], "samples": 0, "mean": None} for c in contestants for kind in ("render", "process")}
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
            for contestant in contestants:
                seconds, result = contestant.process(Path(folder))
                row = rows[contestant.name, "process"]
                row["seconds"].append(seconds)
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
                "mean": row["mean"], "ratio": None, "ratio_min": None, "ratio_max": None}
        ours = rows.get(("lucerna", kind))
        if ours and ours["seconds"] and name != "lucerna":
            ratios = [ours["samples"] / a / (row["samples"] / b) for a, b in zip(ours["seconds"], row["seconds"])]
            line.update(ratio=statistics.median(ratios), ratio_min=min(ratios), ratio_max=max(ratios))
        table.append(line)
    return table


def markdown(table, arguments):
    lines = [f"{arguments.spp} samples per pixel, {arguments.rounds} rounds, {os.cpu_count()} cores"
             + (f", {arguments.threads} threads" if arguments.threads else "") + ". Ratio: rate of Lucerna over that of the other (min to max).", "",
             "| scene | time | renderer | s | Msamples/s | picture mean | ratio |", "|---|---|---|---|---|---|---|"]
    for line in table:
        ratio = f"{line['ratio']:.2f} ({line['ratio_min']:.2f} to {line['ratio_max']:.2f})" if line["ratio"] else ""
        mean = f"{line['mean']:.5f}" if line["mean"] is not None else ""
        lines.append(f"| {line['scene']} | {line['kind']} | {line['renderer']} | {line['seconds']:.3f} | "
                     f"{line['msamples_per_second']:.2f} | {mean} | {ratio} |")
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
    parser.add_argument("--csv", type=Path)
    parser.add_argument("--markdown", type=Path)
    arguments = parser.parse_args()
    arguments.defines = dict(pair.split("=", 1) for pair in arguments.define)

    python = reference.environment()
    table = []
    for scene in arguments.scenes:
        table += summarise(scene, measure(scene.resolve(), arguments, python))
    text = markdown(table, arguments)
    print(text, end="")
    if arguments.markdown:
        arguments.markdown.write_text(text)
    if arguments.csv:
        with arguments.csv.open("w", newline="") as file:
            writer = csv.DictWriter(file, fieldnames=table[0].keys())
            writer.writeheader()
            writer.writerows(table)


if __name__ == "__main__":
    main()

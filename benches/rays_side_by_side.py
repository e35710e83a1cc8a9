#!/usr/bin/env python3
"""Times single rays with Lucerna and with Embree on the same triangles, in turns.

    benches/rays_side_by_side.py                                 hills with boulders of 100 k, 1 M and 5 M triangles
    benches/rays_side_by_side.py --triangles 1000000 --rounds 15
    benches/rays_side_by_side.py --triangles -- a.xml b.xml      only the meshes and cameras of scenes
    benches/rays_side_by_side.py --threads 0 --csv out.csv --markdown out.md --plot out.png

It takes Embree 4 or 3 with its headers (Debian's package is libembree-dev) and a C++ compiler, for which CXX can name
another than c++. `benches/rays` writes a file with triangles and three sets of rays: of a pinhole camera, row by row
(primary); from the points they hit, in cosine-distributed directions (diffuse); and from these points to random ones of
the box around everything (shadow), for which it is only asked if they are blocked. Then three fresh processes read the
file in turns, A B C A B C ..., so that a slow moment of the machine hits all of them: Lucerna, Embree with default
flags, and Embree with RTC_SCENE_FLAG_ROBUST. Each builds its tree and traces each set a few times, one ray after the
other; the quickest time counts, as other programs can only slow a process down. The table gives medians over the rounds, and the
medians of the ratios within a round with the smallest and the largest.

Both must find the same: the numbers of hits may differ by 0.01 % of the rays, and sums of distances by 0.01 %, for the
edges between triangles that Embree's default flags do not close. Else the exit code is 1.
"""
import argparse
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import tables

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "benches" / "embree" / "rays.cpp"
TOLERANCE = 1e-4
LUCERNA, EMBREE, ROBUST = "lucerna", "embree", "embree robust"


def target():
    return Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))


def embree_program():
    """The C++ side, compiled if it is older than its source."""
    program = target() / "embree_rays"
    if program.exists() and program.stat().st_mtime > SOURCE.stat().st_mtime:
        return program
    program.parent.mkdir(parents=True, exist_ok=True)
    compiler = os.environ.get("CXX", "c++")
    for library in ("embree4", "embree3"):
        probe = [compiler, "-E", "-x", "c++", "-include", f"{library}/rtcore.h", "/dev/null"]
        if subprocess.run(probe, capture_output=True).returncode == 0:
            command = [compiler, "-std=c++17", "-O3", "-march=native", str(SOURCE), f"-l{library}", "-lpthread", "-o", str(program)]
            subprocess.run(command, check=True)
            return program
    sys.exit("no Embree with headers was found; on Debian and Ubuntu: apt-get install libembree-dev")


def run(command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{command[0]} failed: {done.stderr.strip() or done.stdout.strip()}")
    if done.stderr:
        print(done.stderr.strip(), file=sys.stderr)
    return done.stdout


def measure(contestants, rounds):
    """For each contestant its reports, one for each round."""
    reports = {name: [] for name in contestants}
    for number in range(rounds):
        # Every round starts with another, so that none always follows the same.
        names = list(contestants)
        for name in names[number % len(names):] + names[:number % len(names)]:
            reports[name].append(json.loads(run(contestants[name])))
    return reports


def disagreements(label, reports):
    """Where two contestants did not find the same."""
    ours = reports[LUCERNA][0]
    for name in (EMBREE, ROBUST):
        for a, b in zip(ours["sets"], reports[name][0]["sets"]):
            if abs(a["hits"] - b["hits"]) > TOLERANCE * a["rays"]:
                yield f"{label} {a['name']}: {a['hits']} hits, {name} {b['hits']}"
            if abs(a["sum_t"] - b["sum_t"]) > TOLERANCE * abs(a["sum_t"]):
                yield f"{label} {a['name']}: sum of distances {a['sum_t']}, {name} {b['sum_t']}"


def summarise(label, reports):
    """A row for the build and for each set of rays."""
    first = reports[LUCERNA][0]
    what = [("build", first["triangles"], lambda report: report["build_seconds"])]
    for number, rays in enumerate(first["sets"]):
        what.append((rays["name"], rays["rays"], lambda report, number=number: report["sets"][number]["seconds"]))
    for name, count, seconds in what:
        row = {"input": label, "triangles": first["triangles"], "what": name, "count": count}
        times = {contestant: [seconds(report) for report in of] for contestant, of in reports.items()}
        for contestant in (LUCERNA, EMBREE, ROBUST):
            row[f"{contestant} M/s"] = count / statistics.median(times[contestant]) / 1e6
        for other in (EMBREE, ROBUST):
            ratios = [b / a for a, b in zip(times[LUCERNA], times[other])]
            row[f"ratio to {other}"] = statistics.median(ratios)
            row[f"least ratio to {other}"], row[f"largest ratio to {other}"] = min(ratios), max(ratios)
        for number, report in enumerate(first["sets"]):
            if report["name"] == name:
                for contestant, of in reports.items():
                    row[f"{contestant} hits"] = of[0]["sets"][number]["hits"]
        yield {**row, **{f"{contestant} hits": row.get(f"{contestant} hits", "") for contestant in reports}}


def geometric_mean(values):
    return math.exp(statistics.fmean(math.log(value) for value in values))


def markdown(rows, versions, arguments):
    def ratio(row, other):
        median, least, largest = (row[f"{kind}ratio to {other}"] for kind in ("", "least ", "largest "))
        return f"{median:.2f} ({least:.2f} to {largest:.2f})"

    threads = "1 thread" if arguments.threads == 1 else f"{arguments.threads} threads"
    lines = [f"{' and '.join(versions)}, {threads}, {arguments.rounds} rounds, the quickest of {arguments.passes} passes in each. "
             "Millions of triangles or rays per second; ratios are Lucerna over Embree (least to largest).", "",
             "| input | what | lucerna | embree | robust | ratio | ratio to robust |", "|---|---|--:|--:|--:|---|---|"]
    for row in rows:
        rates = " | ".join(f"{row[f'{name} M/s']:.2f}" for name in (LUCERNA, EMBREE, ROBUST))
        lines.append(f"| {row['input']} | {row['what']} | {rates} | {ratio(row, EMBREE)} | {ratio(row, ROBUST)} |")
    for name, chosen in (("rays", lambda row: row["what"] != "build"), ("build", lambda row: row["what"] == "build")):
        means = [geometric_mean(row[f"ratio to {other}"] for row in rows if chosen(row)) for other in (EMBREE, ROBUST)]
        lines.append(f"| *geometric mean* | {name} | | | | {means[0]:.2f} | {means[1]:.2f} |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", type=Path)
    parser.add_argument("--triangles", nargs="*", type=int, default=[100_000, 1_000_000, 5_000_000])
    parser.add_argument("--pixels", type=int, default=1 << 18, help="camera rays, roughly")
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--passes", type=int, default=5)
    parser.add_argument("--threads", type=int, default=1, help="threads that build and trace; 0: all")
    tables.add_arguments(parser)
    arguments = parser.parse_args()
    if not arguments.triangles and not arguments.scenes:
        parser.error("nothing to time: give --triangles a number, or scenes")
    arguments.threads = arguments.threads or os.cpu_count()
    tables.check_arguments(arguments)

    embree = embree_program()
    subprocess.run(["cargo", "build", "--quiet", "--release", "--example", "rays"], cwd=ROOT, check=True)
    lucerna = target() / "release" / "examples" / "rays"
    inputs = [(f"{count / 1e6:g} M", ["--triangles", count]) for count in arguments.triangles]
    inputs += [(scene.stem if scene.stem not in ("scene", "scene_v3") else scene.resolve().parent.name, ["--scene", scene])
               for scene in arguments.scenes]

    rows, wrong, versions = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "rays"
        for label, options in inputs:
            run([lucerna, "write", file, "--pixels", arguments.pixels, *options])
            shared = ["--threads", arguments.threads, "--passes", arguments.passes]
            reports = measure({LUCERNA: [lucerna, "trace", file, *shared], EMBREE: [embree, file, *shared],
                               ROBUST: [embree, file, "--robust", *shared]}, arguments.rounds)
            rows += summarise(label, reports)
            wrong += disagreements(label, reports)
            versions = [reports[name][0]["tracer"] for name in (LUCERNA, EMBREE)]
    groups = {f"to {other}": [(f"{row['input']}, {row['what']}", *(row[f"{kind}ratio to {other}"] for kind in ("", "least ", "largest ")))
                              for row in rows] for other in (EMBREE, ROBUST)}
    title = f"Single rays, {' and '.join(versions)}, {arguments.threads} thread(s)"
    tables.report(arguments, markdown(rows, versions, arguments), rows, title, groups)
    for line in wrong:
        print(f"not the same: {line}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

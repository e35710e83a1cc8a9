#!/usr/bin/env python3
"""Makes the table and the plot of `benches/ablations.md` from the results of a comparison.

    lucerna compare SCENE -m benches/ablations.toml --size 96x54 --spp 128 --no-curves -o target/ablations
    benches/ablations.py target/ablations --plot benches/ablations.svg

Prints error and time as multiples of those of the baseline, and efficiency, 1/(relMSE · seconds), over that of the baseline
with its 95 % interval.
"""
import argparse
import json
from pathlib import Path

from tables import add_arguments, check_arguments, report


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="what `lucerna compare` was told to write to with -o")
    add_arguments(parser)
    arguments = parser.parse_args()
    check_arguments(arguments)
    (scene,) = json.loads((arguments.folder / "results.json").read_text())["scenes"]
    rows = []
    for method in scene["methods"]:
        point, against = method["points"][-1], method["budgets"][0]["against_baseline"]
        efficiency = against["efficiency_rel_mse"]
        rows.append({
            "method": method["name"],
            "error": point["rel_mse"]["value"],
            "time": point["seconds"]["value"],
            "efficiency": efficiency["value"],
            "low": efficiency["low"],
            "high": efficiency["high"],
        })
    base = next(row for row in rows if row["method"] == scene["baseline"])
    text = "| | error | time | efficiency |\n|---|---|---|---|\n"
    for row in rows:
        interval = "" if row is base else f" [{row['low']:.3g}, {row['high']:.3g}]"
        text += f"| {row['method']} | {row['error'] / base['error']:.2f} | {row['time'] / base['time']:.2f} "
        text += f"| {row['efficiency']:.3g}{interval} |\n"
    axis = f"efficiency over that of “{base['method']}”"
    bars = [(row["method"], row["efficiency"], row["low"], row["high"]) for row in rows if row is not base]
    report(arguments, text, rows, "/".join(Path(scene["scene"]).parts[-2:]), {"95 % interval": bars}, axis)


if __name__ == "__main__":
    main()

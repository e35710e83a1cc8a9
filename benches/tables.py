"""What the scripts that compare speeds share: tables as CSV, and ratios as a picture."""
import csv
import sys
from pathlib import Path

SPEED = "speed of Lucerna over that of the other"
NEEDED = "pictures need the Python package matplotlib: pip install matplotlib"


def add_arguments(parser):
    """Options for where results go."""
    parser.add_argument("--csv", type=Path, help="write every number")
    parser.add_argument("--markdown", type=Path, help="write the table that is printed")
    parser.add_argument("--plot", type=Path, help="write the ratios as a picture (needs the Python package matplotlib)")


def check_arguments(arguments):
    """Tells what is missing before minutes have passed."""
    if arguments.plot:
        try:
            import matplotlib  # noqa: F401
        except ImportError:
            sys.exit(NEEDED)


def report(arguments, text, rows, title, groups, axis=SPEED):
    """Prints the table `text`, and writes what the options ask for: it, the `rows` as CSV, and a picture of `groups`."""
    print(text, end="")
    if arguments.markdown:
        arguments.markdown.write_text(text)
    if arguments.csv:
        write_csv(arguments.csv, rows)
    if arguments.plot:
        plot_ratios(arguments.plot, title, groups, axis)


def write_csv(path, rows):
    """Dictionaries with the same keys."""
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)


def plot_ratios(path, title, groups, axis):
    """Ratios as dots with a line from least to largest.

    `groups` maps the name of a series to rows `(label, median, least, largest)`, the same labels for each.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    labels = list(dict.fromkeys(label for rows in groups.values() for label, *_ in rows))
    figure, axes = pyplot.subplots(figsize=(8, 1.5 + 0.4 * len(labels)), layout="constrained")
    for number, (name, rows) in enumerate(groups.items()):
        place = [labels.index(label) + 0.16 * (number - (len(groups) - 1) / 2) for label, *_ in rows]
        middle = [median for _, median, _, _ in rows]
        ends = [[median - least for _, median, least, _ in rows], [largest - median for _, median, _, largest in rows]]
        axes.errorbar(middle, place, xerr=ends, fmt="o", capsize=3, markersize=5, label=name)
    axes.axvline(1.0, color="black", linewidth=0.8)
    axes.set_xscale("log")
    least, largest = axes.get_xlim()
    round_ones = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 0.7, 1, 1.5, 2, 3, 5, 10, 20, 50)
    ticks = [t for t in round_ones if least <= t <= largest]
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    axes.minorticks_off()
    axes.set_yticks(range(len(labels)), labels)
    axes.set_ylim(len(labels) - 0.5, -0.5)
    axes.grid(axis="x", alpha=0.3)
    axes.set_xlabel(axis)
    axes.set_title(title, fontsize=10)
    axes.legend(loc="best", fontsize=8)
    figure.savefig(path, dpi=120)

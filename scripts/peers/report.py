#!/usr/bin/env python3
"""Makes the tables of bench_peers.sh from what both tracers printed.

Reads lines of `part TAB workload TAB threads TAB round TAB tracer TAB JSON`; a part is `frames`, `rays` or
`bounces`.
"""

import argparse
import csv
import json
import sys
from statistics import median



def same(value):
    return value, value


def bounced(ours, theirs, statistic):
    """Values of one kind of query of rayfarm and of another one of Embree."""
    return (lambda run: run[ours][statistic]), (lambda run: run[theirs][statistic])


# Measures of a part: name, unit, and the values in the JSON of rayfarm and of Embree.
MEASURES = {
    "frames": [("frame", "ms", same(lambda run: run["ms_per_frame"]["median"]))],
    "rays": [
        ("closest hit", "ns", same(lambda run: run["ns_per_ray"])),
        ("any hit", "ns", same(lambda run: run["ns_per_ray_any_hit"])),
    ],
    "bounces": [
        (f"{name}, {word}", "ns", bounced(ours, theirs, statistic))
        for word, statistic in (("median", "median_ns"), ("least", "min_ns"))
        for name, ours, theirs in (
            ("closest hit", "closest", "closest"),
            ("closest hits of sixteen", "closest_sixteen", "closest"),
            ("any hit", "any", "any"),
            ("any hits of sixteen", "any_sixteen", "any"),
        )
    ],
}


def read(path):
    """{(part, workload, threads): {round: {tracer: run}}}, in the order of the file."""
    groups = {}
    with open(path, encoding="utf-8") as file:
        for line in file:
            part, workload, threads, turn, tracer, run = line.rstrip("\n").split("\t", 5)
            groups.setdefault((part, workload, int(threads)), {}).setdefault(turn, {})[tracer] = json.loads(run)
    return groups


def rows(groups):
    """One row a workload, thread count and measure: medians over the rounds."""
    for (part, workload, threads), rounds in groups.items():
        whole = [runs for runs in rounds.values() if len(runs) == 2]
        if not whole:
            continue
        for name, unit, (our_value, their_value) in MEASURES[part]:
            ours = [our_value(runs["rayfarm"]) for runs in whole]
            theirs = [their_value(runs["embree"]) for runs in whole]
            ratios = sorted(a / b for a, b in zip(ours, theirs))
            yield {
                "part": part,
                "workload": workload,
                "measure": name,
                "unit": unit,
                "threads": threads,
                "rounds": len(whole),
                "rayfarm": round(median(ours), 3),
                "embree": round(median(theirs), 3),
                "ratio": round(median(ratios), 3),
                "ratio_min": round(ratios[0], 3),
                "ratio_max": round(ratios[-1], 3),
            }


def check_rays(groups):
    """Checks that both tracers traced the same rays and found the same hits."""
    wrong = []
    for (part, workload, _), rounds in groups.items():
        for runs in rounds.values():
            if part != "rays" or len(runs) != 2:
                continue
            for key in ("hits", "mean_t"):
                ours, theirs = runs["rayfarm"][key], runs["embree"][key]
                if abs(ours - theirs) > 1e-4 * max(abs(theirs), 1e-30):
                    wrong.append(f"{workload}: {key}: rayfarm {ours}, Embree {theirs}")
    return list(dict.fromkeys(wrong))


def print_table(table, part, unit):
    found = [row for row in table if row["part"] == part]
    if not found:
        return
    with_measure = part != "frames"
    head = ["workload", *(["measure"] if with_measure else []), "threads", f"rayfarm {unit}", f"Embree {unit}"]
    head += ["ratio", "lowest to highest"]
    print("\n| " + " | ".join(head) + " |\n| " + " | ".join("---" for _ in head) + " |")
    for row in found:
        cells = [row["workload"], *([row["measure"]] if with_measure else []), str(row["threads"])]
        cells += [f"{row['rayfarm']:.1f}", f"{row['embree']:.1f}", f"{row['ratio']:.2f}"]
        cells.append(f"{row['ratio_min']:.2f} to {row['ratio_max']:.2f}")
        print("| " + " | ".join(cells) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs")
    parser.add_argument("--csv", help="write the rows there as well")
    parser.add_argument("--note", action="append", default=[], help="KEY=VALUE: a column of the CSV")
    arguments = parser.parse_args()
    groups = read(arguments.runs)
    table = list(rows(groups))
    print_table(table, "frames", "ms")
    print_table(table, "rays", "ns")
    print_table(table, "bounces", "ns")
    if arguments.csv and table:
        notes = dict(note.split("=", 1) for note in arguments.note)
        with open(arguments.csv, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, [*table[0], *notes])
            writer.writeheader()
            writer.writerows({**row, **notes} for row in table)
    wrong = check_rays(groups)
    if wrong:
        sys.exit("report.py: the rays did not meet the same things:\n  " + "\n  ".join(wrong))


if __name__ == "__main__":
    main()

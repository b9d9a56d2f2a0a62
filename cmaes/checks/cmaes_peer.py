"""Compares the planner's CMA-ES with the package `cma` on standard functions.

    python3 -m venv venv && venv/bin/pip install cma
    cargo run --release -p cmaes --example cmaes_table > cmaes.csv
    venv/bin/python cmaes/checks/cmaes_peer.py cmaes.csv

Every line of the table is one run: function, dimensions, seed, population,
evaluations until the target, solved. The same runs are made with `cma`. Exit code 1 if
the median of the evaluations is above 1.1 times that of `cma`, or fewer runs are solved.
"""

import csv
import statistics
import sys
from collections import defaultdict

import cma
import numpy as np

TARGET = 1e-8
EVALUATIONS_MAX = 400_000
# Start of every search: mean of all coordinates and deviation.
START = {
    "sphere": (3.0, 1.0),
    "ellipsoid": (3.0, 1.0),
    "rosenbrock": (0.0, 0.5),
    "different powers": (3.0, 1.0),
    "rastrigin": (3.0, 2.0),
}


def values(name, x):
    """The function's values of the rows of `x`."""
    n = x.shape[1]
    part = np.arange(n) / (n - 1)
    if name == "sphere":
        return (x**2).sum(1)
    if name == "ellipsoid":
        return (1e6**part * x**2).sum(1)
    if name == "rosenbrock":
        return (100 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1 - x[:, :-1]) ** 2).sum(1)
    if name == "different powers":
        return (np.abs(x) ** (2 + 4 * part)).sum(1)
    return (x**2 - 10 * np.cos(2 * np.pi * x) + 10).sum(1)


def run(name, n, seed, population):
    """Evaluations until the target, and whether it was reached."""
    mean, deviation = START[name]
    spent = 0
    options = {
        "popsize": population,
        "seed": 1000 * seed + 1,
        "verbose": -9,
        "tolfun": 1e-12,
        "tolfunhist": 1e-12,
        "tolx": 1e-11,
    }
    search = cma.CMAEvolutionStrategy(n * [mean], deviation, options)
    while not search.stop():
        x = np.array(search.ask())
        f = values(name, x)
        spent += len(f)
        search.tell(list(x), list(f))
        if f.min() <= TARGET:
            return spent, True
        if spent >= EVALUATIONS_MAX:
            return spent, False
    return spent, False


def main():
    ours = defaultdict(list)
    with open(sys.argv[1], newline="") as file:
        for row in csv.DictReader(file):
            key = (row["function"], int(row["dimensions"]), int(row["population"]))
            ours[key].append((int(row["seed"]), int(row["evaluations"]), row["solved"] == "true"))
    short = False
    print("function, dimensions, population: median evaluations here, cma, ratio; solved here, cma")
    for (name, n, population), runs in ours.items():
        theirs = [run(name, n, seed, population) for seed, _, _ in runs]
        here = statistics.median([e for _, e, solved in runs if solved] or [EVALUATIONS_MAX])
        there = statistics.median([e for e, solved in theirs if solved] or [EVALUATIONS_MAX])
        solved = sum(s for _, _, s in runs), sum(s for _, s in theirs)
        ok = here <= 1.1 * there and solved[0] >= solved[1]
        short |= not ok
        print(
            f"{name}, {n}, {population}: {here:.0f} {there:.0f} {here / there:.3f};"
            f" {solved[0]} {solved[1]} of {len(runs)}{'' if ok else '  SHORT'}",
            flush=True,
        )
    sys.exit(short)


if __name__ == "__main__":
    main()

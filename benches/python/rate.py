"""Ropes per second of the Python package beside the simulator's own, in one run.

    cargo build --release -p planner --example batch_rate
    pip install dist/wag-*.whl          # by `maturin build`, see docs/src/python.md
    python benches/python/rate.py target/release/examples/batch_rate

Both simulate the same ropes through the same wiggle, in turns; the first turn of each is left
out. Of Python everything counts, also the release of what it made, which is not timed of the other.
"""

import argparse
import json
import statistics
import subprocess
import time

import numpy as np
import wag

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("native", help="planner's example batch_rate, built")
parser.add_argument("--ropes", type=int, default=4096)
parser.add_argument("--turns", type=int, default=15)
parser.add_argument("--threads", type=int, default=wag.simulation.THREADS)
parser.add_argument("--rate-hz", type=int, default=0, help="keep nodes at this rate")
given = parser.parse_args()

table = np.array([wag.Rope.random(seed).array() for seed in range(given.ropes)])
motion = wag.Motion.wiggle()


def by_python() -> float:
    begin = time.perf_counter()
    found = wag.simulate(
        table,
        motion,
        horizon_s=4.0,
        point_m=(0.9, 0.0, 0.1),
        precision="f32",
        rate_hz=given.rate_hz or None,
        threads=given.threads,
    )
    assert found.point is not None and len(found.point.distance_m) == given.ropes
    del found
    return time.perf_counter() - begin


with subprocess.Popen(
    [given.native, *map(str, (given.ropes, given.rate_hz, given.threads))],
    stdin=subprocess.PIPE,
    stdout=subprocess.PIPE,
    text=True,
) as native:

    def by_native() -> float:
        native.stdin.write("\n")
        native.stdin.flush()
        return float(native.stdout.readline())

    turns = [(by_python(), by_native()) for _ in range(given.turns + 1)][1:]
    native.stdin.close()

rates = [native_s / python_s for python_s, native_s in turns]
python_s, native_s = (statistics.median(column) for column in zip(*turns, strict=True))
print(
    json.dumps(
        {
            "ropes": given.ropes,
            "turns": given.turns,
            "python_ropes_per_s": given.ropes / python_s,
            "native_ropes_per_s": given.ropes / native_s,
            "rate_of_native_median": statistics.median(rates),
            "rate_of_native_quartiles": statistics.quantiles(rates, n=4)[::2],
        },
        indent=2,
    )
)

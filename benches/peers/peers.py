#!/usr/bin/env python3
"""Speed of MuJoCo, Drake and rope-sim on the same rope motions at equal tip accuracy.

  python peers.py [--cases A1-M3,A1-M4] [--ours FILE.json] [--json OUT.json]

`--ours` is the output of rope-sim's example `peer_speed` for the same cases; without it
the example is built and run. See README.md.
"""
import argparse
import dataclasses
import json
import math
import pathlib
import subprocess

import drake_rope
import mujoco_rope
import truth

BOUND_MM = 5.0
FIRST_STEP_S = 1e-4
SHORTEST_STEP_S = 2e-6
ACCURACIES = (1e-1, 1e-2, 1e-3, 1e-4)
REPEATS = 2
REPOSITORY = pathlib.Path(__file__).resolve().parents[2]


@dataclasses.dataclass
class Result:
    """One engine and scheme on one case, at its coarsest setting within the bound."""

    case: str
    engine: str
    scheme: str
    setting: str
    tip_error_mm: float
    simulated_s_per_cpu_s: float


def longest_step(simulate, error_mm):
    """Longest step (s) found within the bound; errors of first order schemes grow with the step.

    The next step is chosen from the last error, so the result lies a few per cent below
    the longest possible one.
    """
    step_s = FIRST_STEP_S
    while step_s > SHORTEST_STEP_S:
        tip_m, cpu_s = simulate(step_s)
        error = error_mm(tip_m)
        if error <= BOUND_MM:
            return step_s, error, cpu_s
        step_s *= min(0.7, 0.97 * BOUND_MM / error) if math.isfinite(error) else 0.3
    return None


def report(case, engine, scheme, setting, error, cpu_s):
    result = Result(case.id, engine, scheme, setting, error, case.duration_s / cpu_s)
    print("  ", result, flush=True)
    return result


def fixed_step(case, engine, scheme, simulate, error_mm):
    """Result of a scheme with a fixed step; the fastest of REPEATS runs counts."""
    found = longest_step(simulate, error_mm)
    if found is None:
        print(f"   {engine} {scheme}: above {BOUND_MM} mm at {SHORTEST_STEP_S} s", flush=True)
        return []
    step_s, error, cpu_s = found
    cpu_s = min([cpu_s] + [simulate(step_s)[1] for _ in range(REPEATS - 1)])
    return [report(case, engine, scheme, f"{1e6 * step_s:.1f} us", error, cpu_s)]


def of_mujoco(case):
    engine = f"MuJoCo {mujoco_rope.version()}"
    rows = []
    for scheme in mujoco_rope.SCHEMES:
        rows += fixed_step(case, engine, scheme, lambda h, s=scheme: mujoco_rope.simulate(case, s, h), case.error_mm)
    return rows


def of_drake(case, schemes=("radau3", "implicit_euler")):
    engine = f"Drake {drake_rope.version()}"
    own = dataclasses.replace(case, tip_m=drake_rope.converged_tip(case))
    print(f"   {engine}: its bushings' law moves the tip by {case.error_mm(own.tip_m):.1f} mm", flush=True)
    discrete = lambda h: drake_rope.simulate(case, drake_rope.DISCRETE, h)
    rows = fixed_step(case, engine, drake_rope.DISCRETE, discrete, own.error_mm)
    for scheme in schemes:
        for accuracy in ACCURACIES:
            tip_m, cpu_s = drake_rope.simulate(case, scheme, accuracy)
            error = own.error_mm(tip_m)
            if error <= BOUND_MM:
                rows.append(report(case, engine, scheme, f"accuracy {accuracy:g}", error, cpu_s))
                break
        else:
            print(f"   {engine} {scheme}: above {BOUND_MM} mm at accuracy {accuracy:g} ({error:.1f} mm)", flush=True)
    return rows


def of_ours(case_ids, path):
    """Rows of rope-sim: lanes full, and one rope alone."""
    if path is None:
        command = ["cargo", "run", "--release", "-q", "-p", "rope-sim", "--example", "peer_speed", "--", *case_ids]
        document = json.loads(subprocess.run(command, cwd=REPOSITORY, check=True, capture_output=True).stdout)
    else:
        document = json.loads(pathlib.Path(path).read_text())
    rows = []
    for row in document["rows"]:
        if row["case"] not in case_ids or row["step_s"] is None:
            continue
        engine, setting = f"rope-sim {document['version']}", f"{1e6 * row['step_s']:.0f} us"
        for what, key in ((f"{row['lanes']} ropes", "rope_s_per_cpu_s"), ("one rope", "one_rope_s_per_cpu_s")):
            rows.append(Result(row["case"], engine, f"{row['kernel']}, {what}", setting, row["tip_error_mm"], row[key]))
    return rows


def table(rows):
    """Markdown; the ratio is the fastest row of rope-sim over the row's figure."""
    lines = [
        "| case | engine | scheme | step or accuracy | tip error mm | simulated s per CPU s | rope-sim is faster by |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        best = max((r.simulated_s_per_cpu_s for r in rows if r.case == row.case and "rope-sim" in r.engine), default=None)
        ratio = "-" if best is None or "rope-sim" in row.engine else f"{best / row.simulated_s_per_cpu_s:.0f}"
        lines.append(
            f"| {row.case} | {row.engine} | {row.scheme} | {row.setting} | {row.tip_error_mm:.1f} "
            f"| {row.simulated_s_per_cpu_s:.3g} | {ratio} |"
        )
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", default="A1-M3,A5-M3,A1-M4")
    parser.add_argument("--ours", help="output of rope-sim's example peer_speed")
    parser.add_argument("--json", help="write the rows here too")
    options = parser.parse_args()
    case_ids = options.cases.split(",")
    cases = [truth.load(case_id) for case_id in case_ids]
    rows = of_ours(case_ids, options.ours)
    for case in cases:
        print(case.id, flush=True)
        rows += of_mujoco(case) + of_drake(case)
    rows.sort(key=lambda row: (case_ids.index(row.case), -row.simulated_s_per_cpu_s))
    if options.json:
        pathlib.Path(options.json).write_text(json.dumps([dataclasses.asdict(row) for row in rows], indent=1) + "\n")
    print(table(rows))


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Speed of MuJoCo, Drake and rope-sim on the same rope motions at equal tip accuracy.

  python peers.py [--cases A1-M3,A1-M4] [--json OUT.json] [--ours PROGRAM]

`--ours` is rope-sim's example `peer_speed`; without it the example is built. See README.md.
"""
import argparse
import dataclasses
import json
import math
import pathlib
import subprocess
import time

import drake_rope
import mujoco_rope
import truth

BOUND_MM = 5.0
FIRST_STEP_S = 1e-4
SHORTEST_STEP_S = 2e-6
RADAU_STEPS_PER_FRAME = (4, 6, 8, 12)
REPEATS = 2
BAR = 1000.0
ONE_ROPE = "one rope"
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


def repeated(case, engine, scheme, setting, error, cpu_s, run):
    """Result with the fastest of REPEATS runs, the first of which took `cpu_s`."""
    return report(case, engine, scheme, setting, error, min([cpu_s] + [run()[1] for _ in range(REPEATS - 1)]))


def of_first_order(case, engine, scheme, simulate):
    """Row of a scheme whose longest step is searched."""
    found = longest_step(simulate, case.error_mm)
    if found is None:
        print(f"   {engine} {scheme}: above {BOUND_MM} mm at {SHORTEST_STEP_S} s", flush=True)
        return []
    step_s, error, cpu_s = found
    setting = f"{1e6 * step_s:.1f} us"
    return [repeated(case, engine, scheme, setting, error, cpu_s, lambda: simulate(step_s))]


def of_third_order(case, engine, scheme, simulate, steps_s):
    """Row of the fastest of `steps_s` within the bound.

    Neither errors nor costs fall evenly: a step whose Newton iteration fails is taken in parts.
    """
    within = []
    for step_s in steps_s:
        tip_m, cpu_s = simulate(step_s)
        error = case.error_mm(tip_m)
        print(f"   {engine} {scheme}: {error:.1f} mm in {cpu_s:.1f} CPU s at {1e3 * step_s:.2f} ms", flush=True)
        if error <= BOUND_MM:
            within.append((cpu_s, step_s, error))
    if not within:
        return []
    cpu_s, step_s, error = min(within)
    return [repeated(case, engine, scheme, f"{1e3 * step_s:.2f} ms", error, cpu_s, lambda: simulate(step_s))]


def of_mujoco(case):
    engine = f"MuJoCo {mujoco_rope.version()}"
    rows = []
    for scheme in mujoco_rope.SCHEMES:
        rows += of_first_order(case, engine, scheme, lambda step_s, s=scheme: mujoco_rope.simulate(case, s, step_s))
    return rows


def of_drake(case):
    engine = f"Drake {drake_rope.version()}"
    run = lambda scheme: lambda step_s: drake_rope.simulate(case, scheme, step_s)
    rows = of_first_order(case, engine, drake_rope.DISCRETE, run(drake_rope.DISCRETE))
    steps_s = [1.0 / (case.frame_rate_hz * per_frame) for per_frame in RADAU_STEPS_PER_FRAME]
    return rows + of_third_order(case, engine, drake_rope.RADAU3, run(drake_rope.RADAU3), steps_s)


def build_ours():
    """Path of the example, freshly built."""
    command = ["cargo", "build", "--release", "-q", "-p", "rope-sim", "--example", "peer_speed", "--message-format=json"]
    lines = subprocess.run(command, cwd=REPOSITORY, check=True, capture_output=True, text=True).stdout.splitlines()
    built = [m["executable"] for m in map(json.loads, lines) if m.get("target", {}).get("name") == "peer_speed"]
    return next(path for path in built if path)


def of_ours(case, example):
    """Rows of rope-sim: every kernel with its lanes full, and with one rope alone."""
    document = json.loads(subprocess.run([example, case.id], check=True, capture_output=True).stdout)
    engine, rows = f"rope-sim {document['version']}", []
    for row in document["rows"]:
        if row["step_s"] is None:
            print(f"   {engine} {row['kernel']}: no step within {BOUND_MM} mm", flush=True)
            continue
        kinds = [(ONE_ROPE, "one_rope_s_per_cpu_s")]
        if row["lanes"] > 1:
            kinds.append((f"{row['ropes']} ropes", "rope_s_per_cpu_s"))
        for what, key in kinds:
            setting = f"{1e3 * row['step_s']:.2f} ms"
            rows.append(Result(case.id, engine, f"{row['kernel']}, {what}", setting, row["tip_error_mm"], row[key]))
    return rows


def faster(first, second):
    """Of two measurements of the same rows the faster of each."""
    return [max(pair, key=lambda row: row.simulated_s_per_cpu_s) for pair in zip(first, second)]


def best_of_ours(rows, case_id, alone):
    """Highest speed of rope-sim on a case, with one rope or with lanes full."""
    ours = [r for r in rows if r.case == case_id and "rope-sim" in r.engine and r.scheme.endswith(ONE_ROPE) == alone]
    return max((r.simulated_s_per_cpu_s for r in ours), default=math.nan)


def three_digits(value):
    """Rounded to three digits, without an exponent."""
    return f"{float(f'{value:.3g}'):.10g}"


def table(rows):
    """Markdown; each peer's row says by how much rope-sim's best rows are faster."""
    lines = [
        "| case | engine | scheme | step | tip error mm | simulated s per CPU s "
        "| rope-sim, lanes full, is faster by | rope-sim, one rope, is faster by |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        ratios = ["", ""]
        if "rope-sim" not in row.engine:
            ours = [best_of_ours(rows, row.case, alone) for alone in (False, True)]
            ratios = [three_digits(speed / row.simulated_s_per_cpu_s) for speed in ours]
        lines.append(
            f"| {row.case} | {row.engine} | {row.scheme} | {row.setting} | {row.tip_error_mm:.1f} "
            f"| {three_digits(row.simulated_s_per_cpu_s)} | {ratios[0]} | {ratios[1]} |"
        )
    return "\n".join(lines)


def verdicts(rows):
    """One line per case and peer: the ratio to the peer's fastest scheme against the bar."""
    lines = []
    fastest = {}
    for row in rows:
        if "rope-sim" not in row.engine:
            key = (row.case, row.engine)
            fastest[key] = max(fastest.get(key, 0.0), row.simulated_s_per_cpu_s)
    for (case_id, engine), speed in fastest.items():
        ratio = best_of_ours(rows, case_id, alone=False) / speed
        lines.append(f"{case_id}: {ratio:.0f} x {engine}, {'meets' if ratio >= BAR else 'misses'} {BAR:.0f} x")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", default="A1-M3,A1-M4")
    parser.add_argument("--json", help="write the rows here too")
    parser.add_argument("--ours", help="rope-sim's example peer_speed, built before")
    options = parser.parse_args()
    cases = [truth.load(case_id) for case_id in options.cases.split(",")]
    started_s = time.monotonic()
    example = options.ours or build_ours()
    rows = []
    for case in cases:
        print(case.id, flush=True)
        # Before and after the peers: the load of the machine changes.
        ours = of_ours(case, example)
        of_peers = of_mujoco(case) + of_drake(case)
        rows += sorted(faster(ours, of_ours(case, example)) + of_peers, key=lambda row: -row.simulated_s_per_cpu_s)
        if options.json:
            pathlib.Path(options.json).write_text(json.dumps([dataclasses.asdict(row) for row in rows], indent=1) + "\n")
    print(table(rows), verdicts(rows), f"took {time.monotonic() - started_s:.0f} s", sep="\n\n")


if __name__ == "__main__":
    main()

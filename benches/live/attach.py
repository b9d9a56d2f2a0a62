#!/usr/bin/env python3
"""What programs that look on cost the controller: demos in pairs, one of them looked on.

During one run of each pair, a program that looks on is started, let look for a moment and killed,
over and over; during the other there is none. Which comes first alternates. Cycles that the
controller missed are counted in the whole run and in the throw. With `--client`, one that looks on
counts when its client was told cycles and frames. Nothing else of this program may run meanwhile.

    python3 benches/live/attach.py --wag target/release/wag --pairs 5 --seed 1 \\
        --client wag/tests/live/foxglove.mjs -- --foxglove=127.0.0.1:0

Prints one line of JSON per run, and a summary. Python's standard library only.
"""

import argparse
import csv
import json
import pathlib
import subprocess
import sys
import tempfile
import time

# How long one without a client looks on before it is killed (s).
LOOK_S = 0.4
# Pause before the next (s).
PAUSE_S = 0.2


def look_on(wag, options, client):
    """One that looks on comes, is seen to work, and is killed; whether it was."""
    command = [wag, "watch", "--json", *options]
    watch = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    text = ""
    for line in watch.stdout:
        text += line
        if line == "}\n":
            break
    works = watch.poll() is None
    try:
        if client is not None:
            told = json.loads(text)["foxglove"]
            # A client is rarely on the machine that runs the arm.
            command = ["nice", "-n", "10", "node", client, told, "/controller/cycles", "/tf"]
            seen = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=5)
            works = seen.returncode == 0
        else:
            time.sleep(LOOK_S)
    except subprocess.TimeoutExpired:
        works = False
    watch.kill()
    watch.wait()
    return works


def missed_cycles(wag, run):
    """Missed cycles of the whole run, and how many there were."""
    subprocess.run([wag, "export", "csv", run, "--json"], check=True, stdout=subprocess.DEVNULL)
    with open(pathlib.Path(run) / "cycles.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    return sum(max(int(b["missed"]) - int(a["missed"]), 0) for a, b in zip(rows, rows[1:])), len(rows)


def run(wag, seed, options, client, folder, times):
    """One demo; `options` of those that look on, at most so many times, or none."""
    out = str(folder / "run")
    line = [wag, "demo", "--seed", str(seed), "--out", out, "--json"]
    demo = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    attached = 0
    while demo.poll() is None:
        if options is None or attached >= times:
            time.sleep(PAUSE_S)
            continue
        attached += look_on(wag, options, client)
        time.sleep(PAUSE_S)
    if demo.returncode != 0:
        return None
    summary = json.loads((folder / "run" / "summary.json").read_text())
    missed, cycles = missed_cycles(wag, out)
    return {
        "seed": seed,
        "attached": attached,
        "cycles": cycles,
        "missed": missed,
        "throw_missed": summary.get("latency", {}).get("missed"),
        "wake_p999_us": summary.get("latency", {}).get("wake", {}).get("p999_us"),
        "true_cm": 100 * summary.get("true_tip_target_distance_m", float("nan")),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wag", default="target/release/wag")
    parser.add_argument("--pairs", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1, help="of the first pair; the next has the next")
    parser.add_argument("--times", type=int, default=20, help="that one looks on in a run, at most")
    parser.add_argument("--client", help="script that connects to a socket for Foxglove, in Node.js")
    parser.add_argument("options", nargs="+", help="options of `wag watch`, after --")
    args = parser.parse_args()
    sums = {True: [0, 0, 0, 0], False: [0, 0, 0, 0]}
    for pair in range(args.pairs):
        for is_watched in (pair % 2 == 0, pair % 2 != 0):
            with tempfile.TemporaryDirectory() as folder:
                options = args.options if is_watched else None
                seen = run(args.wag, args.seed + pair, options, args.client, pathlib.Path(folder), args.times)
            print(json.dumps(seen), flush=True)
            if seen is None:
                sys.exit("a demo failed: this pair counts for nothing")
            sums[is_watched] = [
                a + b
                for a, b in zip(sums[is_watched], [seen["missed"], seen["cycles"], seen["throw_missed"] or 0, seen["attached"]])
            ]
    for is_watched, (missed, cycles, throw, attached) in sums.items():
        name = f"looked on, {attached} times" if is_watched else "alone"
        print(f"{name}: {missed} of {cycles} cycles missed, {throw} of them in throws", file=sys.stderr)


if __name__ == "__main__":
    main()

#!/usr/bin/python3
"""Prints the table of docs/choosing.md: on simulated sequences, what `choose` recommends, and the gain over linear
(geometric mean of the middle and the last frame) of that rule, of `adaptive` and of the best rule. Needs the data sets in
DATA.

  benchmarks/choose_table.py build/release/bin/halfgrad DATA
"""
import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile

from fem_table import SETS


def run(program, config, out, settings):
    arguments = [argument for setting in settings for argument in ("--set", setting)]
    subprocess.run([program, "run", config, "--out", out, *arguments, "--set", "/expect=[]", "--set",
                    '/outputs=["csv","json"]'], check=True, stdout=subprocess.DEVNULL)


def gains(out):
    """Of each rule: the geometric mean over the frames."""
    (table,) = pathlib.Path(out).glob("*.csv")
    result = {}
    for row in csv.DictReader(table.open()):
        if row["interpolant"] != "linear":
            key = (row["interpolant"], row["reconstructor"], json.dumps(json.loads(row["options"]), sort_keys=True))
            result.setdefault(key, []).append(float(row["gain_over_linear_all"]))
    return {key: (frames[0] * frames[1]) ** 0.5 for key, frames in result.items() if len(frames) == 2}


def key(rule):
    return rule["interpolant"], rule["reconstructor"], json.dumps(rule["options"], sort_keys=True)


def shown(key):
    interpolant, reconstructor, options = key
    options = json.loads(options)
    kind = "cubic" if options.get("drift") == "cubic" else options.get("patch", "")
    return f"`{interpolant}` {reconstructor} {kind}".strip()


def main():
    program, data = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    print("| set | held out | recommended | gains | adaptive | best | gains |")
    print("|---" * 7 + "|")
    attained, safe = [], []
    for folder, levels in SETS.items():
        for level in levels:
            base = data / folder
            common = [f"/mesh/file={base}/{level}.msh", f"/field/frames={base}/{level}_sampled.npy",
                      f"/field/select=[{5 if folder == 'bunny_shake' else 6},-1]"]
            with tempfile.TemporaryDirectory() as out:
                run(program, "configs/choose.json", out, common)
                (results,) = pathlib.Path(out).glob("*.json")
                recommendation = json.loads(results.read_text())["recommendation"]
            with tempfile.TemporaryDirectory() as out:
                run(program, "configs/fem_sequence_files.json", out,
                    [*common, f"/points/file={base}/surface.obj", f"/field/truth={base}/surface_truth.npy",
                     '/interpolants=["linear","phong","hermite","dual_taylor"]'])
                found = gains(out)
            chosen, always = (found[key(rule)] for rule in (recommendation, recommendation["safe"]))
            best = max(found, key=found.get)
            attained.append(chosen / found[best])
            safe.append(always / found[best])
            print(f"| {folder} {level} | {recommendation['points']} | {shown(key(recommendation))} | {chosen:.2f} | {always:.2f} | "
                  f"{shown(best)} | {found[best]:.2f} |", flush=True)
    for name, ratios in (("recommended", attained), ("adaptive", safe)):
        print(f"\n{name}: {math.prod(ratios) ** (1 / len(ratios)):.3f} of the best on average, {min(ratios):.2f} at least")


if __name__ == "__main__":
    main()

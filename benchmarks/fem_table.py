#!/usr/bin/python3
"""Prints the table of docs/adaptive.md: rms gain over linear of `phong` on simulated sequences, middle / last frame, and
how much `adaptive` keeps of the better of `chandrashekar_garg` and `kriging`. Needs the data sets in DATA.

  benchmarks/fem_table.py build/release/bin/halfgrad DATA
"""
import csv
import pathlib
import subprocess
import sys
import tempfile

SETS = {"cylinder_twist": ["tet_L0", "tet_L1"], "cylinder_stretch": ["tet_L0", "tet_L1"],
        "hexbar_twist": ["tet_L0", "hex_L0", "hex_L1", "wedge_L0", "mixed_L0"],
        "sheet_swirl": ["tri_L0", "tri_L1", "quad_L0"], "bunny_shake": ["tet_L0", "tet_L1"],
        "spot_shake": ["tet_L0", "tet_L1"]}
COLUMNS = ["unweighted_average", "volume_average", "inverse_distance", "chandrashekar_garg", "knn", "spr", "ppr",
           "kriging lean", "kriging wide", "kriging cubic", "adaptive"]


def gains(program, data, folder, level, out):
    """Of each rule in turn: the gains of the two frames."""
    middle = 5 if folder == "bunny_shake" else 6
    base = data / folder
    subprocess.run([program, "run", "configs/fem_sequence_files.json", "--out", out, "--set", f"/mesh/file={base}/{level}.msh",
                    "--set", f"/points/file={base}/surface.obj", "--set", f"/field/frames={base}/{level}_sampled.npy",
                    "--set", f"/field/truth={base}/surface_truth.npy", "--set", f"/field/select=[{middle},-1]",
                    "--set", '/interpolants=["linear","phong"]', "--set", "/expect=[]", "--set", '/outputs=["csv"]'],
                   check=True, stdout=subprocess.DEVNULL)
    (table,) = pathlib.Path(out).glob("*.csv")
    result = {name: [] for name in COLUMNS}
    for row in csv.DictReader(table.open()):
        if row["interpolant"] != "phong":
            continue
        name = row["reconstructor"]
        if name == "kriging":
            options = row["options"]
            name += " cubic" if "cubic" in options else " lean" if "lean" in options else " wide"
        result[name].append(float(row["gain_over_linear_all"]))
    return result


def main():
    program, data = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    print("| set | " + " | ".join(name.removesuffix("_average") for name in COLUMNS) + " | kept |")
    print("|---" * (len(COLUMNS) + 2) + "|")
    kept = []
    for folder, levels in SETS.items():
        for level in levels:
            with tempfile.TemporaryDirectory() as out:
                found = gains(program, data, folder, level, out)
            better = [max(pair) for pair in zip(found["chandrashekar_garg"], found["kriging wide"])]
            ratio = [a / b for a, b in zip(found["adaptive"], better)]
            kept += ratio
            cells = [" / ".join(f"{gain:.2f}" for gain in found[name]) for name in COLUMNS]
            print(f"| {folder} {level} | " + " | ".join(cells) + f" | {ratio[0]:.3f} / {ratio[1]:.3f} |", flush=True)
    mean = 1.0
    for ratio in kept:
        mean *= ratio ** (1 / len(kept))
    print(f"\nleast {min(kept):.3f}, geometric mean {mean:.3f}")


if __name__ == "__main__":
    main()

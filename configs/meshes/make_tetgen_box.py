#!/usr/bin/env python3
"""Makes tetgen_box.node and .ele, the unit cube meshed by TetGen (Debian: tetgen), beside this script."""
import pathlib
import subprocess
import tempfile

CORNERS = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
FACES = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]

folder = pathlib.Path(__file__).parent
with tempfile.TemporaryDirectory() as temporary:
    box = pathlib.Path(temporary) / "box.poly"
    lines = ["8 3 0 0"] + [f"{i} {x} {y} {z}" for i, (x, y, z) in enumerate(CORNERS)]
    lines += ["6 0"] + [f"1\n4 {a} {b} {c} {d}" for a, b, c, d in FACES] + ["0", "0"]
    box.write_text("\n".join(lines) + "\n")
    # Radius-edge ratio 1.4, cells of at most 0.00035: some thousand cells.
    subprocess.run(["tetgen", "-pq1.4a0.00035Q", box], check=True)
    for ending in ("node", "ele"):
        text = (box.parent / f"box.1.{ending}").read_text().split("\n")
        kept = [line for line in text if line and not line.startswith("#")]  # its comment names a temporary folder
        (folder / f"tetgen_box.{ending}").write_text("\n".join(kept) + "\n")

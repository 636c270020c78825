#!/usr/bin/env python3
"""Clough-Tocher interpolation (SciPy) beside halfgrad's rules, in the plane.

    halfgrad run CONFIG.json --out OUT     with "sequence" among its outputs
    benchmarks/clough_tocher.py OUT

Needs Debian's python3-scipy. SciPy triangulates the vertices itself (Delaunay) and estimates their gradients by a global
minimisation of the curvature; the points beyond its hull are left out.
"""
import json
import pathlib
import sys

import numpy
from scipy.interpolate import CloughTocher2DInterpolator

folder = pathlib.Path(sys.argv[1])
rest_vertices, vertices, rest_points, truth = (
    numpy.load(folder / "sequence" / f"{name}.npy") for name in ("rest_vertices", "vertices", "rest_points", "truth"))
if rest_vertices.shape[-1] != 2:
    sys.exit(f"{folder}: vertices of {rest_vertices.shape[-1]} coordinates; SciPy's Clough-Tocher is of the plane")
rows = json.loads((folder / "results.json").read_text())["rows"]
level = max(row["level"] for row in rows)
frames = sorted({row["frame"] for row in rows})
for number, (values, expected) in enumerate(zip(vertices, truth)):
    found = CloughTocher2DInterpolator(rest_vertices[0], values)(rest_points[0])
    errors = numpy.linalg.norm(found - expected, axis=1)
    served = numpy.isfinite(errors)
    print(f"frame {frames[number]}: Clough-Tocher rms {numpy.sqrt(numpy.mean(errors[served] ** 2)):.3e}"
          f", max {errors[served].max():.3e} ({served.sum()} of {len(errors)} points)")
    for row in rows:
        if row["level"] == level and row["frame"] == frames[number]:
            rule = " + ".join(filter(None, (row["interpolant"], row["reconstructor"])))
            print(f"  {rule} {json.dumps(row['options'])}: rms {row['error']['all']['rms']:.3e}"
                  f", max {row['error']['all']['max']:.3e}")

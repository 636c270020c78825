#!/usr/bin/env python3
"""Rolls a plane simulation into a curved surface, carries points with it, and prints rms errors (docs/surfaces.md).

rolled_sheet.py HALFGRAD SHEET_FOLDER: the folder holds NAME.msh (Gmsh 4.1 ASCII), NAME_sampled.npy, surface.obj and
surface_truth.npy of a sheet in the plane. Rest and deformed positions are rolled onto a cylinder around which the sheet
reaches 2 rad, points also a little inside it. Needs python3-numpy.
"""
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
work = pathlib.Path(tempfile.mkdtemp())


def read_msh(path):
    lines = path.read_text().split("\n")
    at = lines.index("$Nodes")
    positions = {}
    num_blocks, at = int(lines[at + 1].split()[0]), at + 2
    for _ in range(num_blocks):
        count = int(lines[at].split()[3])
        for k in range(count):
            positions[int(lines[at + 1 + k])] = [float(x) for x in lines[at + 1 + count + k].split()[:3]]
        at += 1 + 2 * count
    tags = sorted(positions)
    row = {tag: k for k, tag in enumerate(tags)}
    at = lines.index("$Elements")
    cells = []
    num_blocks, at = int(lines[at + 1].split()[0]), at + 2
    for _ in range(num_blocks):
        kind, count = (int(x) for x in lines[at].split()[2:])
        if kind in (2, 3):
            cells += [[row[int(tag)] for tag in line.split()[1:]] for line in lines[at + 1 : at + 1 + count]]
        at += 1 + count
    return np.array([positions[tag] for tag in tags]), cells


def deform(rest, frames, points, truth, options):
    out = work / "out.npy"
    subprocess.run(
        [program, "deform", "--quiet", "--outside", "nearest", "--rest", rest, "--frames", frames, "--points", points,
         "--out", out, *options],
        check=True,
    )
    found = np.load(out)
    found = found.reshape(-1, *found.shape[-2:])[-1]
    return np.sqrt(((found[:, : truth.shape[1]] - truth) ** 2).sum(1).mean())


surface = folder / "surface.obj"
flat_points = np.array([[float(x) for x in line.split()[1:4]] for line in surface.open() if line.startswith("v ")])
flat_truth = np.load(folder / "surface_truth.npy").astype(float)[-1][:, :2]
radius = np.ptp(flat_points[:, 0]) / 2


def roll(flat, offset=0.0):
    angle, r = flat[:, 0] / radius, radius - offset
    return np.stack([r * np.sin(angle), flat[:, 1], radius - r * np.cos(angle)], 1)


offset = 0.04 * radius
print(f"{'mesh':10} {'rule':28} {'plane':>10} {'rolled':>10} {'at %.3f' % offset:>10}")
for mesh in sorted(folder.glob("*_L?.msh")):
    name = mesh.stem
    rest, cells = read_msh(mesh)
    frames = folder / f"{name}_sampled.npy"
    with open(work / "cloth.obj", "w") as file:
        for x in roll(rest):
            file.write("v {!r} {!r} {!r}\n".format(*map(float, x)))
        for cell in cells:
            file.write("f " + " ".join(str(v + 1) for v in cell) + "\n")
    np.save(work / "cloth.npy", roll(np.load(frames)[-1]))
    for options in (["--interpolant", "linear"], ["--reconstructor", "chandrashekar_garg"],
                    ["--reconstructor", "kriging"], []):
        errors = [deform(mesh, frames, surface, flat_truth, options)]
        for distance in (0.0, offset):
            np.save(work / "points.npy", roll(flat_points, distance))
            errors.append(
                deform(work / "cloth.obj", work / "cloth.npy", work / "points.npy", roll(flat_truth, distance), options)
            )
        rule = options[-1] if options else "adaptive"
        print(f"{name:10} {rule:28} " + " ".join(f"{error:10.2e}" for error in errors), flush=True)

#!/usr/bin/python3
"""Draws docs/images/twisted_disc.svg: straight lines on a disc, carried by a coarse mesh that twists.

Run from the root of the repository after ./quickstart; needs python3-numpy.
"""
import pathlib
import subprocess
import tempfile

import numpy as np

PROGRAM = "build/release/bin/halfgrad"
PICTURE = pathlib.Path("docs/images/twisted_disc.svg")
RULES = [("linear", "chandrashekar_garg"), ("phong", "chandrashekar_garg"), ("phong", "kriging")]


def disc(num_rings, random):
    """Vertices and triangles of rings with 6, 12, 18, ... vertices; those inside are moved at random."""
    rings = [np.zeros((1, 2))]
    for k in range(1, num_rings + 1):
        angle = 2 * np.pi * (np.arange(6 * k) + 0.5 * (k % 2)) / (6 * k)
        ring = k / num_rings * np.column_stack([np.cos(angle), np.sin(angle)])
        if k < num_rings:
            ring += random.uniform(-0.22, 0.22, ring.shape) / num_rings
        rings.append(ring)
    first = np.cumsum([0] + [len(ring) for ring in rings])
    triangles = [[0, 1 + i, 1 + (i + 1) % 6] for i in range(6)]
    for k in range(1, num_rings):
        inner, outer = 6 * k, 6 * (k + 1)
        at = lambda ring, i: first[ring] + i % (6 * ring)
        # Advance on the ring whose next vertex has the smaller angle.
        i = j = 0
        shift_in, shift_out = 0.5 * (k % 2), 0.5 * ((k + 1) % 2)
        while i < inner or j < outer:
            if j == outer or (i < inner and (i + 1 + shift_in) / inner < (j + 1 + shift_out) / outer):
                triangles.append([at(k, i), at(k + 1, j), at(k, i + 1)])
                i += 1
            else:
                triangles.append([at(k, i), at(k + 1, j), at(k + 1, j + 1)])
                j += 1
    return np.vstack(rings), np.array(triangles)


def twist(points):
    angle = 2.4 * np.sum(points**2, axis=1) ** 0.5
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1]])


def lines(count, samples, radius):
    """Horizontal and vertical lines over the disc, as one array of points and their numbers a line."""
    points, numbers, total = [], [], 0
    for level in np.linspace(-0.9, 0.9, count) * radius:
        half = (radius**2 - level**2) ** 0.5
        along = np.linspace(-half, half, samples)
        for line in (np.column_stack([along, np.full(samples, level)]), np.column_stack([np.full(samples, level), along])):
            points.append(line)
            numbers.append(np.arange(total, total + samples))
            total += samples
    return np.vstack(points), numbers


def carry(folder, rule, reconstructor, mesh, points):
    vertices, triangles = mesh
    rest = folder / "rest.mesh"
    rows = [f"{float(x)!r} {float(y)!r} 0" for x, y in vertices]
    cells = [" ".join(str(v + 1) for v in triangle) + " 0" for triangle in triangles]
    rest.write_text("\n".join(["MeshVersionFormatted 2", "Dimension 2", "Vertices", str(len(rows))]
                              + rows + ["Triangles", str(len(cells))] + cells + ["End", ""]))
    np.save(folder / "frames.npy", twist(vertices)[None])
    np.save(folder / "points.npy", points)
    subprocess.run([PROGRAM, "deform", "--rest", rest, "--frames", folder / "frames.npy", "--points", folder / "points.npy",
                    "--out", folder / "out.npy", "--interpolant", rule, "--reconstructor", reconstructor, "--quiet"],
                   check=True)
    return np.load(folder / "out.npy")[0]


def panel(x, title, subtitle, deformed, numbers, mesh):
    vertices, triangles = mesh
    place = lambda p: f"{x + 120 + 105 * p[0]:.1f} {150 - 105 * p[1]:.1f}"
    moved = twist(vertices)
    svg = [f"<text x='{x + 120}' y='18' text-anchor='middle' font-weight='600'>{title}</text>",
           f"<text x='{x + 120}' y='36' text-anchor='middle' fill='#555'>{subtitle}</text>"]
    cells = " ".join("M" + " L".join(place(moved[v]) for v in triangle) + " z" for triangle in triangles)
    svg.append(f"<path d='{cells}' fill='none' stroke='#d0d0d0' stroke-width='0.7'/>")
    path = " ".join("M" + " L".join(place(deformed[n]) for n in number) for number in numbers)
    svg.append(f"<path d='{path}' fill='none' stroke='#0072B2' stroke-width='1.3'/>")
    return svg


def main():
    mesh = disc(4, np.random.default_rng(7))
    points, numbers = lines(13, 121, 0.96)
    truth = twist(points)
    panels = []
    with tempfile.TemporaryDirectory() as name:
        for i, (rule, reconstructor) in enumerate(RULES):
            deformed = carry(pathlib.Path(name), rule, reconstructor, mesh, points)
            rms = np.sqrt(np.mean(np.sum((deformed - truth) ** 2, axis=1)))
            title = rule if rule == "linear" else f"{rule}, {reconstructor}"
            print(f"{title}: rms error {rms:.5f}")
            panels += panel(245 * i, title, f"rms error {rms:.4f}", deformed, numbers, mesh)
    panels += panel(245 * len(RULES), "truth", "", truth, numbers, mesh)
    width = 245 * (len(RULES) + 1)
    PICTURE.write_text(f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width} 265' font-family='sans-serif' "
                       f"font-size='13'><rect width='100%' height='100%' fill='#fff'/>{''.join(panels)}</svg>\n")


if __name__ == "__main__":
    main()

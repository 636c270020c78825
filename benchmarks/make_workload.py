#!/usr/bin/python3
"""Writes a workload for halfgrad_bench: jittered Kuhn tetrahedra, points, one deformed frame. Needs python3-numpy.

  benchmarks/make_workload.py OUT.bin --cells 14 --points 35000 --kind surface
"""
import argparse
import itertools

import numpy as np


def kuhn(cells, random):
    """Vertices (unit cube, interior ones moved by up to a fifth of a cube) and tetrahedra, six a cube."""
    axes = [np.arange(cells + 1)] * 3
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = np.all((grid > 0) & (grid < cells), axis=1)
    vertices = (grid + inside[:, None] * random.uniform(-0.2, 0.2, grid.shape)) / cells
    corner = np.stack(np.meshgrid(*[np.arange(cells)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    stride = np.array([(cells + 1) ** 2, cells + 1, 1])
    tetrahedra = []
    for path in itertools.permutations(range(3)):
        at, nodes = corner.copy(), [corner @ stride]
        for axis in path:
            at[:, axis] += 1
            nodes.append(at @ stride)
        # Odd paths are turned over, so that every volume is positive.
        if sum(a > b for a, b in itertools.combinations(path, 2)) % 2:
            nodes[2], nodes[3] = nodes[3], nodes[2]
        tetrahedra.append(np.stack(nodes, axis=1))
    return vertices, np.concatenate(tetrahedra, axis=0).reshape(6, -1, 4).transpose(1, 0, 2).reshape(-1, 4)


def sphere(count):
    """Points of a sphere in the order of a spiral: neighbours in number are neighbours in space, as in a mesh."""
    height = 1 - 2 * (np.arange(count) + 0.5) / count
    angle = np.sqrt(count * np.pi) * np.arcsin(height)
    radius = np.sqrt(1 - height**2)
    return 0.5 + 0.45 * np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)


def deform(points):
    angle = 1.2 * points[:, 2]
    x, y = points[:, 0] - 0.5, points[:, 1] - 0.5
    bend = 0.3 * points[:, 2] ** 2
    return np.stack([np.cos(angle) * x - np.sin(angle) * y + bend, np.sin(angle) * x + np.cos(angle) * y, points[:, 2]],
                    axis=1)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--cells", type=int, default=14, help="cubes along each side, six tetrahedra each")
    parser.add_argument("--points", type=int, default=35000)
    parser.add_argument("--kind", choices=["surface", "random"], default="surface")
    options = parser.parse_args()
    random = np.random.default_rng(1)
    vertices, tetrahedra = kuhn(options.cells, random)
    points = sphere(options.points) if options.kind == "surface" else random.uniform(0, 1, (options.points, 3))
    with open(options.out, "wb") as file:
        file.write(b"TETPTS1\0")
        np.array([len(vertices), len(tetrahedra), len(points)], "<i8").tofile(file)
        vertices.astype("<f8").tofile(file)
        tetrahedra.astype("<i4").tofile(file)
        points.astype("<f8").tofile(file)
        deform(vertices).astype("<f8").tofile(file)
    print(f"{options.out}: {len(vertices)} vertices, {len(tetrahedra)} tetrahedra, {len(points)} points")


if __name__ == "__main__":
    main()

#!/usr/bin/python3
"""Normals and tangents carried through a bent and twisted ball: their angle to the exact ones, and their jump across
facets.

Run from the root of the repository after ./quickstart; needs python3-numpy. Prints the tables of docs/sequences.md.
"""
import pathlib
import subprocess
import tempfile

import numpy as np

PROGRAM = "build/release/bin/halfgrad"
MESH = "configs/meshes/ball.msh"
RULES = [("linear", "kriging"), ("phong", "chandrashekar_garg"), ("phong", "kriging"), ("phong", "adaptive")]


def read_msh(path):
    """Vertices and tetrahedra of a Gmsh 2.2 ASCII file."""
    lines = pathlib.Path(path).read_text().splitlines()
    first = lines.index("$Nodes")
    vertices = np.array([line.split()[1:] for line in lines[first + 2:lines.index("$EndNodes")]], float)
    elements = [line.split() for line in lines[lines.index("$Elements") + 2:lines.index("$EndElements")]]
    return vertices, np.array([words[-4:] for words in elements if words[1] == "4"], int) - 1


def deformation(x):
    """A twist about z by 1.2 per unit, then a bend of z to a circle of radius 1.2."""
    c, s, bend = np.cos(1.2 * x[:, 2]), np.sin(1.2 * x[:, 2]), 1.2
    p, q, angle = c * x[:, 0] - s * x[:, 1], s * x[:, 0] + c * x[:, 1], x[:, 2] / bend
    return np.column_stack([(bend + p) * np.cos(angle) - bend, q, (bend + p) * np.sin(angle)])


def unit(rows):
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def exact_gradient(x):
    step = 1e-6
    return np.stack([(deformation(x + step * e) - deformation(x - step * e)) / (2 * step) for e in np.eye(3)], axis=2)


def exact_normals(x, normals):
    columns = np.moveaxis(exact_gradient(x), 2, 0)
    cofactor = np.stack([np.cross(columns[1], columns[2]), np.cross(columns[2], columns[0]),
                         np.cross(columns[0], columns[1])], axis=2)
    return unit(np.einsum("pij,pj->pi", cofactor, normals))


def exact_tangents(x, tangents):
    return unit(np.einsum("pij,pj->pi", exact_gradient(x), tangents))


def sphere(radius, rings):
    """Points, triangles and texture coordinates (a face's corners in turn) of a sphere of latitude rings."""
    theta, phi = np.meshgrid(np.pi * (np.arange(rings) + 0.5) / rings, np.pi * np.arange(2 * rings) / rings,
                             indexing="ij")
    points = radius * np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], 2)
    a, b = np.meshgrid(np.arange(rings - 1), np.arange(2 * rings), indexing="ij")
    v00, v01 = a * 2 * rings + b, a * 2 * rings + (b + 1) % (2 * rings)
    v10, v11 = v00 + 2 * rings, v01 + 2 * rings
    faces = np.concatenate([np.stack([v00, v10, v11], 2).reshape(-1, 3), np.stack([v00, v11, v01], 2).reshape(-1, 3)])
    # u with the longitude, v upwards with the latitude; across the seam u goes on beyond 1.
    longitude, latitude = faces % (2 * rings), faces // (2 * rings)
    longitude = np.where(longitude < longitude.max(1, keepdims=True) - rings, longitude + 2 * rings, longitude)
    return points.reshape(-1, 3), faces, np.stack([longitude / (2 * rings), 1 - latitude / rings], 2)


def vertex_normals(points, faces):
    area = np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
    normals = np.zeros_like(points)
    for corner in range(3):
        np.add.at(normals, faces[:, corner], area)
    return unit(normals)


def vertex_tangents(points, faces, uv):
    """As halfgrad makes them from texture coordinates, where none are mirrored."""
    a, b = points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]]
    first, second = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    determinant = first[:, :1] * second[:, 1:] - first[:, 1:] * second[:, :1]
    along = unit((second[:, 1:] * a - first[:, 1:] * b) / determinant) * np.linalg.norm(np.cross(a, b), axis=1)[:, None]
    tangents = np.zeros_like(points)
    for corner in range(3):
        np.add.at(tangents, faces[:, corner], along)
    normals = vertex_normals(points, faces)
    return unit(tangents - np.sum(tangents * normals, axis=1, keepdims=True) * normals)


def write_obj(path, points, faces, uv):
    lines = ["v {} {} {}".format(*p) for p in points.tolist()] + ["vt {} {}".format(*t) for t in uv.reshape(-1, 2).tolist()]
    for number, face in enumerate((faces + 1).tolist()):
        lines.append("f " + " ".join(f"{v}/{3 * number + corner + 1}" for corner, v in enumerate(face)))
    path.write_text("\n".join(lines) + "\n")


def degrees(a, b):
    return np.degrees(2 * np.arcsin(np.clip(np.linalg.norm(a - b, axis=1) / 2, 0, 1)))


def inner_facets(tets):
    """Triples of vertices that two tetrahedra share."""
    triples = np.sort(tets[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3), axis=1)
    unique, count = np.unique(triples, axis=0, return_counts=True)
    return unique[count == 2]


def main():
    vertices, tets = read_msh(MESH)
    center, radius = vertices.mean(0), np.linalg.norm(vertices - vertices.mean(0), axis=1).max()
    points, faces, uv = sphere(0.8 * radius, 60)
    points += center
    # Two points, at a facet's either side, each with a small triangle whose normal is not the facet's.
    facets = inner_facets(tets)
    corners = vertices[facets]
    middle, across = corners.mean(1), np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    edge = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1, keepdims=True)
    sides = np.concatenate([middle + 1e-7 * edge * across, middle - 1e-7 * edge * across])
    # Both sides carry the same direction: that of the plane spanned by the facet's normal and its first edge.
    along = (corners[:, 1] - corners[:, 0]) / edge
    small = 1e-3 * np.concatenate([edge, edge])
    second, third = np.concatenate([along, along]), np.concatenate([across, -across])
    side_points = np.concatenate([sides, sides + small * second, sides + small * third])
    number = np.arange(len(sides))
    flip = number >= len(middle)
    side_faces = np.stack([number, np.where(flip, number + 2 * len(sides), number + len(sides)),
                           np.where(flip, number + len(sides), number + 2 * len(sides))], 1)
    # u grows across the facet, in the same direction on both sides.
    along_uv, across_uv = np.array([0.0, 1.0]), np.array([1.0, 0.0])
    side_uv = np.zeros((len(sides), 3, 2))
    side_uv[~flip, 1], side_uv[~flip, 2] = along_uv, across_uv
    side_uv[flip, 1], side_uv[flip, 2] = -across_uv, along_uv

    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        np.save(folder / "frames.npy", deformation(vertices)[None])
        write_obj(folder / "sphere.obj", points, faces, uv)
        write_obj(folder / "sides.obj", side_points, side_faces, side_uv)
        exact = {"normals": exact_normals(points, vertex_normals(points, faces)),
                 "tangents": exact_tangents(points, vertex_tangents(points, faces, uv))}

        def deform(name, rule, reconstructor, kind):
            out = folder / "out.npy"
            subprocess.run([PROGRAM, "deform", "--rest", MESH, "--frames", folder / "frames.npy", "--points",
                            folder / (name + ".obj"), "--out", out, "--interpolant", rule, "--reconstructor",
                            reconstructor, "--normals", kind, "--tangents", "--quiet"], check=True)
            return {"moved": np.load(out)[0], "normals": np.load(folder / "out.normals.npy")[0],
                    "tangents": np.load(folder / "out.tangents.npy")[0][:, :3]}

        rows = {"normals": [], "tangents": []}
        for rule, reconstructor in RULES:
            name = rule + (", `" + reconstructor + "`" if rule != "linear" else "")
            for kind in ["gradient", "smooth"]:
                if rule == "linear" and kind == "smooth":
                    continue
                carried, both = deform("sphere", rule, reconstructor, kind), deform("sides", rule, reconstructor, kind)
                for what in rows:
                    angle = degrees(carried[what], exact[what])
                    jump = degrees(both[what][:len(middle)], both[what][len(middle):len(sides)])
                    rows[what].append("| {} | `{}` | {:.2f} / {:.2f} | {:.2f} / {:.2f} |".format(
                        name, kind, np.sqrt((angle**2).mean()), angle.max(), np.sqrt((jump**2).mean()), jump.max()))
            moved = carried["moved"]
            for what, made in {"normals": vertex_normals(moved, faces),
                               "tangents": vertex_tangents(moved, faces, uv)}.items():
                angle = degrees(made, exact[what])
                rows[what].append("| {} | recomputed from the moved faces | {:.2f} / {:.2f} | |".format(
                    name, np.sqrt((angle**2).mean()), angle.max()))
        for what, lines in rows.items():
            print(f"| rule | {what} | angle to the exact {what[:-1]}, rms / max (degrees) | jump across a facet, rms / max |")
            print("|---|---|---|---|")
            print("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()

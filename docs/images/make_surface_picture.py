#!/usr/bin/python3
"""Draws a surface carried by a coarse mesh with linear interpolation, with phong, and as it truly moved.

    docs/images/make_surface_picture.py REST.msh FRAMES.npy SURFACE.obj TRUTH.npy OUT.png [--frame N] [--view X,Y,Z] [--up X,Y,Z]

Run from the root of the repository after ./quickstart; needs python3-numpy. FRAMES are the mesh's vertices, TRUTH the
surface's, frame by frame. The stripes are reflections of a striped room: where the surface has a crease, they break.
"""
import argparse
import pathlib
import struct
import subprocess
import tempfile
import zlib

import numpy as np

PROGRAM = "build/release/bin/halfgrad"


def read_triangles(path):
    triangles = []
    for line in path.read_text().splitlines():
        if line.startswith("f "):
            face = [int(word.split("/")[0]) - 1 for word in line.split()[1:]]
            triangles += [[face[0], face[i], face[i + 1]] for i in range(1, len(face) - 1)]
    return np.array(triangles)


def carried(arguments, interpolant):
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "out.npy"
        subprocess.run([PROGRAM, "deform", "--rest", arguments.rest, "--frames", arguments.frames, "--points", arguments.surface,
                        "--out", out, "--interpolant", interpolant, "--outside", "nearest", "--quiet"], check=True)
        return np.load(out)[arguments.frame]


def vertex_normals(vertices, triangles):
    corners = vertices[triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, triangles[:, k], area)
    lengths = np.linalg.norm(normals, axis=1)
    return normals / np.where(lengths > 0, lengths, 1)[:, None]


def camera(view, up):
    """Rows: right, up, towards the eye."""
    back = np.array(view) / np.linalg.norm(view)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back])


def shade(normals):
    """Colour of a glossy surface in a striped room, from unit normals in the camera's frame."""
    reflected = 2 * normals[:, 2:] * normals - [0, 0, 1]
    stripes = 0.5 + 0.5 * np.tanh(4 * np.sin(7 * reflected[:, 0] + 2.5 * reflected[:, 1]))
    light = np.array([-0.3, 0.4, 0.85])
    diffuse = 0.45 + 0.55 * np.clip(normals @ (light / np.linalg.norm(light)), 0, 1)
    base = np.array([0.20, 0.46, 0.71]) * (1 - stripes)[:, None] + np.array([0.93, 0.95, 0.97]) * stripes[:, None]
    return base * diffuse[:, None]


def rendered(vertices, triangles, frame, center, scale, width, height):
    """An image, height × width × 3, of the surface: a depth buffer at twice the size, averaged."""
    w, h = 2 * width, 2 * height
    at = (vertices - center) @ frame.T
    normals = vertex_normals(vertices, triangles) @ frame.T
    pixels = np.column_stack([w / 2 + at[:, 0] * 2 * scale, h / 2 - at[:, 1] * 2 * scale])
    depth = np.full((h, w), -np.inf)
    image = np.ones((h, w, 3))
    for triangle in triangles:
        p = pixels[triangle]
        low = np.maximum(np.floor(p.min(axis=0)).astype(int), 0)
        high = np.minimum(np.ceil(p.max(axis=0)).astype(int), [w - 1, h - 1])
        edge, other = p[1] - p[0], p[2] - p[0]
        area = edge[0] * other[1] - edge[1] * other[0]
        if np.any(low > high) or area == 0:
            continue
        x, y = np.meshgrid(np.arange(low[0], high[0] + 1) - p[0, 0], np.arange(low[1], high[1] + 1) - p[0, 1])
        b = (x * other[1] - y * other[0]) / area
        c = (edge[0] * y - edge[1] * x) / area
        a = 1 - b - c
        z = a * at[triangle[0], 2] + b * at[triangle[1], 2] + c * at[triangle[2], 2]
        window = np.s_[low[1]:high[1] + 1, low[0]:high[0] + 1]
        covered = (a >= 0) & (b >= 0) & (c >= 0) & (z > depth[window])
        if not covered.any():
            continue
        normal = sum(weight[covered][:, None] * normals[v] for weight, v in zip((a, b, c), triangle))
        depth[window][covered] = z[covered]
        image[window][covered] = shade(normal / np.linalg.norm(normal, axis=1)[:, None])
    return image.reshape(height, 2, width, 2, 3).mean(axis=(1, 3))


def write_png(path, image):
    pixels = np.clip(np.round(255 * image), 0, 255).astype(np.uint8)
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", pixels.shape[1], pixels.shape[0], 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def main():
    vector = lambda text: [float(word) for word in text.split(",")]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("rest", "frames", "surface", "truth", "out"):
        parser.add_argument(name, type=pathlib.Path)
    parser.add_argument("--frame", type=int, default=-1)
    parser.add_argument("--view", type=vector, default=[1, 1, 1], help="from the surface to the eye")
    parser.add_argument("--up", type=vector, default=[0, 0, 1])
    parser.add_argument("--size", type=int, default=300, help="height in pixels")
    arguments = parser.parse_args()

    triangles = read_triangles(arguments.surface)
    truth = np.load(arguments.truth)[arguments.frame]
    frame = camera(arguments.view, arguments.up)
    seen = truth @ frame.T
    extent = seen.max(axis=0) - seen.min(axis=0)
    center = 0.5 * (seen.max(axis=0) + seen.min(axis=0)) @ frame
    scale = 0.94 * arguments.size / extent[1]
    width = int(round(extent[0] * scale)) + 60
    panels = []
    for interpolant in ("linear", "phong", None):
        surface = truth if interpolant is None else carried(arguments, interpolant)
        if interpolant:
            rms = np.sqrt(np.mean(np.sum((surface - truth) ** 2, axis=1)))
            print(f"{interpolant}: rms error {rms:.3g}, {100 * rms / np.linalg.norm(extent):.3f} % of the diagonal")
        panels.append(rendered(surface, triangles, frame, center, scale, width, arguments.size))
    write_png(arguments.out, np.hstack(panels))


if __name__ == "__main__":
    main()

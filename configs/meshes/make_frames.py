#!/usr/bin/env python3
"""Makes ball_frames.npy, a ball that twists and bends in two frames (Debian: python3-numpy), for choose.json."""
import pathlib

import numpy as np


def vertices(path):
    lines = path.read_text().split("\n")
    first = lines.index("$Nodes") + 2
    return np.array([line.split()[1:] for line in lines[first : first + int(lines[first - 1])]], float)


def moved(rest, angle, curvature):
    """Twist about z by `angle` a unit length, then bend z to a circle."""
    c, s = np.cos(angle * rest[:, 2]), np.sin(angle * rest[:, 2])
    x, y = c * rest[:, 0] - s * rest[:, 1], s * rest[:, 0] + c * rest[:, 1]
    phi, radius = curvature * rest[:, 2], 1 / curvature + x
    return np.stack([radius * np.cos(phi) - 1 / curvature, y, radius * np.sin(phi)], 1)


folder = pathlib.Path(__file__).parent
rest = vertices(folder / "ball.msh")
frames = np.stack([moved(rest, 0.8 * t, 0.6 * t) for t in (1, 2)])
np.save(folder / "ball_frames.npy", frames.astype(np.float32))

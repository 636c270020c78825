#!/usr/bin/env python3
"""Makes the meshes of these configurations with Gmsh (Debian: python3-gmsh).

make_meshes.py [NAME...]   without names, all of MESHES; each is written beside this script as NAME.msh

Sizes are set by options and not by points of the geometry: what a version of Gmsh takes from those differs. The
numbers of vertices depend on the version too; the committed files come from Gmsh 4.8.0.
"""
import pathlib
import sys

import gmsh

# name: shape, wanted edge length, and for the ball and disc the radius
MESHES = {
    "ball": ("ball", 0.08, 0.5),
    "ball_fine": ("ball", 0.045, 0.5),
    "box": ("box", 0.11, None),
    "disc": ("disc", 0.055, 0.5),
    "disc_fine": ("disc", 0.0168, 0.5),
}


def make(name):
    shape, size, radius = MESHES[name]
    gmsh.model.add(name)
    if shape == "ball":
        gmsh.model.occ.addSphere(0, 0, 0, radius)
    elif shape == "box":
        gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    else:
        gmsh.model.occ.addDisk(0, 0, 0, radius, radius)
    gmsh.model.occ.synchronize()
    dimension = gmsh.model.getDimension()
    gmsh.option.setNumber("Mesh.Algorithm", 5)  # Delaunay: the default is so regular that averages gain from it
    gmsh.option.setNumber("Mesh.MeshSizeMin", size)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.model.mesh.generate(dimension)
    # Only the cells of the highest dimension are in a physical group, and only those are written.
    entities = [tag for _, tag in gmsh.model.getEntities(dimension)]
    gmsh.model.addPhysicalGroup(dimension, entities)
    gmsh.write(str(pathlib.Path(__file__).parent / f"{name}.msh"))
    gmsh.model.remove()


def main():
    names = sys.argv[1:] or list(MESHES)
    unknown = [name for name in names if name not in MESHES]
    if unknown:
        sys.exit(f"make_meshes.py: no mesh {unknown[0]}; known: {', '.join(MESHES)}")
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.MshFileVersion", 2.2)
    gmsh.option.setNumber("Mesh.RandomSeed", 1)
    for name in names:
        make(name)
    gmsh.finalize()


if __name__ == "__main__":
    main()

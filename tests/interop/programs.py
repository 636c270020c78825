#!/usr/bin/python3
"""Tries halfgrad with the programs it exchanges files with, as Debian 12 packages them.

    programs.py PROGRAM [--require] [numpy|vtk|meshio|gmsh|tetgen|opensubdiv|calculix|dolfinx|blender]...

Without names, those that are quick: numpy, vtk, meshio, gmsh, tetgen, opensubdiv. A program that is not installed is skipped, with --require
it is a failure. Leaves with status 77 (ctest: skipped) where all were skipped. docs/interoperation.md has the results.
"""
import importlib.util
import json
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
BALL = ROOT / "configs" / "meshes" / "ball.msh"
# The command "meshio" comes with the package meshio-tools; this does the same.
MESHIO = ("/usr/bin/python3", "-c", "import sys, meshio._cli; meshio._cli.main(sys.argv[1:])")


class Missing(Exception):
    pass


def need_module(name, package):
    if importlib.util.find_spec(name) is None:
        raise Missing(package)


def need_program(name, package):
    if shutil.which(name) is None:
        raise Missing(package)


def call(*words, **options):
    outcome = subprocess.run([str(word) for word in words], capture_output=True, text=True, **options)
    assert outcome.returncode == 0, f"{' '.join(map(str, words))}\n{outcome.stdout[-2000:]}{outcome.stderr[-2000:]}"
    return outcome.stdout


def halfgrad(*words):
    return call(PROGRAM, *words, "--quiet") if words[0] != "info" else json.loads(call(PROGRAM, *words, "--json"))


def bent(x, t):
    return x + t * np.column_stack([x[:, 1] ** 2, x[:, 0] * x[:, 2], x[:, 0] ** 2 - x[:, 1] ** 2])


def sphere(radius, count=400):
    """A closed surface: an OBJ's text and its vertices. Polygons of three and four corners."""
    rings, sides = count // 20, 20
    vertices = [[0, 0, radius]]
    for i in range(1, rings):
        turn = np.pi * i / rings
        vertices += [[radius * np.sin(turn) * np.cos(2 * np.pi * k / sides), radius * np.sin(turn) * np.sin(2 * np.pi * k / sides),
                      radius * np.cos(turn)] for k in range(sides)]
    vertices.append([0, 0, -radius])
    at = lambda i, k: 1 + i * sides + k % sides
    faces = [[0, at(0, k), at(0, k + 1)] for k in range(sides)]
    faces += [[at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)] for i in range(rings - 2) for k in range(sides)]
    faces += [[len(vertices) - 1, at(rings - 2, k + 1), at(rings - 2, k)] for k in range(sides)]
    text = "".join(f"v {' '.join(repr(float(c)) for c in v)}\n" for v in vertices)
    return text + "".join("f " + " ".join(str(v + 1) for v in f) + "\n" for f in faces), np.array(vertices), faces


def scene(folder):
    """A ball that bends with a sphere inside: rest, frames, surface; and the sphere's positions as halfgrad has them."""
    text, vertices, faces = sphere(0.4)
    (folder / "sphere.obj").write_text(text)
    # Gmsh 2.2, ASCII: a count, then a tag and coordinates a line.
    lines = BALL.read_text().split("$Nodes\n")[1].split("\n")
    nodes = np.array([line.split() for line in lines[1:1 + int(lines[0])]], float)
    rest = nodes[np.argsort(nodes[:, 0]), 1:]
    np.save(folder / "frames.npy", [bent(rest, t) for t in (0, 0.2, 0.4)])
    halfgrad("deform", "--rest", BALL, "--frames", folder / "frames.npy", "--points", folder / "sphere.obj", "--out", folder / "out.npy")
    return np.load(folder / "out.npy"), vertices, faces


def try_numpy(folder):
    out, _, _ = scene(folder)
    frames = np.load(folder / "frames.npy")
    for name, array in {"big-endian": frames.astype(">f8"), "Fortran order": np.asfortranarray(frames)}.items():
        np.save(folder / "other.npy", array)
        halfgrad("deform", "--rest", BALL, "--frames", folder / "other.npy", "--points", folder / "sphere.obj", "--out", folder / "again.npy")
        assert np.array_equal(np.load(folder / "again.npy"), out), name
    assert out.dtype == np.float64 and out.flags.c_contiguous
    # Points given as an array, and a result that comes back as points of the rest state: bit for bit.
    np.save(folder / "points.npy", out[0])
    halfgrad("deform", "--rest", BALL, "--frames", folder / "frames.npy", "--points", folder / "points.npy", "--out", folder / "same.npy",
             "--precision", "float")
    assert np.load(folder / "same.npy").dtype == np.float32
    return f"numpy {np.__version__}: both byte and storage orders, float32 and float64"


def try_vtk(folder):
    need_module("vtkmodules", "python3-vtk9")
    import vtkmodules.all as vtk
    from vtkmodules.util.numpy_support import vtk_to_numpy

    out, _, faces = scene(folder)
    halfgrad("deform", "--rest", BALL, "--frames", folder / "frames.npy", "--points", folder / "sphere.obj", "--out", folder / "s.pvd",
             "--normals", "--gradients")
    sets = xml.parse(folder / "s.pvd").getroot().findall(".//DataSet")
    assert len(sets) == len(out)
    for frame, entry in enumerate(sets):
        reader = vtk.vtkXMLPolyDataReader()
        reader.SetFileName(str(folder / entry.get("file")))
        reader.Update()
        data = reader.GetOutput()
        assert np.array_equal(vtk_to_numpy(data.GetPoints().GetData()), out[frame])
        assert data.GetNumberOfPolys() == len(faces)
        names = {data.GetPointData().GetArrayName(i) for i in range(data.GetPointData().GetNumberOfArrays())}
        assert {"normals", "gradients"} <= names, names

    call(PROGRAM, "run", ROOT / "configs" / "quickstart.json", "--reduced", "--out", folder / "run", "--set", '/outputs=["json","vtu"]', "--quiet")
    arrays = set()
    files = sorted((folder / "run").rglob("*.vt[up]"))
    for file in files:
        reader = vtk.vtkXMLUnstructuredGridReader() if file.suffix == ".vtu" else vtk.vtkXMLPolyDataReader()
        reader.SetFileName(str(file))
        reader.Update()
        data = reader.GetOutput()
        assert data.GetNumberOfPoints() > 0, file
        for i in range(data.GetPointData().GetNumberOfArrays()):
            arrays.add(data.GetPointData().GetArrayName(i))
            assert np.isfinite(vtk_to_numpy(data.GetPointData().GetArray(i))).all(), (file, data.GetPointData().GetArrayName(i))
    assert any("error" in name for name in arrays), arrays
    return (f"VTK {vtk.vtkVersion.GetVTKVersion()}: deform's .pvd has the points of .npy bit for bit, with faces, normals and gradients; "
            f"{len(files)} files of run with {', '.join(sorted(arrays))}")


def same_mesh(found, expected, elements):
    assert found["vertices"] == expected["vertices"] and found["cells"] == expected["cells"], found
    assert abs(found["volume"] / expected["volume"] - 1) < 1e-6, found
    assert {block["element"] for block in found["blocks"]} == set(elements), found["blocks"]


def try_meshio(folder):
    need_module("meshio", "python3-meshio")
    import meshio
    mesh = meshio.read(BALL)
    mesh = meshio.Mesh(mesh.points, [("tetra", mesh.cells_dict["tetra"])])
    expected = halfgrad("info", BALL)
    tried = {"a.vtu": "vtu", "a.vtk": "vtk", "b.vtk": "vtk42", "a.mesh": "medit", "a.msh": "gmsh", "b.msh": "gmsh22", "a.node": "tetgen"}
    for name, kind in tried.items():
        mesh.write(folder / name, file_format=kind)
        same_mesh(halfgrad("info", folder / name), expected, ["tetrahedron"])
    # And back: what halfgrad writes, meshio reads.
    out, _, _ = scene(folder)
    halfgrad("deform", "--rest", folder / "a.vtu", "--frames", folder / "frames.npy", "--points", folder / "sphere.obj", "--out",
             folder / "m.%04d.obj")
    assert np.abs(meshio.read(folder / "m.0002.obj").points - out[2]).max() < 1e-12
    # Other formats come through it.
    mesh.write(folder / "a.inp")
    call(*MESHIO, "convert", folder / "a.inp", folder / "c.vtu")
    same_mesh(halfgrad("info", folder / "c.vtu"), expected, ["tetrahedron"])
    return f"meshio {meshio.__version__}: writes {', '.join(tried.values())} that are read; reads the .obj sequence; converts Abaqus .inp"


def try_gmsh(folder):
    need_program("gmsh", "gmsh")
    box = folder / "box.geo"
    box.write_text('SetFactory("OpenCASCADE");\nBox(1) = {0, 0, 0, 2, 1, 1};\nMesh.MeshSizeMax = 0.3;\n')
    hexes = folder / "hexes.geo"
    hexes.write_text("Point(1) = {0, 0, 0};\nl[] = Extrude {2, 0, 0} { Point{1}; Layers{6}; };\n"
                     "s[] = Extrude {0, 1, 0} { Line{l[1]}; Layers{3}; Recombine; };\n"
                     "Extrude {0, 0, 1} { Surface{s[1]}; Layers{3}; Recombine; }\n")
    tried = []
    for geometry, element in ((box, "tetrahedron"), (hexes, "hexahedron")):
        for kind, name in (("msh41", "a.msh"), ("msh22", "b.msh"), ("vtk", "a.vtk"), ("mesh", "a.mesh")):
            for binary in ([], ["-bin"]) if kind != "mesh" else ([],):
                call("gmsh", "-3", geometry, "-format", kind, "-o", folder / name, *binary)
                found = halfgrad("info", folder / name)
                assert abs(found["volume"] - 2) < 1e-9 and {b["element"] for b in found["blocks"]} == {element}, (kind, found)
                tried.append(kind + (" binary" if binary else ""))
    version = subprocess.run(["gmsh", "--version"], capture_output=True, text=True)
    return f"Gmsh {(version.stdout + version.stderr).strip()}: tetrahedra and hexahedra as {', '.join(dict.fromkeys(tried))}"


def try_tetgen(folder):
    need_program("tetgen", "tetgen")
    corners = [[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    sides = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
    (folder / "cube.poly").write_text("8 3 0 0\n" + "".join(f"{i} {' '.join(map(str, c))}\n" for i, c in enumerate(corners))
                                      + "6 0\n" + "".join(f"1\n4 {' '.join(map(str, s))}\n" for s in sides) + "0\n0\n")
    call("tetgen", "-pqa0.01k", folder / "cube.poly")
    for name in ("cube.1.node", "cube.1.ele", "cube.1.vtk"):
        found = halfgrad("info", folder / name)
        assert abs(found["volume"] - 1) < 1e-9 and found["cells"] > 100, found
    return f"TetGen: .node/.ele and .vtk of {found['cells']} tetrahedra"


def try_calculix(folder):
    need_program("ccx", "calculix-ccx")
    need_module("meshio", "python3-meshio")
    import meshio
    # A cantilever of linear hexahedra, ten steps of load; the nodes' displacements are printed to the .dat file.
    n = (12, 3, 3)
    nodes = np.array([[i * 0.25, j / 3, k / 3] for k in range(n[2] + 1) for j in range(n[1] + 1) for i in range(n[0] + 1)])
    at = lambda i, j, k: i + (n[0] + 1) * (j + (n[1] + 1) * k)
    corner = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = np.array([[at(i + a, j + b, k + c) for a, b, c in corner] for k in range(n[2]) for j in range(n[1]) for i in range(n[0])])
    text = "*NODE, NSET=ALL\n" + "".join(f"{v + 1}, {x}, {y}, {z}\n" for v, (x, y, z) in enumerate(nodes))
    text += "*ELEMENT, TYPE=C3D8, ELSET=BODY\n" + "".join(f"{c + 1}, {', '.join(str(v + 1) for v in cell)}\n" for c, cell in enumerate(cells))
    mesh_text = text
    text += "*NSET, NSET=FIXED\n" + "".join(f"{v + 1},\n" for v in np.flatnonzero(nodes[:, 0] == 0))
    text += "*NSET, NSET=END\n" + "".join(f"{v + 1},\n" for v in np.flatnonzero(nodes[:, 0] == 3))
    text += ("*MATERIAL, NAME=RUBBER\n*ELASTIC\n1.0, 0.3\n*SOLID SECTION, ELSET=BODY, MATERIAL=RUBBER\n*BOUNDARY\nFIXED, 1, 3\n"
             "*STEP, NLGEOM\n*STATIC, DIRECT\n0.25, 1.0\n*CLOAD\nEND, 3, 0.0005\n*NODE PRINT, NSET=ALL\nU\n*NODE FILE\nU\n*END STEP\n")
    (folder / "beam.inp").write_text(text)
    call("ccx", "beam", cwd=folder)
    (folder / "mesh.inp").write_text(mesh_text)
    meshio.read(folder / "mesh.inp").write(folder / "beam.vtu")
    frames, lines = [nodes], (folder / "beam.dat").read_text().split("\n")
    for at_line, line in enumerate(lines):
        if line.strip().startswith("displacements"):
            table = np.array([[float(word) for word in row.split()] for row in lines[at_line + 2:at_line + 2 + len(nodes)]])
            frames.append(nodes + table[np.argsort(table[:, 0]), 1:])
    np.save(folder / "frames.npy", frames)
    points = np.random.default_rng(2).uniform([0, 0, 0], [3, 1, 1], (500, 3))
    np.save(folder / "points.npy", points)
    for rule in ("linear", "phong"):
        halfgrad("deform", "--rest", folder / "beam.vtu", "--frames", folder / "frames.npy", "--points", folder / "points.npy", "--out",
                 folder / f"{rule}.npy", "--interpolant", rule)
    linear, phong = np.load(folder / "linear.npy"), np.load(folder / "phong.npy")
    assert len(frames) >= 4 and np.abs(linear[0] - points).max() < 1e-12 and np.abs(phong[0] - points).max() < 1e-12
    bend = np.abs(frames[-1] - nodes).max()
    assert bend > 0.05 and np.abs(phong - linear).max() < 0.2 * bend
    return f"CalculiX (ccx): .inp through meshio, {len(frames)} frames from the .dat file; largest displacement {bend:.3g}"


def try_dolfinx(folder):
    need_module("dolfinx", "python3-dolfinx")
    code = """
import numpy as np, dolfinx, ufl
from mpi4py import MPI
from dolfinx import fem, io, mesh
box = mesh.create_unit_cube(MPI.COMM_WORLD, 4, 4, 4)
space = fem.VectorFunctionSpace(box, ("Lagrange", 1))
u = fem.Function(space)
u.name = "displacement"
with io.VTKFile(box.comm, "u.pvd", "w") as file:
    for step, t in enumerate((0.0, 0.2, 0.4)):
        u.interpolate(lambda x: np.stack([t * x[1] ** 2, t * x[0] * x[2], t * (x[0] ** 2 - x[1] ** 2)]))
        file.write_function(u, float(step))
print(dolfinx.__version__)
"""
    version = call("/usr/bin/python3", "-c", code, cwd=folder).strip()
    first = next(iter(sorted(folder.glob("u*.vtu"))))
    points = np.random.default_rng(2).uniform(0, 1, (500, 3))
    np.save(folder / "points.npy", points)
    halfgrad("deform", "--rest", first, "--frames", folder / "u.pvd", "--points", folder / "points.npy", "--out", folder / "out.npy",
             "--reconstructor", "kriging")
    error = max(np.abs(frame - bent(points, t)).max() for frame, t in zip(np.load(folder / "out.npy"), (0, 0.2, 0.4)))
    assert error < 1e-12, error
    return f"DOLFINx {version}: .pvd of displacements as frames, its first .vtu as rest mesh; a quadratic motion to {error:.1e}"


def try_opensubdiv(folder):
    need_program("c++", "g++")
    if not pathlib.Path("/usr/include/opensubdiv/far/stencilTable.h").exists():
        raise Missing("libosd-dev")
    call("c++", "-std=c++17", "-O1", pathlib.Path(__file__).parent / "opensubdiv_stencils.cpp", "-o", folder / "stencils", "-losdCPU")
    scene(folder)
    frames = np.load(folder / "frames.npy")
    worst = {"double": 0, "float": 0}
    for rule in ("linear", "phong", "hermite", "dual_taylor"):
        # The map's own reconstructor is kriging, with cubic drift for dual_taylor.
        given = [] if rule == "dual_taylor" else ["--reconstructor", "kriging"]
        halfgrad("deform", "--rest", BALL, "--frames", folder / "frames.npy", "--points", folder / "sphere.obj", "--out",
                 folder / "expected.npy", "--interpolant", rule, *given)
        halfgrad("export", "--rest", BALL, "--points", folder / "sphere.obj", "--out", folder / "map.npz", "--as", "stencils",
                 "--interpolant", rule)
        stencils = np.load(folder / "map.npz")
        for name in ("sizes", "offsets", "indices", "weights"):
            stencils[name].tofile(folder / f"{name}.bin")
        (folder / "counts.txt").write_text(str(stencils["num_control_vertices"]))
        for frame, expected in zip(frames, np.load(folder / "expected.npy")):
            frame.tofile(folder / "frame.bin")
            version = call(folder / "stencils", folder).strip()
            for precision, kind in (("double", np.float64), ("float", np.float32)):
                moved = np.fromfile(folder / f"{precision}.bin", kind).reshape(-1, 3)
                worst[precision] = max(worst[precision], np.abs(moved - expected).max())
    # Some hundred products of numbers near one.
    assert worst["double"] < 1e-14 and worst["float"] < 2e-6, worst
    return (f"{version}: stencils in a Far::StencilTable give deform's points of four rules to {worst['double']:.1e}, "
            f"by Osd::CpuEvaluator in single precision to {worst['float']:.1e}")


def try_blender(folder):
    need_program("blender", "blender")
    out, _, faces = scene(folder)
    halfgrad("deform", "--rest", BALL, "--frames", folder / "frames.npy", "--points", folder / "sphere.obj", "--out", folder / "s.pc2",
             "--precision", "float")
    np.save(folder / "vertices.npy", out[0])
    (folder / "faces.json").write_text(json.dumps(faces))
    (folder / "script.py").write_text("""
import bpy, json, sys
import numpy as np
folder = sys.argv[-1]
mesh = bpy.data.meshes.new("sphere")
mesh.from_pydata(np.load(folder + "/vertices.npy").tolist(), [], json.load(open(folder + "/faces.json")))
thing = bpy.data.objects.new("sphere", mesh)
bpy.context.collection.objects.link(thing)
cache = thing.modifiers.new("cache", "MESH_CACHE")
cache.cache_format = "PC2"
cache.filepath = folder + "/s.pc2"
cache.forward_axis, cache.up_axis = "POS_Y", "POS_Z"
frames = []
for frame in range(3):
    bpy.context.scene.frame_set(frame)
    moved = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    frames.append([list(vertex.co) for vertex in moved.vertices])
np.save(folder + "/blender.npy", frames)
""")
    call("blender", "-b", "--factory-startup", "--python-exit-code", "1", "-P", folder / "script.py", "--", folder)
    difference = np.abs(np.load(folder / "blender.npy") - out).max()
    assert difference < 1e-6, difference
    version = call("blender", "--version").split("\n")[0]
    worst, swapped = blender_tangents(folder)
    assert worst < 1 and swapped == 0, (worst, swapped)
    return (f"{version}: the Mesh Cache modifier shows the frames of .pc2 to {difference:.1e}; its tangents (MikkTSpace) and deform's "
            f"differ by {worst:.1f} degrees at most, in no sign")


def blender_tangents(folder):
    """Tangents of a wavy sheet whose texture is mirrored at x = 0: the greatest angle between Blender's and deform's, which are
    means over other weights, and the number of points where the handedness differs; but for points at the mirror."""
    n, half = 60, 0.3
    x, y = np.meshgrid(np.linspace(-half, half, n + 1), np.linspace(-half, half, n + 1))
    points = np.column_stack([x.ravel(), y.ravel(), 0.1 * np.sin(5 * x.ravel()) * np.cos(4 * y.ravel())])
    uv = np.column_stack([np.abs(points[:, 0]) + 0.3 * points[:, 1] ** 2, points[:, 1]])
    faces = [[v, v + 1, v + n + 2, v + n + 1] for j in range(n) for v in range(j * (n + 1), j * (n + 1) + n)]
    (folder / "sheet.obj").write_text(
        "".join(f"v {a!r} {b!r} {c!r}\n" for a, b, c in points.tolist()) + "".join(f"vt {a!r} {b!r}\n" for a, b in uv.tolist())
        + "".join("f " + " ".join(f"{v + 1}/{v + 1}" for v in face) + "\n" for face in faces))
    halfgrad("deform", "--rest", BALL, "--frames", folder / "frames.npy", "--last", "0", "--points", folder / "sheet.obj", "--out",
             folder / "sheet.npy", "--tangents")
    ours = np.load(folder / "sheet.tangents.npy")[0]
    np.savez(folder / "sheet.npz", points=points, uv=uv, faces=faces)
    (folder / "tangents.py").write_text("""
import bpy, sys
import numpy as np
folder = sys.argv[-1]
sheet = np.load(folder + "/sheet.npz")
mesh = bpy.data.meshes.new("sheet")
mesh.from_pydata(sheet["points"].tolist(), [], sheet["faces"].tolist())
layer = mesh.uv_layers.new(name="uv")
for loop in mesh.loops:
    layer.data[loop.index].uv = sheet["uv"][loop.vertex_index]
for polygon in mesh.polygons:
    polygon.use_smooth = True
mesh.calc_tangents(uvmap="uv")
np.save(folder + "/tangents.npy", [[loop.vertex_index, *loop.tangent, loop.bitangent_sign] for loop in mesh.loops])
""")
    call("blender", "-b", "--factory-startup", "--python-exit-code", "1", "-P", folder / "tangents.py", "--", folder)
    theirs = np.load(folder / "tangents.npy")
    corners = theirs[:, 0].astype(int)
    away = np.abs(points[corners, 0]) > 1e-9
    theirs, ours = theirs[away, 1:], ours[corners[away]]
    angle = np.degrees(2 * np.arcsin(np.linalg.norm(theirs[:, :3] - ours[:, :3], axis=1) / 2))
    return angle.max(), int(np.sum(theirs[:, 3] != ours[:, 3]))


def main(names):
    required = "--require" in names
    names = [name for name in names if name != "--require"] or ["numpy", "vtk", "meshio", "gmsh", "tetgen", "opensubdiv"]
    results = []
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            try:
                print("ok      ", globals()["try_" + name](pathlib.Path(folder)), flush=True)
                results.append(True)
            except Missing as package:
                print(f"skipped  {name}: {package} is not installed", flush=True)
                results.append(not required and None)
    sys.exit(1 if False in results else 0 if True in results else 77)


PROGRAM = pathlib.Path(sys.argv[1]).resolve()
if __name__ == "__main__":
    main(sys.argv[2:])

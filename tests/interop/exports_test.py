#!/usr/bin/python3
"""What `halfgrad export` writes, loaded by NumPy and SciPy, gives what `halfgrad deform` computes.

    exports_test.py PROGRAM

Leaves with status 77 (ctest: skipped) where SciPy is absent.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

try:
    import numpy as np
    import scipy.io
    import scipy.sparse
except ImportError as missing:
    print(f"skipped: {missing}; install python3-scipy")
    sys.exit(77)

PROGRAM = sys.argv[1]


def run(*words, status=0):
    outcome = subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True)
    assert outcome.returncode == status, f"status {outcome.returncode} of {words}:\n{outcome.stderr}"
    return outcome.stderr


def lattice(n, seed):
    """A jittered lattice of unit size: vertices, and cubes in the node order of MEDIT and VTK."""
    at = lambda i, j, k: i + (n + 1) * (j + (n + 1) * k)
    vertices = np.array([[i, j, k] for k in range(n + 1) for j in range(n + 1) for i in range(n + 1)]) / n
    inner = np.all((vertices > 0) & (vertices < 1), axis=1)
    vertices[inner] += np.random.default_rng(seed).uniform(-0.2, 0.2, (inner.sum(), 3)) / n
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cubes = [[at(i + a, j + b, k + c) for a, b, c in corners] for k in range(n) for j in range(n) for i in range(n)]
    return vertices, np.array(cubes)


def write_medit(path, dimension, vertices, section, cells):
    lines = ["MeshVersionFormatted 2", f"Dimension {dimension}", "Vertices", str(len(vertices))]
    lines += [" ".join(repr(float(x)) for x in vertex) + " 0" for vertex in vertices]
    lines += [section, str(len(cells))] + [" ".join(str(v + 1) for v in cell) + " 0" for cell in cells]
    path.write_text("\n".join(lines + ["End", ""]))


def write_scenes(folder):
    """Three rest meshes with frames: name -> (rest, frames, points)."""
    random = np.random.default_rng(5)
    scenes = {}
    vertices, cubes = lattice(4, 3)
    tetrahedra = [cube[list(c)] for cube in cubes for c in
                  [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]]
    bend = lambda x, t: x + t * np.column_stack([np.sin(2 * x[:, 1]), x[:, 0] ** 2 - x[:, 2] ** 2, x[:, 0] * x[:, 1] ** 2])
    points = random.uniform(0, 1, (300, 3))
    for name, section, cells in [("tetrahedra", "Tetrahedra", tetrahedra), ("hexahedra", "Hexahedra", cubes)]:
        write_medit(folder / f"{name}.mesh", 3, vertices, section, cells)
        np.save(folder / f"{name}.npy", np.stack([bend(vertices, t) for t in (0, 0.2, 0.5, 0.7)]))
        np.save(folder / f"{name}.points.npy", points)
        scenes[name] = (vertices, points)
    # A sheet that leaves its plane: the frames have three coordinates, the mesh two.
    n = 6
    plane = np.array([[i, j] for j in range(n + 1) for i in range(n + 1)]) / n
    quads = [[v, v + 1, v + n + 2, v + n + 1] for j in range(n) for v in range(j * (n + 1), j * (n + 1) + n)]
    write_medit(folder / "sheet.mesh", 2, plane, "Quadrilaterals", quads)
    lift = lambda x, t: np.column_stack([x, t * np.sin(3 * x[:, 0]) * x[:, 1]])
    np.save(folder / "sheet.npy", np.stack([lift(plane, t) for t in (0, 0.2, 0.5, 0.7)]))
    np.save(folder / "sheet.points.npy", random.uniform(0, 1, (300, 2)))
    scenes["sheet"] = (plane, np.load(folder / "sheet.points.npy"))
    return scenes


def main(folder):
    scenes = write_scenes(folder)
    out = folder / "out.npy"

    def deformed(scene, *options):
        run("deform", "--rest", folder / f"{scene}.mesh", "--frames", folder / f"{scene}.npy", "--points",
            folder / f"{scene}.points.npy", "--out", out, "--quiet", *options)
        return np.load(out)

    def exported(scene, name, *options, status=0):
        path = folder / name
        error = run("export", "--rest", folder / f"{scene}.mesh", "--points", folder / f"{scene}.points.npy", "--out",
                    path, "--quiet", *options, status=status)
        return path if status == 0 else error

    for scene, (rest, points) in scenes.items():
        frames = np.load(folder / f"{scene}.npy")
        rules = [["--interpolant", name] for name in ("linear", "phong", "hermite")] + [["--alpha", "0.2"]]
        if scene != "hexahedra":
            rules.append(["--interpolant", "dual_taylor"])
        for rule in rules:
            reconstructor = [] if "dual_taylor" in rule else ["--reconstructor", "kriging"]
            expected = deformed(scene, *rule, *reconstructor)
            # Round-off of some hundred products of numbers near one.
            same = lambda result, tolerance=1e-12: np.abs(result - expected).max() < tolerance
            npz = exported(scene, "map.npz", *rule)
            matrix = scipy.sparse.load_npz(npz)
            assert matrix.shape == (len(points), len(rest)) and matrix.dtype == np.float64
            assert matrix.has_canonical_format
            assert same(np.stack([matrix @ frame for frame in frames])), (scene, rule)
            assert np.abs(matrix.sum(axis=1) - 1).max() < 1e-12
            assert np.abs(matrix @ rest - points).max() < 1e-12

            first = npz.read_bytes()
            assert exported(scene, "map.npz", *rule).read_bytes() == first, "the same map, other bytes"
            single = scipy.sparse.load_npz(exported(scene, "map.npz", *rule, "--precision", "float"))
            assert single.dtype == np.float32 and abs(single - matrix).max() < 1e-6
            market = scipy.io.mmread(exported(scene, "map.mtx", *rule)).tocsr()
            assert (market != matrix).nnz == 0, "Matrix Market lost digits"
            transpose = scipy.sparse.load_npz(exported(scene, "map.npz", *rule, "--transpose"))
            assert (transpose != matrix.T.tocsr()).nnz == 0
            # Virtual work: forces on points, carried to the vertices, do the same work on every motion.
            force = np.random.default_rng(1).normal(size=expected[0].shape)
            assert np.isclose(np.sum(force * expected[2]), np.sum((transpose @ force) * frames[2]), rtol=1e-12)

            stencils = np.load(exported(scene, "map.npz", *rule, "--as", "stencils"))
            assert stencils["num_control_vertices"] == len(rest)
            assert np.array_equal(stencils["offsets"], np.cumsum(stencils["sizes"]) - stencils["sizes"])
            products = stencils["weights"][:, None] * frames[1][stencils["indices"]]
            assert np.abs(np.add.reduceat(products, stencils["offsets"]) - expected[1]).max() < 1e-12

        for rule in (["--interpolant", "linear"], ["--interpolant", "phong"], ["--alpha", "0.2"]):
            for reconstructor in ("kriging", "adaptive"):
                options = [*rule, "--reconstructor", reconstructor]
                expected = deformed(scene, *options, "--first", "1", "--step", "2")
                manifest = json.loads(exported(scene, "bones.json", *options, "--frames", folder / f"{scene}.npy",
                                               "--first", "1", "--step", "2").read_text())
                array = {}
                for name, entry in manifest["arrays"].items():
                    array[name] = np.load(folder / entry["file"])
                    assert list(array[name].shape) == entry["shape"] and array[name].dtype == entry["type"], name
                assert array["transforms"].shape[0] == 2
                assert np.array_equal(array["rest"], rest[array["vertices"]])
                assert np.array_equal(array["points"], points)
                assert np.abs(array["weights"].sum(axis=1) - 1).max() < 1e-12
                homogeneous = np.column_stack([points, np.ones(len(points))])
                moved = np.einsum("pk,fpkij,pj->fpi", array["weights"], array["transforms"][:, array["indices"]],
                                  homogeneous)
                assert np.abs(moved - expected).max() < 1e-12, (scene, options)
        assert "transforms" not in json.loads(exported(scene, "bones.json").read_text())["arrays"]

    # A grid without cells of its own, mapped by centered differences.
    planes = [np.linspace(0, 1.5, 4), np.linspace(0, 2, 3), np.linspace(0, 2, 3)]
    rest = np.array([[x, y, z] for z in planes[2] for y in planes[1] for x in planes[0]])
    (folder / "grid.vti").write_text(
        '<VTKFile type="ImageData"><ImageData WholeExtent="0 3 0 2 0 2" Origin="0 0 0" Spacing="0.5 1 1">'
        '<Piece Extent="0 3 0 2 0 2"/></ImageData></VTKFile>')
    np.save(folder / "grid.npy", np.stack([rest + t * rest[:, [1, 2, 0]] ** 2 for t in (0, 0.3)]))
    np.save(folder / "grid.points.npy", np.random.default_rng(2).uniform(0, 1.5, (200, 3)))
    common = ["--rest", folder / "grid.vti", "--points", folder / "grid.points.npy", "--quiet"]
    run("deform", *common, "--frames", folder / "grid.npy", "--out", out)
    run("export", *common, "--reconstructor", "centered_difference", "--out", folder / "grid.npz")
    matrix = scipy.sparse.load_npz(folder / "grid.npz")
    moved = np.stack([matrix @ frame for frame in np.load(folder / "grid.npy")])
    assert np.abs(moved - np.load(out)).max() < 1e-12
    run("export", *common, "--frames", folder / "grid.npy", "--out", folder / "grid.json")
    array = {name: np.load(folder / entry["file"])
             for name, entry in json.loads((folder / "grid.json").read_text())["arrays"].items()}
    points = np.column_stack([array["points"], np.ones(len(array["points"]))])
    moved = np.einsum("pk,fpkij,pj->fpi", array["weights"], array["transforms"][:, array["indices"]], points)
    assert np.abs(moved - np.load(out)).max() < 1e-12

    # Points outside: extrapolated ones have their weights, marked ones none.
    outside = np.array([[0.5, 0.5, 0.5], [1.3, 0.5, 0.4]])
    np.save(folder / "tetrahedra.points.npy", outside)
    assert "--outside" in exported("tetrahedra", "map.npz", status=2)
    expected = deformed("tetrahedra", "--outside", "nearest", "--reconstructor", "kriging")
    matrix = scipy.sparse.load_npz(exported("tetrahedra", "map.npz", "--outside", "nearest"))
    assert np.abs(matrix @ np.load(folder / "tetrahedra.npy")[3] - expected[3]).max() < 1e-12
    marked = scipy.sparse.load_npz(exported("tetrahedra", "map.npz", "--outside", "mark"))
    assert list(np.diff(marked.indptr) > 0) == [True, False]
    np.save(folder / "tetrahedra.points.npy", outside[:1])

    refusals = {("--reconstructor", "adaptive"): ["adaptive", "kriging", "--as bones"],
                ("--as", "bones"): [".json"], ("--as", "bone"): ["matrix, stencils or bones"],
                ("--frames", "x.npy"): ["bones"]}
    for options, facts in refusals.items():
        error = exported("tetrahedra", "refused.npz", *options, status=2)
        assert all(fact in error for fact in facts), error
        assert not (folder / "refused.npz").exists()
    assert "hermite" in exported("tetrahedra", "refused.json", "--interpolant", "hermite", status=2)
    assert ".npz" in exported("tetrahedra", "refused.txt", status=2)
    assert "cannot be written" in exported("tetrahedra", "missing/map.npz", status=2)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        main(pathlib.Path(name))

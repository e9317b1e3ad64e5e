"""The Python package: results beside the command line's, inputs of each kind, errors, warnings, cancelling, leaks."""
import contextlib
import ctypes
import filecmp
import gc
import importlib
import inspect
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import types
import unittest
import warnings
from unittest import mock

import numpy as np

import bisector as bs
from bisector import _library, _meshes

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("BISECTOR_PROGRAM")
PART = ROOT / "examples" / "part.off"
SMOOTH = ROOT / "examples" / "smooth.off"


def read_off(path):
    """Vertices and triangles of an OFF file."""
    words = path.read_text().split()[1:]
    n, m = int(words[0]), int(words[1])
    vertices = np.array(words[3:3 + 3 * n], dtype=float).reshape(-1, 3)
    faces = np.array(words[3 + 3 * n:3 + 3 * n + 4 * m], dtype=int).reshape(-1, 4)
    return vertices, faces[:, 1:]


class MallocInfo(ctypes.Structure):
    """struct mallinfo2 of glibc."""
    _fields_ = [(name, ctypes.c_size_t) for name in ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks",
                                                     "fsmblks", "uordblks", "fordblks", "keepcost")]


def cube(k=4):
    """The surface of the unit cube in squares, as (V, F) with four corners a face."""
    vertices, faces = {}, []
    for axis in range(3):
        for high in (0, 1):
            for i in range(k):
                for j in range(k):
                    corners = []
                    for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        p = [0, 0, 0]
                        p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = high * k, i + a, j + b
                        corners.append(vertices.setdefault(tuple(p), len(vertices)))
                    faces.append(corners if high else corners[::-1])
    return np.array(list(vertices), dtype=float) / k, np.array(faces)


def stem():
    """Points of a leaning stem with one branch."""
    points = []
    for start, step, length, radius in (((0, 0, 0), (0.1, 0, 1), 4, 0.2), ((0.2, 0, 2), (0, 0.8, 0.6), 2, 0.08)):
        step = np.array(step) / np.linalg.norm(step)
        u = np.cross(step, [1, 0, 0])
        u /= np.linalg.norm(u)
        v = np.cross(step, u)
        for s in np.arange(0, length, 0.04):
            for angle in np.linspace(0, 2 * np.pi, 24, endpoint=False):
                r = radius * (1 - 0.6 * s / length)
                points.append(start + s * step + r * (np.cos(angle) * u + np.sin(angle) * v))
    return np.array(points)


def triangle_fan(faces):
    return np.array([[f[0], f[k], f[k + 1]] for f in faces for k in range(1, len(f) - 1)])


@unittest.skipUnless(PROGRAM, "BISECTOR_PROGRAM does not name the program")
class SameAsTheProgram(unittest.TestCase):
    """Files and reports of the package are the program's."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def program(self, *arguments):
        subprocess.run([PROGRAM, *map(str, arguments), "--quiet"], check=True, cwd=self.folder)

    def expect_same(self, save, name):
        mine = self.folder / ("python-" + name)
        save(mine)
        self.assertTrue(filecmp.cmp(mine, self.folder / name, shallow=False), name)

    def expect_same_report(self, report, name):
        def timeless(x):
            if isinstance(x, dict):
                return {k: timeless(v) for k, v in x.items() if "seconds" not in k and k != "arguments"}
            return [timeless(v) for v in x] if isinstance(x, list) else x
        self.assertEqual(timeless(report), timeless(json.loads((self.folder / name).read_text())))

    def test_remesh(self):
        self.program("remesh", PART, "-o", "a.ply", "-n", 300, "--features", 30.5, "--min-angle", 35, "--detail", "off",
                     "--iterations", 10, "--report", "a.json",
                     "--feature-output", "a.txt", "--preview", "a.png")
        r = bs.remesh(PART, n=np.int32(300), features=np.float32(30.5), min_angle=35, detail="off", iterations=10)
        self.expect_same(r.save, "a.ply")
        self.expect_same(r.save_features, "a.txt")
        self.expect_same(r.save_preview, "a.png")
        self.expect_same_report(r.report, "a.json")
        r.save_report(self.folder / "r.json")
        self.assertEqual(json.loads((self.folder / "r.json").read_text()), r.report)
        r.save_report(self.folder / "r.html")
        self.assertTrue((self.folder / "r.html").read_text().startswith("<!DOCTYPE html>"))
        arrays = bs.remesh(read_off(PART), 300, features=30.5, min_angle=35, detail="off", iterations=10, threads=1)
        self.expect_same(arrays.save, "a.ply")

    def test_tetrahedralize(self):
        self.program("tet", SMOOTH, "-o", "a.msh", "-n", 200, "--iterations", 8, "--report", "a.json", "--boundary",
                     "b.obj")
        r = bs.tetrahedralize(SMOOTH, n=200, iterations=8)
        self.expect_same(r.save, "a.msh")
        self.expect_same(r.save_boundary, "b.obj")
        self.expect_same_report(r.report, "a.json")

    def test_segment(self):
        self.program("segment", PART, "-o", "a.ply", "--error", 0.5, "--project", "--polygons", "p.obj", "--report",
                     "a.json", "--json", "s.json")
        with warnings.catch_warnings(record=True):
            r = bs.segment(str(PART), error=0.5, project=True, polygons=True)
        self.expect_same(r.save, "a.ply")
        self.expect_same(r.save_polygons, "p.obj")
        self.assertEqual(r.report["segmentation"], json.loads((self.folder / "a.json").read_text())["segmentation"])
        vertices, polygons = r.polygons
        self.assertEqual(len(polygons), len(r.polygon_labels))
        self.assertLess(max(map(max, polygons)), len(vertices))

    def test_tree(self):
        scan = self.folder / "scan.xyz"
        points = stem()
        scan.write_text("".join("%r %r %r\n" % tuple(map(float, p)) for p in points))
        self.program("tree", scan, "-o", "a.obj", "--cylinders", "c.csv", "--skeleton", "s.ply", "--labels", "l.ply",
                     "--report", "a.json")
        r = bs.reconstruct_tree(points)
        self.expect_same(r.save, "a.obj")
        self.expect_same(r.save_cylinders, "c.csv")
        self.expect_same(r.save_skeleton, "s.ply")
        self.expect_same(r.save_labels, "l.ply")
        self.expect_same_report(r.report, "a.json")
        self.assertEqual(r.nodes.shape, (len(r.node_radii), 3))
        self.assertTrue(np.all(r.node_parents < np.arange(len(r.nodes))))
        self.assertEqual(len(r.point_branches), len(points))

    def test_rvd_and_quality(self):
        self.program("rvd", SMOOTH, "-n", 40, "-o", "c.ply", "--pairs", "p.txt", "--report", "a.json")
        r = bs.rvd(SMOOTH, n=40)
        self.expect_same(r.save, "c.ply")
        self.expect_same(r.save_pairs, "p.txt")
        self.expect_same_report(r.report, "a.json")
        self.assertTrue(np.array_equal(r.pairs, np.loadtxt(self.folder / "p.txt", dtype=int)))
        self.assertTrue(np.array_equal(bs.rvd(SMOOTH, seeds=r.seeds).masses, r.masses))
        self.program("quality", SMOOTH, "--reference", SMOOTH, "--report", "q.json")
        self.expect_same_report(bs.quality(read_off(SMOOTH), reference=SMOOTH), "q.json")


class Arrays(unittest.TestCase):
    def test_shapes_types_and_views(self):
        r = bs.remesh(cube(), n=60)
        self.assertEqual((r.vertices.dtype, r.faces.dtype), (np.float64, np.int64))
        self.assertEqual((r.vertices.shape[1], r.faces.shape[1]), (3, 3))
        self.assertEqual(len(r.faces), 2 * len(r.vertices) - 4)  # Euler
        self.assertIsNone(r.labels)
        self.assertIs(r.vertices, r.vertices)
        self.assertFalse(r.vertices.flags.owndata)  # the library's memory
        with self.assertRaises(ValueError):
            r.vertices[0, 0] = 7
        vertices = r.vertices
        copy = vertices.copy()
        del r
        gc.collect()
        bs.remesh(cube(), n=61)  # reuses memory that was freed
        self.assertTrue(np.array_equal(vertices, copy))

    def test_polygons_are_divided_as_in_files(self):
        vertices, faces = cube()
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "cube.off"
            path.write_text("OFF\n%d %d 0\n" % (len(vertices), len(faces)) +
                            "".join("%r %r %r\n" % tuple(map(float, v)) for v in vertices) +
                            "".join("4 %d %d %d %d\n" % tuple(f) for f in faces))
            from_file = bs.remesh(path, n=60)
        self.assertTrue(np.array_equal(from_file.vertices, bs.remesh((vertices, faces), n=60).vertices))
        lists = (vertices.tolist(), [list(map(int, f)) for f in faces[:-1]] + triangle_fan(faces[-1:]).tolist())
        self.assertTrue(bs.remesh(lists, n=60).report["topology"]["matches_input"])

    def test_labels_and_feature_edges(self):
        vertices, faces = cube()
        labels = np.repeat(np.arange(6), len(faces) // 6)
        r = bs.remesh((vertices, faces), n=200, labels=labels)
        self.assertEqual(set(r.labels), set(range(6)))
        for axis in range(3):  # labels are in the order of the cube's sides
            self.assertTrue(np.all(vertices[faces[labels == 2 * axis]][..., axis] == 0))
            self.assertTrue(np.allclose(r.vertices[r.faces[r.labels == 2 * axis]][..., axis], 0))
        flat = vertices.copy()
        edges = np.array([[a, b] for f in faces for a, b in zip(f, np.roll(f, -1)) if a < b
                          and vertices[a][0] == vertices[b][0] == 0.5 and vertices[a][1] == vertices[b][1] == 1])
        kept = bs.remesh((flat, faces), n=200, feature_edges=edges, features=89)
        without = bs.remesh((flat, faces), n=200, features=89)
        self.assertGreater(len(kept.feature_edges), len(without.feature_edges))

    def test_data(self):
        vertices, faces = cube()
        triangles = triangle_fan(faces)
        part = (vertices[triangles][:, :, 2].mean(axis=1) > 0.5).astype(np.int16)
        corners = vertices[triangles][:, :, :2].astype(np.float32)
        r = bs.remesh((vertices, triangles), n=200, map=True,
                      vertex_data={"place": vertices, "warm": vertices[:, 2] > 0.5}, face_data={"part": part},
                      corner_data={"texcoord": corners, "height": vertices[triangles][:, :, 2]})
        self.assertTrue(np.allclose(r.vertex_data["place"], r.vertices, atol=1e-12))
        self.assertEqual(r.vertex_data["warm"].dtype, np.uint8)
        self.assertEqual(set(r.vertex_data["warm"]), {0, 1})
        middles = r.vertices[r.faces].mean(axis=1)[:, 2]
        sure = np.abs(middles - 0.5) > 0.25
        self.assertEqual(r.face_data["part"].dtype, np.int16)
        self.assertTrue(np.array_equal(r.face_data["part"][sure], middles[sure] > 0.5))
        self.assertEqual(r.corner_data["texcoord"].dtype, np.float32)
        self.assertTrue(np.allclose(r.corner_data["texcoord"], r.vertices[r.faces][:, :, :2], atol=1e-6))
        self.assertEqual(r.corner_data["height"].shape, r.faces.shape)
        on, weights = r.map
        self.assertTrue(np.allclose(np.einsum("nk,nkd->nd", weights, vertices[triangles[on]]), r.vertices, atol=1e-12))
        with self.assertRaises(ValueError):
            r.vertex_data["place"][0] = 0
        again = bs.remesh(r, n=100, energy="ccvt")  # a result brings its own
        self.assertTrue(np.allclose(again.vertex_data["place"], again.vertices, atol=1e-12))
        self.assertEqual(set(again.face_data), {"part"})
        dense = bs.remesh((vertices, triangles), n=200, density="attribute:rho",
                          vertex_data={"rho": np.exp(4 * vertices[:, 2])})
        self.assertGreater(np.mean(dense.vertices[:, 2] > 0.5), 0.6)
        with self.assertRaisesRegex(bs.Error, "no numbers 'none', use one of rho"):
            bs.remesh((vertices, triangles), n=200, density="attribute:none", vertex_data={"rho": vertices[:, 2]})
        for data in ({"place": vertices[1:]}, {"name": np.array(["a"] * len(vertices))}):
            with self.assertRaises(bs.Error):
                bs.remesh((vertices, triangles), n=200, vertex_data=data)
        with self.assertRaisesRegex(bs.Error, "a file has its own"):
            bs.remesh(SMOOTH, n=200, vertex_data={"place": vertices})

        t = bs.tetrahedralize((vertices, triangles), n=200, iterations=3, vertex_data={"place": vertices})
        depth = np.min(np.minimum(t.vertices, 1 - t.vertices), axis=1)
        self.assertTrue(np.allclose(np.linalg.norm(t.vertex_data["place"] - t.vertices, axis=1), depth, atol=1e-12))
        cells = t.vertices[t.tets].mean(axis=1)
        u = bs.tetrahedralize((t.vertices, t.tets), n=150, iterations=3, vertex_data={"place": t.vertices},
                              cell_data={"above": (cells[:, 2] > 0.5).astype(np.uint8)})
        self.assertLess(np.abs(u.vertex_data["place"] - u.vertices).max(), 1e-3 * np.sqrt(3))
        middles = u.vertices[u.tets].mean(axis=1)[:, 2]
        sure = np.abs(middles - 0.5) > 0.3
        self.assertTrue(np.array_equal(u.cell_data["above"][sure], middles[sure] > 0.5))

    def test_diagrams_of_solids(self):
        vertices, faces = cube()
        t = bs.tetrahedralize((vertices, triangle_fan(faces)), n=100, iterations=3)
        d = bs.rvd(t, n=20)
        volumes = np.einsum("ij,ij->i", t.vertices[t.tets[:, 1]] - t.vertices[t.tets[:, 0]], np.cross(
            t.vertices[t.tets[:, 2]] - t.vertices[t.tets[:, 0]], t.vertices[t.tets[:, 3]] - t.vertices[t.tets[:, 0]])) / 6
        self.assertAlmostEqual(d.masses.sum(), volumes.sum(), places=12)
        self.assertGreater(len(d.dual_tets), 0)
        self.assertLess(d.dual_tets.max(), 20)
        with tempfile.TemporaryDirectory() as folder:
            d.save(pathlib.Path(folder) / "cells.vtu")
            d.save(pathlib.Path(folder) / "cells.ply")
            with self.assertRaisesRegex(bs.Error, "cells on a surface are polygons"):
                bs.rvd(cube(), n=20).save(pathlib.Path(folder) / "other.vtu")

    def test_nodes_on_edges(self):
        t = bs.tetrahedralize(SMOOTH, n=300, order=2, iterations=5)
        self.assertGreater(t.report["second_order"]["jacobian_min"], 0)
        edges, nodes = t.node_edges, t.edge_nodes
        self.assertEqual(len(edges), len(nodes))
        middles = t.vertices[edges].mean(axis=1)
        lengths = np.linalg.norm(np.diff(t.vertices[edges], axis=1)[:, 0], axis=1)
        self.assertTrue(np.all(np.linalg.norm(nodes - middles, axis=1) <= 0.3 * lengths))
        with contextlib.suppress(ImportError):
            mesh = t.to_meshio()
            tens = mesh.cells_dict["tetra10"]
            self.assertTrue(np.array_equal(tens[:, :4], t.tets))
            for k, (a, b) in enumerate([(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]):
                between = mesh.points[tens[:, [a, b]]].mean(axis=1)
                self.assertTrue(np.all(np.linalg.norm(mesh.points[tens[:, 4 + k]] - between, axis=1) < lengths.max() / 3))

    def test_density_and_sizes(self):
        vertices, faces = read_off(SMOOTH)
        density = np.exp(vertices[:, 0] / 20)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "dense.ply"
            head = "".join(f"property double {name}\n" for name in ("x", "y", "z", "rho"))
            path.write_text(f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\n{head}element face {len(faces)}\n"
                            "property list uchar int vertex_indices\nend_header\n" +
                            "".join("%r %r %r %r\n" % tuple(map(float, row)) for row in np.c_[vertices, density]) +
                            "".join("3 %d %d %d\n" % tuple(f) for f in faces))
            expected = bs.remesh(path, n=300, density="attribute:rho")
        r = bs.remesh((vertices, faces), n=300, density=density)
        self.assertTrue(np.array_equal(r.vertices, expected.vertices))
        self.assertFalse(np.array_equal(r.vertices, bs.remesh((vertices, faces), n=300).vertices))
        box, squares = cube()
        sizes = np.where(box[:, 2] > 0.5, 0.1, 0.4)
        fine = bs.tetrahedralize((box, triangle_fan(squares)), n=300, sizes=sizes, iterations=10)
        above = np.mean(fine.vertices[:, 2] > 0.5)
        self.assertGreater(above, 0.6)
        again = bs.tetrahedralize((fine.vertices, fine.tets), n=100, iterations=5)
        self.assertEqual(bs.quality(again)["topology"]["conforming"], True)

    def test_seeds_from_an_array(self):
        seeds = read_off(SMOOTH)[0][::50]
        r = bs.remesh(SMOOTH, seeds=seeds, iterations=3, topology="off", min_angle=0)
        self.assertLessEqual(len(r.vertices), len(seeds))

    def test_objects_by_what_they_have(self):
        vertices, faces = cube()
        triangles = triangle_fan(faces)
        expected = bs.remesh((vertices, triangles), n=60).vertices
        stream = np.hstack([np.full((len(triangles), 1), 3), triangles]).reshape(-1)
        block = types.SimpleNamespace(type="triangle", data=triangles)
        for mesh in (types.SimpleNamespace(vertices=vertices, faces=triangles),
                     types.SimpleNamespace(points=vertices, faces=stream, n_cells=len(triangles), cell_data={}),
                     types.SimpleNamespace(points=vertices, cells=[block], cell_data={}, point_data={})):
            self.assertTrue(np.array_equal(bs.remesh(mesh, n=60).vertices, expected))
        mixed = types.SimpleNamespace(points=vertices, n_cells=len(faces), cell_data={},
                                      faces=np.hstack([np.full((len(faces), 1), 4), faces]).reshape(-1))
        self.assertTrue(bs.remesh(mixed, n=60).report["topology"]["closed"])

    def test_grids_of_pyvista(self):
        box, squares = cube()
        t = bs.tetrahedralize((box, triangle_fan(squares)), n=60, iterations=3)
        kinds = np.concatenate([np.full(len(t.tets), 10), np.full(len(t.faces), 5)])
        stream = np.concatenate([t.tets.reshape(-1), t.faces.reshape(-1)])
        grid = types.SimpleNamespace(points=t.vertices, celltypes=kinds, cell_data={}, cell_connectivity=stream,
                                     offset=np.concatenate([[0], np.cumsum(np.where(kinds == 10, 4, 3))]))
        self.assertEqual(bs.quality(grid)["quality"], bs.quality(t)["quality"])
        marks = np.arange(len(kinds))
        grid.cell_data = {"region": marks, "label": marks}
        arrays = _meshes.arrays_of(grid)
        self.assertTrue(np.array_equal(arrays.regions, marks[:len(t.tets)]))
        self.assertTrue(np.array_equal(arrays.labels, marks[len(t.tets):]))
        grid.celltypes = kinds + 2
        with self.assertRaisesRegex(bs.Error, "types .7, 12."):
            bs.quality(grid)

    def test_accessor_of_pyvista(self):
        """Beside a stand-in for PyVista, which has what the accessor needs."""
        class Data(types.SimpleNamespace):
            def __init__(self, points, faces):
                super().__init__(points=points, faces=faces, n_cells=len(faces) // 4, cell_data={})

        stand_in = types.ModuleType("pyvista")
        stand_in.PolyData, stand_in.UnstructuredGrid = Data, type("UnstructuredGrid", (), {})
        registered = []
        stand_in.register_dataset_accessor = lambda name, kind: lambda accessor: registered.append(
            (name, kind, accessor))
        with mock.patch.dict(sys.modules, {"pyvista": stand_in}):
            accessor = importlib.import_module("bisector._pyvista").Accessor
            self.assertEqual(registered, [("bisector", Data, accessor),
                                          ("bisector", stand_in.UnstructuredGrid, accessor)])
            box, faces = cube()
            given = Data(box, np.hstack([np.full((len(faces), 1), 4), faces]).reshape(-1))
            made = accessor(given).remesh(60)
            self.assertTrue(np.array_equal(made.points, bs.remesh((box, faces), n=60).vertices))
            self.assertTrue(accessor(made).quality()["topology"]["closed"])
            self.assertEqual(len(set(accessor(given).segment(6).cell_data["label"])), 6)

    def test_packages(self):
        vertices, faces = cube()
        r = bs.remesh((vertices, faces), n=60, energy="ccvt", vertex_data={"place": vertices},
                      face_data={"number": np.arange(len(faces))})
        expected = bs.remesh(r, n=40, energy="ccvt").vertices
        for package, convert in (("meshio", r.to_meshio), ("trimesh", r.to_trimesh), ("pyvista", r.to_pyvista)):
            with self.subTest(package):
                try:
                    __import__(package)
                except ImportError:
                    self.skipTest(f"{package} is not installed")
                back = bs.remesh(convert(), n=40, energy="ccvt")
                self.assertTrue(np.array_equal(back.vertices, expected))
                self.assertTrue(np.allclose(back.vertex_data["place"], back.vertices, atol=1e-12))
                self.assertEqual(back.face_data["number"].dtype, np.int64)
        t = bs.tetrahedralize(r, n=60, iterations=3)
        with contextlib.suppress(ImportError):
            mesh = t.to_meshio()
            self.assertEqual(bs.quality(mesh)["input"]["tets"], len(t.tets))


class Errors(unittest.TestCase):
    def expect(self, words, *arguments, **options):
        with self.assertRaises(bs.Error) as caught:
            bs.remesh(*arguments, **options)
        self.assertIn(words, str(caught.exception))
        self.assertNotIn("\n", str(caught.exception))
        self.assertIsInstance(caught.exception, ValueError)

    def test_bad_input_and_options(self):
        vertices, faces = cube()
        self.expect("nowhere.off", "nowhere.off", n=50)
        self.expect("whole number from 4", PART, n=3)
        self.expect("edge_length", PART)
        self.expect("edge_length", PART, n=50, edge_length=1)
        self.expect("topology", PART, n=50, topology="mend")
        self.expect("is not a number", PART, n=50, tolerance=float("nan"))
        self.expect("neither a word nor a number", PART, n=[5])
        self.expect("whole number", PART, n=False)
        self.expect("finite", (vertices * np.nan, faces), n=50)
        self.expect("out of range", (vertices, faces + 1000), n=50)
        self.expect("out of range", (vertices, faces - 1000), n=50)
        self.expect("(n, 3)", (vertices.ravel(), faces), n=50)
        self.expect("whole numbers", (vertices, faces[:, :3] / 1), n=50)
        self.expect("no face", (vertices, np.zeros((0, 3), int)), n=50)
        self.expect("is no mesh", 7, n=50)
        self.expect("labels", (vertices, faces), n=50, labels=[1, 2])
        self.expect("density", (vertices, faces), n=50, density=np.ones(3))
        self.expect("wrap", (vertices, faces), n=50, density=np.ones(len(vertices)), wrap=True)
        self.expect("seeds", PART, n=50, seeds=np.zeros((0, 3)))
        self.expect("null", "a\0b.off", n=50)
        with self.assertRaises(TypeError):
            bs.remesh(PART, n=50, sise=3)
        with self.assertRaises(bs.DeviceError):
            bs.remesh(PART, n=50, device="vulkan:4000000")
        r = bs.remesh(cube(), n=50)
        with self.assertRaisesRegex(bs.Error, "ply"):
            r.save("out.xyz")
        with self.assertRaisesRegex(bs.Error, "polygons"):
            bs.segment(cube(), proxies=6).save_polygons("out.obj")

    def test_warnings_name_the_caller(self):
        vertices, faces = cube()
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            bs.rvd((np.vstack([vertices, [[9, 9, 9]]]), triangle_fan(faces)), n=10)
        self.assertEqual([w.category for w in caught], [bs.BisectorWarning])
        self.assertIn("used by no face", str(caught[0].message))
        self.assertEqual(caught[0].filename, __file__)


class Signatures(unittest.TestCase):
    def test_keywords_are_the_options(self):
        mine = {"mesh", "points", "labels", "feature_edges", "progress", "vertex_data", "face_data", "corner_data",
                "cell_data"}
        for command, function in (("remesh", bs.remesh), ("tet", bs.tetrahedralize), ("segment", bs.segment),
                                  ("tree", bs.reconstruct_tree), ("rvd", bs.rvd), ("quality", bs.quality)):
            options = json.loads(_library.text("describe", command.encode()))
            names = {option["name"].replace("-", "_") for option in options}
            self.assertEqual(set(inspect.signature(function).parameters) - mine, names, command)
            for option in options:
                self.assertTrue(option["help"], option["name"])


class Running(unittest.TestCase):
    def jobs(self):
        smooth = read_off(SMOOTH)
        points = np.concatenate([stem() + [x, 0, 0] for x in range(0, 60, 4)])
        return {"remesh": lambda progress=None: bs.remesh(smooth, n=6000, progress=progress),
                "tet": lambda progress=None: bs.tetrahedralize(smooth, n=3000, progress=progress),
                "segment": lambda progress=None: bs.segment(smooth, proxies=40, progress=progress),
                "tree": lambda progress=None: bs.reconstruct_tree(points, progress=progress)}

    def test_interrupts_cancel_within_a_second(self):
        for name, job in self.jobs().items():
            with self.subTest(name):
                sent = []

                def interrupt():
                    sent.append(time.monotonic())
                    os.kill(os.getpid(), signal.SIGINT)

                timer = threading.Timer(0.3, interrupt)
                timer.start()
                with self.assertRaises(KeyboardInterrupt):
                    job()
                    timer.cancel()
                self.assertLess(time.monotonic() - sent[0], 1)
                for thread in threading.enumerate():
                    if thread.name == "bisector":
                        thread.join(20)
                        self.assertFalse(thread.is_alive())

    def test_progress_is_told_in_the_callers_thread_and_may_end_the_run(self):
        heard = []

        def progress(p):
            heard.append((p, threading.current_thread()))
            if p.iteration > 3:
                raise StopIteration

        with self.assertRaises(StopIteration):
            self.jobs()["remesh"](progress)
        self.assertEqual({thread for _, thread in heard}, {threading.current_thread()})
        fractions = [p.fraction for p, _ in heard if p.fraction is not None]
        self.assertEqual(fractions, sorted(fractions))
        self.assertTrue(any(p.phase.startswith("reading") for p, _ in heard))

    def test_an_interrupted_run_goes_on(self):
        mesh = cube()
        seeds = np.random.default_rng(1).random((300, 3))
        options = {"seeds": seeds, "iterations": 20, "checkpoint_every": 0}

        def progress(p):
            if p.iteration == 12:
                raise StopIteration

        with tempfile.TemporaryDirectory() as folder:
            checkpoint = pathlib.Path(folder) / "cube.checkpoint"
            with self.assertRaises(StopIteration):
                bs.remesh(mesh, checkpoint=checkpoint, progress=progress, **options)
            for thread in threading.enumerate():
                if thread.name == "bisector":
                    thread.join(20)
            with self.assertRaisesRegex(bs.Error, "checkpoint"):
                bs.remesh(mesh, checkpoint=checkpoint, resume=True, **{**options, "seeds": seeds[::-1]})
            heard = []
            made = bs.remesh(mesh, checkpoint=checkpoint, resume=True, progress=heard.append, **options)
            self.assertTrue(checkpoint.exists())
        whole = []
        undisturbed = bs.remesh(mesh, progress=whole.append, **{**options, "checkpoint_every": None})
        self.assertTrue(np.array_equal(made.vertices, undisturbed.vertices))
        # What is heard lags behind the run, which may thus be far beyond the twelfth step when it ends.
        self.assertLess(len(heard), len(whole) - 10)

    def test_threads_at_once(self):
        expected = {n: bs.remesh(cube(), n=n).vertices for n in (60, 90)}
        results = {}

        def run(n):
            for _ in range(5):
                r = bs.remesh(cube(), n=n)
                results.setdefault(n, []).append(r.vertices)

        threads = [threading.Thread(target=run, args=(n,)) for n in expected]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for n, vertices in expected.items():
            self.assertEqual(len(results[n]), 5)
            for other in results[n]:
                self.assertTrue(np.array_equal(vertices, other))

    def test_the_interpreters_lock_is_free(self):
        ticks, done = [], threading.Event()

        def tick():
            while not done.wait(0.01):
                ticks.append(time.monotonic())

        thread = threading.Thread(target=tick)
        thread.start()
        start = time.monotonic()
        bs.remesh(SMOOTH, n=300)
        done.set()
        thread.join()
        between = np.diff([start, *ticks])
        self.assertLess(between.max(), 0.5)

    def test_kept(self):
        vertices, faces = cube()
        r = bs.remesh((vertices, faces), n=200, keep_vertices=[7], keep_faces=np.array([0, 1, 5]))
        of_input = r.kept[r.kept >= 0]
        self.assertLessEqual({7, *faces[[0, 1, 5]].ravel()}, set(of_input))
        self.assertTrue(np.array_equal(r.vertices[r.kept >= 0], vertices[of_input]))
        with self.assertRaisesRegex(bs.Error, "face 999"):
            bs.remesh((vertices, faces), n=200, keep_faces=[999])

    @unittest.skipUnless(hasattr(ctypes.CDLL(None), "mallinfo2"), "needs glibc's count of what is allocated")
    def test_a_thousand_calls_leak_nothing(self):
        mesh = cube(3)
        bad = (mesh[0], mesh[1] + 5)

        def calls(count):
            for k in range(count):
                r = bs.rvd(mesh, n=12)
                assert r.masses.sum() > 5.9
                if k % 5 == 0:
                    with contextlib.suppress(bs.Error):
                        bs.rvd(bad, n=12)

        def allocated():
            """Bytes that malloc has given out: unlike the resident size, free of what its arenas keep."""
            gc.collect()
            mallinfo2 = ctypes.CDLL(None).mallinfo2
            mallinfo2.restype = MallocInfo
            info = mallinfo2()
            return info.uordblks + info.hblkhd

        calls(100)  # what is built once
        before = allocated()
        calls(1000)
        self.assertLess(allocated() - before, 100_000)  # 100 bytes a call


class Recipes(unittest.TestCase):
    def test_the_page_runs(self):
        page = (ROOT / "docs" / "python.md").read_text()
        recipes = re.findall(r"```python\n(.*?)```", page, re.S)
        self.assertGreater(len(recipes), 5)
        with tempfile.TemporaryDirectory() as folder:
            for name in ("part.off", "smooth.off"):
                os.symlink(ROOT / "examples" / name, pathlib.Path(folder) / name)
            np.savetxt(pathlib.Path(folder) / "scan.xyz", stem())
            before = os.getcwd()
            os.chdir(folder)
            try:
                for recipe in recipes:
                    with self.subTest(recipe.splitlines()[0]), warnings.catch_warnings():
                        warnings.simplefilter("ignore")
                        try:
                            exec(compile(recipe, "docs/python.md", "exec"), {})
                        except ImportError as error:
                            self.skipTest(str(error))
            finally:
                os.chdir(before)


if __name__ == "__main__":
    unittest.main()

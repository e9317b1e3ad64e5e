"""Other libraries read what Bisector wrote, and write files for it to read.

Usage: foreign_formats.py LIBRARY FOLDER, with LIBRARY meshio, gmsh, vtk or zip (3MF by Python's own modules). FOLDER has
surface.* and tets.*, surface-named.* and tets-named.*, and expected.json with what they hold. Files are added to it,
with written.json, which lists them. Exits with 77 where the library is not installed, with 1 and an error where it sees
something else than was written.
"""
import collections
import json
import os
import sys

folder = sys.argv[2]
expected = json.load(open(os.path.join(folder, "expected.json")))
written = []


def path(name):
    return os.path.join(folder, name)


def to_write(name, kind, labels=True, names=False, single=False, edges=True):
    """The path of a file to write, of which it is noted what Bisector has to find in it."""
    written.append({"file": name, "kind": kind, "labels": labels, "names": names, "single": single, "edges": edges})
    return path(name)


def rounded(points, single):
    import numpy as np

    points = np.asarray(points, dtype=np.float64)
    return points.astype(np.float32).astype(np.float64) if single else points


def cycle(corners):
    """Corners of a triangle from the least on, in their order."""
    k = corners.index(min(corners))
    return tuple(corners[k:] + corners[:k])


def marked(points, elements, marks):
    """Elements by the coordinates of their corners, with their marks; of tetrahedra the order of corners is left out."""
    place = [tuple(p) for p in points.tolist()]
    found = collections.Counter()
    for i, element in enumerate(elements):
        corners = [place[v] for v in element]
        key = tuple(sorted(corners)) if len(corners) != 3 else cycle(corners)
        found[key, None if marks is None else marks[i]] += 1
    return found


def check(what, kind, points, elements, marks=None, named=None, single=False):
    """elements and marks: "triangles", "tets" and "edges", of which what is missing is not compared."""
    truth = expected[kind]
    true_points, points = rounded(truth["points"], single), rounded(points, single)
    used = sorted(map(tuple, points.tolist()))
    if single:  # one vertex may be there more than once
        used = sorted(set(used))
    assert used == sorted(set(map(tuple, true_points.tolist()))), f"{what}: other vertices"
    for name, found in elements.items():
        marks_of = (marks or {}).get(name)
        true_marks = truth["marks"].get(name) if marks_of is not None else None
        if named and true_marks is not None:
            true_marks = [truth["names"][name][str(mark)] for mark in true_marks]
        left, right = marked(true_points, truth[name], true_marks), marked(points, found, marks_of)
        assert left == right, f"{what}: other {name}: {len(truth[name])} written, {len(found)} seen; " \
                              f"{list((left - right).items())[:1]} {list((right - left).items())[:1]}"


# --- meshio ---

def run_meshio():
    import meshio
    import numpy as np

    kinds = {"triangles": "triangle", "tets": "tetra", "edges": "line"}

    def seen(name, kind, label=None, region=None, edges=True, single=False):
        mesh = meshio.read(path(name))
        elements, marks = {}, {}
        for key, cell in kinds.items():
            if key in expected[kind] and (key != "edges" or edges):
                elements[key] = mesh.cells_dict[cell].tolist()
        for key, array in [("triangles", label), ("tets", region)]:
            if array and key in elements:
                marks[key] = mesh.cell_data_dict[array][kinds[key]].tolist()
        check(name, kind, mesh.points, elements, marks, single=single)
        return mesh

    for kind in ["surface", "tets"]:
        for name, label, region in [("mesh", "medit:ref", "medit:ref"), ("meshb", "medit:ref", "medit:ref"),
                                    ("msh", "gmsh:physical", "gmsh:physical"), ("vtu", "label", "region")]:
            seen(f"{kind}.{name}", kind, label, region)
        mesh = seen(f"{kind}-named.msh", kind, "gmsh:physical", "gmsh:physical")
        names = {int(v[0]): k for k, v in mesh.field_data.items() if v[1] == 2}
        assert names == {int(k): v for k, v in expected[kind]["names"]["triangles"].items()}, names
    # Of second order: each node is where the edge's is that this place in a cell belongs to.
    pairs = {"tetra10": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)], "triangle6": [(0, 1), (1, 2), (2, 0)],
             "line3": [(0, 1)]}
    nodes = {tuple(edge): tuple(node) for edge, node in expected["nodes"]}
    corners = {tuple(p): v for v, p in enumerate(expected["tets"]["points"])}
    for name in ["curved.msh", "curved.vtu"]:
        mesh = meshio.read(path(name))
        for (cell, ends), key in zip(pairs.items(), ("tets", "triangles", "edges")):
            found = mesh.cells_dict[cell]
            assert len(found) == len(expected["tets"][key]), f"{name}: {len(found)} {cell}"
            for element in found.tolist():
                v = [corners[tuple(mesh.points[c])] for c in element[:len(element) - len(ends)]]
                for (a, b), node in zip(ends, element[-len(ends):]):
                    assert tuple(mesh.points[node]) == nodes[min(v[a], v[b]), max(v[a], v[b])], f"{name}: {element}"
    assert mesh.point_data["heat"].shape == (len(mesh.points),)

    seen("surface.off", "surface", edges=False)
    seen("surface.obj", "surface", edges=False)
    seen("bare.ply", "surface", edges=False)
    seen("surface.stl", "surface", edges=False, single=True)

    for kind in ["surface", "tets"]:
        truth = expected[kind]
        cells = [(cell, np.array(truth[key])) for key, cell in kinds.items() if key in truth]
        marks = [np.array(truth["marks"].get(key, [0] * len(truth[key])), dtype=np.int32)
                 for key in kinds if key in truth]

        def mesh(name):
            return meshio.Mesh(np.array(truth["points"]), cells, cell_data={name: marks})

        mesh("medit:ref").write(to_write(f"{kind}-1.mesh", kind))
        mesh("medit:ref").write(to_write(f"{kind}-1.meshb", kind))
        for name, options in [("1", {}), ("2", {"binary": False}), ("3", {"compression": None})]:
            mesh("label").write(to_write(f"{kind}-{name}.vtu", kind, single="binary" in options), **options)
        for name, binary in [("1", True), ("2", False)]:
            mesh("label").write(to_write(f"{kind}-{name}.vtk", kind), binary=binary)
            tagged = mesh("gmsh:physical")
            tagged.cell_data["gmsh:geometrical"] = marks
            tagged.field_data = {v: np.array([int(k), 2]) for k, v in truth["names"]["triangles"].items()}
            tagged.field_data.update({v: np.array([int(k), 3]) for k, v in truth["names"].get("tets", {}).items()})
            tagged.write(to_write(f"{kind}-{name}.msh", kind, names=True), file_format="gmsh22", binary=binary)
    truth = expected["surface"]
    mesh = meshio.Mesh(np.array(truth["points"]), [("triangle", np.array(truth["triangles"]))])
    mesh.write(to_write("surface-1.off", "surface", labels=False, edges=False))
    mesh.write(to_write("surface-1.obj", "surface", labels=False, edges=False))
    for name, binary in [("1", True), ("2", False)]:
        mesh.write(to_write(f"surface-{name}.stl", "surface", labels=False, edges=False, single=True), binary=binary)
        mesh.write(to_write(f"surface-{name}.ply", "surface", labels=False, edges=False), binary=binary)


# --- Gmsh ---

def run_gmsh():
    import gmsh

    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)

    def seen(name, kind, marks=True, names=False, edges=True, single=False):
        gmsh.clear()
        gmsh.logger.start()
        gmsh.open(path(name))
        complaints = [line for line in gmsh.logger.get() if line.startswith(("Warning", "Error"))]
        assert not complaints, f"{name}: {complaints}"
        gmsh.logger.stop()
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        points = coordinates.reshape(-1, 3)
        index = {int(tag): i for i, tag in enumerate(tags)}
        elements, found = collections.defaultdict(list), collections.defaultdict(list)
        for dimension, key in [(1, "edges"), (2, "triangles"), (3, "tets")]:
            if key not in expected[kind] or (key == "edges" and not edges):
                continue
            for _, entity in gmsh.model.getEntities(dimension):
                groups = [int(g) for g in gmsh.model.getPhysicalGroupsForEntity(dimension, entity)]
                mark = groups[0] if groups else entity
                if names:
                    mark = gmsh.model.getPhysicalName(dimension, mark)
                for nodes in gmsh.model.mesh.getElements(dimension, entity)[2]:
                    for corners in nodes.reshape(-1, dimension + 1):
                        elements[key].append([index[int(v)] for v in corners])
                        found[key].append(mark)
        found.pop("edges", None)
        check(name, kind, points, elements, found if marks else None, named=names, single=single)

    for kind in ["surface", "tets"]:
        seen(f"{kind}.msh", kind)
        seen(f"{kind}.mesh", kind)
        seen(f"{kind}-named.msh", kind, names=True)
        # Gmsh gives back what it has read, in each of its forms.
        for version, binary in [(2.2, 0), (2.2, 1), (4.1, 0), (4.1, 1)]:
            gmsh.option.setNumber("Mesh.MshFileVersion", version)
            gmsh.option.setNumber("Mesh.Binary", binary)
            gmsh.write(to_write(f"{kind}-{version}-{binary}.msh", kind, names=True, single=not binary))  # 16 digits
        gmsh.option.setNumber("Mesh.SaveElementTagType", 2)  # physical groups
        gmsh.write(to_write(f"{kind}-g.mesh", kind, single=True))
        gmsh.option.setNumber("Mesh.SaveElementTagType", 1)
        if kind == "surface":
            for binary in [0, 1]:
                gmsh.option.setNumber("Mesh.Binary", binary)
                gmsh.option.setNumber("Mesh.StlOneSolidPerSurface", 0 if binary else 2)
                gmsh.write(to_write(f"g{binary}.stl", kind, labels=not binary, names=not binary, edges=False, single=True))
    seen("surface.stl", "surface", marks=False, edges=False, single=True)
    gmsh.finalize()


# --- VTK ---

def run_vtk():
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    import numpy as np

    types = {"triangles": vtk.VTK_TRIANGLE, "tets": vtk.VTK_TETRA, "edges": vtk.VTK_LINE}

    def seen(name, kind, reader, marks=True, edges=True, single=False, label="label"):
        reader.SetFileName(path(name))
        reader.Update()
        data = reader.GetOutput()
        while data.IsA("vtkMultiBlockDataSet"):  # of glTF; its first piece has all points
            pieces = vtk.vtkCompositeDataGeometryFilter()
            pieces.SetInputData(data)
            pieces.Update()
            data = pieces.GetOutput()
        points = vtk_to_numpy(data.GetPoints().GetData())
        elements, found = collections.defaultdict(list), collections.defaultdict(list)
        arrays = {"triangles": data.GetCellData().GetArray(label), "tets": data.GetCellData().GetArray("region")}
        for i in range(data.GetNumberOfCells()):
            cell = data.GetCell(i)
            key = next(key for key, kind_of_cell in types.items() if kind_of_cell == cell.GetCellType())
            elements[key].append([cell.GetPointId(k) for k in range(cell.GetNumberOfPoints())])
            if arrays.get(key) is not None:
                found[key].append(int(arrays[key].GetTuple1(i)))
        if edges:
            assert "edges" in elements, name
        if marks:
            assert found, name
        check(name, kind, points, elements, found if marks else None, single=single)

    seen("surface.vtp", "surface", vtk.vtkXMLPolyDataReader())
    seen("surface.vtu", "surface", vtk.vtkXMLUnstructuredGridReader())
    seen("tets.vtu", "tets", vtk.vtkXMLUnstructuredGridReader())
    seen("surface.stl", "surface", vtk.vtkSTLReader(), marks=False, edges=False, single=True)
    seen("surface.ply", "surface", vtk.vtkPLYReader(), marks=False, edges=False, single=True)
    seen("surface.obj", "surface", vtk.vtkOBJReader(), marks=False, edges=False, single=True)
    seen("surface.glb", "surface", vtk.vtkGLTFReader(), marks=False, edges=False, single=True)

    def points_of(truth):
        points = vtk.vtkPoints()
        points.SetDataTypeToDouble()
        points.SetData(numpy_to_vtk(np.array(truth["points"]), deep=True))
        return points

    def cells_of(rows):
        cells = vtk.vtkCellArray()
        for row in rows:
            cells.InsertNextCell(len(row), row)
        return cells

    def add_array(data, name, values):
        array = numpy_to_vtk(np.array(values, dtype=np.int32), deep=True)
        array.SetName(name)
        data.GetCellData().AddArray(array)

    truth = expected["surface"]
    poly = vtk.vtkPolyData()
    poly.SetPoints(points_of(truth))
    poly.SetLines(cells_of(truth["edges"]))
    poly.SetPolys(cells_of(truth["triangles"]))
    add_array(poly, "label", [0] * len(truth["edges"]) + truth["marks"]["triangles"])
    bare = vtk.vtkPolyData()
    bare.SetPoints(points_of(truth))
    bare.SetPolys(cells_of(truth["triangles"]))
    grids = {}
    for kind in ["surface", "tets"]:
        grid = vtk.vtkUnstructuredGrid()
        grid.SetPoints(points_of(expected[kind]))
        region, label = [], []
        for key in ["edges", "triangles", "tets"]:
            for i, row in enumerate(expected[kind].get(key, [])):
                grid.InsertNextCell(types[key], len(row), row)
                label.append(expected[kind]["marks"][key][i] if key == "triangles" else 0)
                region.append(expected[kind]["marks"][key][i] if key == "tets" else 0)
        add_array(grid, "label", label)
        if kind == "tets":
            add_array(grid, "region", region)
        grids[kind] = grid

    def write_forms(kind, data, make, extension):
        """Every form of the XML files."""
        forms = [("ascii", lambda w: w.SetDataModeToAscii()), ("base64", lambda w: w.SetDataModeToBinary()),
                 ("raw", lambda w: (w.SetDataModeToAppended(), w.EncodeAppendedDataOff())),
                 ("appended", lambda w: (w.SetDataModeToAppended(), w.EncodeAppendedDataOn()))]
        for form, set_form in forms:
            for packed in [False, True]:
                for big in [False, True]:
                    for wide in [False, True]:
                        if (form == "ascii" or not packed) and (big or wide):
                            continue
                        writer = make()
                        set_form(writer)
                        if packed:
                            writer.SetCompressorTypeToZLib()
                            writer.SetBlockSize(4096)
                        else:
                            writer.SetCompressorTypeToNone()
                        if big:
                            writer.SetByteOrderToBigEndian()
                        if wide:
                            writer.SetHeaderTypeToUInt64()
                        writer.SetInputData(data)
                        writer.SetFileName(to_write(f"{kind}-{form}{packed:d}{big:d}{wide:d}{extension}", kind))
                        assert writer.Write() == 1

    write_forms("surface", poly, vtk.vtkXMLPolyDataWriter, ".vtp")
    for kind, grid in grids.items():
        write_forms(kind, grid, vtk.vtkXMLUnstructuredGridWriter, ".vtu")
        for binary in [False, True]:
            for version in [42, 51]:
                writer = vtk.vtkUnstructuredGridWriter()
                writer.SetFileVersion(version)
                writer.SetFileTypeToBinary() if binary else writer.SetFileTypeToASCII()
                writer.SetInputData(grid)
                writer.SetFileName(to_write(f"{kind}-{binary:d}{version}.vtk", kind, single=not binary))
                assert writer.Write() == 1
    for name, make in [("ply", vtk.vtkPLYWriter), ("stl", vtk.vtkSTLWriter)]:
        for binary in [False, True]:
            writer = make()
            writer.SetFileTypeToBinary() if binary else writer.SetFileTypeToASCII()
            writer.SetInputData(bare)
            writer.SetFileName(to_write(f"v{binary:d}.{name}", "surface", labels=False, edges=False, single=True))
            assert writer.Write() == 1
    writer = vtk.vtkOBJWriter()
    writer.SetInputData(bare)
    writer.SetFileName(to_write("v.obj", "surface", labels=False, edges=False, single=True))
    writer.Write()
    # Strips, of which VTK makes as many as it can.
    stripper = vtk.vtkStripper()
    stripper.SetInputData(bare)
    stripper.Update()
    strips = stripper.GetOutput()
    assert strips.GetNumberOfStrips() > 0
    writer = vtk.vtkXMLPolyDataWriter()
    writer.SetInputData(strips)
    writer.SetFileName(to_write("strips.vtp", "surface", labels=False, edges=False))
    assert writer.Write() == 1


# --- 3MF, by Python's own modules ---

def run_zip():
    import xml.etree.ElementTree
    import zipfile

    core = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"

    def seen(name, names):
        with zipfile.ZipFile(path(name)) as archive:
            assert archive.testzip() is None
            assert set(archive.namelist()) == {"[Content_Types].xml", "_rels/.rels", "3D/3dmodel.model"}
            for part in archive.namelist():
                xml.etree.ElementTree.fromstring(archive.read(part))
            model = xml.etree.ElementTree.fromstring(archive.read("3D/3dmodel.model"))
        points = [[float(v.get(k)) for k in "xyz"] for v in model.iter(core + "vertex")]
        materials = [base.get("name") for base in model.iter(core + "base")]
        triangles, marks = [], []
        for t in model.iter(core + "triangle"):
            triangles.append([int(t.get(k)) for k in ["v1", "v2", "v3"]])
            name_of = materials[int(t.get("p1"))]
            marks.append(name_of if names else int(name_of.split("_")[1]))
        check(name, "surface", points, {"triangles": triangles}, {"triangles": marks}, named=names)

    seen("surface.3mf", False)
    seen("surface-named.3mf", True)
    with zipfile.ZipFile(path("surface-named.3mf")) as archive:
        contents = {name: archive.read(name) for name in archive.namelist()}
    for name, compression in [("stored.3mf", zipfile.ZIP_STORED), ("deflated.3mf", zipfile.ZIP_DEFLATED)]:
        with zipfile.ZipFile(to_write(name, "surface", names=True, edges=False), "w", compression) as archive:
            for part, data in contents.items():
                archive.writestr(part, data)
    # Sizes of 64 bits and behind the data, as written to a pipe.
    with open(to_write("streamed.3mf", "surface", names=True, edges=False), "wb") as file:
        file.seekable = lambda: False
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            for part, data in contents.items():
                with archive.open(part, "w", force_zip64=True) as entry:
                    entry.write(data)


try:
    {"meshio": run_meshio, "gmsh": run_gmsh, "vtk": run_vtk, "zip": run_zip}[sys.argv[1]]()
except ImportError as error:
    print(error)
    sys.exit(77)
json.dump(written, open(path("written.json"), "w"))

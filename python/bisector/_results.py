"""Results: arrays that belong to the library, a report, and files."""

from __future__ import annotations

import ctypes
import json
import os
from ctypes import byref
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from ._library import Array, Attribute, Handle, call, path_bytes, text
from ._meshes import CORNER, ELEMENT, NUMBERS, VERTEX
from ._run import interruptible

_TYPES = (np.dtype(np.float64), np.dtype(np.uint32), np.dtype(np.int32))


def _view(handle: Handle, name: str) -> npt.NDArray[Any]:
    """The library's own numbers, not to be written to; they keep the result alive."""
    array = Array()
    call("result_array", handle.value, name.encode(), byref(array))
    dtype = _TYPES[array.type]
    shape = (array.rows, array.columns) if array.columns > 1 else (array.rows,)
    if array.rows == 0:
        return np.zeros(shape, dtype)
    buffer = (ctypes.c_char * (array.rows * array.columns * dtype.itemsize)).from_address(array.data)
    buffer._owner = handle
    view = np.frombuffer(buffer, dtype=dtype).reshape(shape)
    view.flags.writeable = False
    return view


def _marked(values: npt.NDArray[Any]) -> Optional[npt.NDArray[Any]]:
    return values if len(values) else None


class Result:
    """What a call made. Arrays are read-only; copy them to change them.

    Points, radii and energies are views of the library's memory; integers are copied to 64 bits when they are first
    asked for.
    """

    def __init__(self, handle: Handle) -> None:
        self._handle = handle
        self._arrays: "dict[str, npt.NDArray[Any]]" = {}
        self._report: "Optional[dict[str, Any]]" = None

    def _array(self, name: str) -> npt.NDArray[Any]:
        if name not in self._arrays:
            array = _view(self._handle, name)
            if array.dtype.kind in "iu":
                array = array.astype(np.int64)
                array.flags.writeable = False
            self._arrays[name] = array
        return self._arrays[name]

    @property
    def report(self) -> "dict[str, Any]":
        """The report of docs/cli.md, "Report keys". The first use measures what only the report tells, such as the
        distance to the input, and may take a while; Ctrl-C ends it."""
        if self._report is None:
            handle = self._handle
            self._report = json.loads(interruptible(lambda callbacks: text("result_report", handle.value, callbacks)))
        return self._report

    def save_report(self, path: "str | os.PathLike[str]") -> None:
        """Writes `report` as JSON, or, if the name ends in .html, as a page with input and result in 3D views."""
        self._save(path, "report")

    def _save(self, path: "str | os.PathLike[str]", what: str) -> None:
        handle, name = self._handle, path_bytes(path)
        interruptible(lambda callbacks: call("result_save", handle.value, what.encode(), name, callbacks))


class _WithData(Result):
    """Results that have the attributes of their input."""

    def __init__(self, handle: Handle) -> None:
        super().__init__(handle)
        self._data: "Optional[dict[int, dict[str, npt.NDArray[Any]]]]" = None

    def _all_data(self, site: int) -> "dict[str, npt.NDArray[Any]]":
        if self._data is None:
            data: "dict[int, dict[str, npt.NDArray[Any]]]" = {VERTEX: {}, ELEMENT: {}, CORNER: {}}
            count, at = ctypes.c_size_t(), Attribute()
            call("result_attribute_count", self._handle.value, byref(count))
            for index in range(count.value):
                call("result_attribute", self._handle.value, index, byref(at))
                values = np.zeros(0)
                if at.count:
                    buffer = (ctypes.c_double * at.count).from_address(at.values)
                    values = np.frombuffer(buffer, dtype=np.float64).astype(NUMBERS[at.number])
                shape = ((-1, 3) if at.site == CORNER else (-1,)) + ((at.components,) if at.components > 1 else ())
                values = values.reshape(shape)
                values.flags.writeable = False
                data[at.site][at.name.decode("utf-8", "replace")] = values
            self._data = data
        return dict(self._data[site])

    @property
    def vertex_data(self) -> "dict[str, npt.NDArray[Any]]":
        """The numbers of the input's vertices, by name, at those of the result: (n,) or (n, k), of the input's type."""
        return self._all_data(VERTEX)


class SurfaceResult(Result):
    """Triangles."""

    @property
    def vertices(self) -> npt.NDArray[np.float64]:
        """(n, 3) float64, in the input's unit."""
        return self._array("vertices")

    @property
    def faces(self) -> npt.NDArray[np.int64]:
        """(m, 3) int64: the vertices of each triangle, counter-clockwise seen from outside."""
        return self._array("faces")

    @property
    def labels(self) -> Optional[npt.NDArray[np.int64]]:
        """(m,) int64: the label of each triangle, or None."""
        return _marked(self._array("labels"))

    def save(self, path: "str | os.PathLike[str]") -> None:
        """Writes the mesh as `-o` of the command does, byte for byte, by the extension of the name.

        Raises Error if the format is unknown or the file cannot be written; warns of what the format does not hold.
        """
        self._save(path, "output")

    def save_preview(self, path: "str | os.PathLike[str]") -> None:
        """Draws a picture, as .png."""
        self._save(path, "preview")

    def _cells(self) -> "list[tuple[str, npt.NDArray[np.int64]]]":
        return [("triangle", self.faces)]

    def _cell_data(self) -> "dict[str, list[npt.NDArray[Any]]]":
        return {} if self.labels is None else {"label": [self.labels]}

    def _point_data(self) -> "dict[str, npt.NDArray[Any]]":
        return {}

    def _face_data(self) -> "dict[str, npt.NDArray[Any]]":
        return {}

    def to_meshio(self) -> Any:
        """A meshio.Mesh, with labels and data."""
        import meshio

        return meshio.Mesh(self.vertices.copy(), self._cells(), point_data=self._point_data(),
                           cell_data=self._cell_data())

    def to_trimesh(self) -> Any:
        """A trimesh.Trimesh with the same vertices and faces, with data and colours; labels are its face attribute
        `label`."""
        import trimesh

        attributes = self._face_data()
        if self.labels is not None:
            attributes["label"] = self.labels.copy()
        points = self._point_data()
        colours = points.pop("color", None)
        return trimesh.Trimesh(self.vertices.copy(), self.faces.copy(), face_attributes=attributes,
                               vertex_attributes=points, vertex_colors=colours, process=False)

    def to_pyvista(self) -> Any:
        """A pyvista.PolyData, with the labels as cell data."""
        import pyvista

        threes = np.full((len(self.faces), 1), 3, dtype=np.int64)
        mesh = pyvista.PolyData(self.vertices.copy(), np.hstack([threes, self.faces]).reshape(-1))
        if self.labels is not None:
            mesh.cell_data["label"] = self.labels.copy()
        _add_data(mesh, self._point_data(), self._face_data())
        return mesh


def _copies(data: "dict[str, npt.NDArray[Any]]") -> "dict[str, npt.NDArray[Any]]":
    return {name: values.copy() for name, values in data.items()}


def _add_data(mesh: Any, points: "dict[str, npt.NDArray[Any]]", cells: "dict[str, npt.NDArray[Any]]") -> None:
    for name, values in points.items():
        mesh.point_data[name] = values
    for name, values in cells.items():
        mesh.cell_data[name] = values


class RemeshResult(SurfaceResult, _WithData):
    """A remeshed surface; labels and data are those of the input at the same place."""

    @property
    def face_data(self) -> "dict[str, npt.NDArray[Any]]":
        """The numbers of the input's faces, by name: (m,) or (m, k)."""
        return self._all_data(ELEMENT)

    @property
    def corner_data(self) -> "dict[str, npt.NDArray[Any]]":
        """Those of the corners of its faces, as texture coordinates: (m, 3) or (m, 3, k)."""
        return self._all_data(CORNER)

    @property
    def map(self) -> "tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]":
        """With `map=True`: the face of the input that each vertex is on (n,), and the weights of the corners of a
        triangle of that face there (n, 3)."""
        return self._array("map_faces"), self._array("map_weights")

    def save_map(self, path: "str | os.PathLike[str]") -> None:
        """With `map=True`: writes lines of a face, three of its vertices and their weights, for each vertex."""
        self._save(path, "map")

    def _point_data(self) -> "dict[str, npt.NDArray[Any]]":
        return _copies(self.vertex_data)

    def _face_data(self) -> "dict[str, npt.NDArray[Any]]":
        return _copies(self.face_data)

    def _cell_data(self) -> "dict[str, list[npt.NDArray[Any]]]":
        return {**super()._cell_data(), **{name: [values] for name, values in self._face_data().items()}}

    @property
    def kept(self) -> npt.NDArray[np.int64]:
        """(n,) the vertex of the input that each is, by keep_vertices or keep_faces, or -1; empty if nothing is kept."""
        of_input = self._array("kept")
        return np.where(of_input == 0xffffffff, -1, of_input)

    @property
    def feature_edges(self) -> npt.NDArray[np.int64]:
        """(k, 2) int64: the edges along the input's features, the lower vertex first."""
        return self._array("feature_edges")

    def save_features(self, path: "str | os.PathLike[str]") -> None:
        """Writes the feature edges as lines of two vertices."""
        self._save(path, "feature-output")


class TetResult(SurfaceResult, _WithData):
    """Tetrahedra. `faces` are the triangles of the boundary and of interfaces between regions, and `labels` theirs;
    the vertices of these come first."""

    @property
    def cell_data(self) -> "dict[str, npt.NDArray[Any]]":
        """The numbers of the input's tetrahedra, by name: (t,) or (t, k)."""
        return self._all_data(ELEMENT)

    def _point_data(self) -> "dict[str, npt.NDArray[Any]]":
        return _copies(self.vertex_data)

    @property
    def tets(self) -> npt.NDArray[np.int64]:
        """(t, 4) int64: the vertices of each tetrahedron, whose volume is positive."""
        return self._array("tets")

    @property
    def regions(self) -> Optional[npt.NDArray[np.int64]]:
        """(t,) int64: the region of each tetrahedron, or None."""
        return _marked(self._array("regions"))

    @property
    def feature_edges(self) -> npt.NDArray[np.int64]:
        """(k, 2) int64: the edges along the boundary's features."""
        return self._array("feature_edges")

    @property
    def node_edges(self) -> npt.NDArray[np.int64]:
        """With `order=2`: (k, 2) int64, the edges of all tetrahedra, the lower vertex first, sorted."""
        return self._array("node_edges")

    @property
    def edge_nodes(self) -> npt.NDArray[np.float64]:
        """With `order=2`: (k, 3) float64, the node on each of `node_edges`."""
        return self._array("edge_nodes")

    def _nodes_of(self, cells: npt.NDArray[np.int64], pairs: "list[tuple[int, int]]") -> npt.NDArray[np.int64]:
        """Cells with their nodes behind the corners, numbered from the last vertex on."""
        edges = self.node_edges
        keys = edges[:, 0] * len(self.vertices) + edges[:, 1]  # ascending
        nodes = []
        for a, b in pairs:
            ends = np.sort(cells[:, [a, b]], axis=1)
            nodes.append(np.searchsorted(keys, ends[:, 0] * len(self.vertices) + ends[:, 1]) + len(self.vertices))
        return np.column_stack([cells, *nodes])

    def to_meshio(self) -> Any:
        """A meshio.Mesh, with labels and data; with `order=2` of cells "tetra10" and "triangle6"."""
        mesh = super().to_meshio()
        if len(self.node_edges) == 0:
            return mesh
        import meshio

        ends = self.node_edges
        data = {}
        for name, values in self._point_data().items():
            first, second = values[ends[:, 0]], values[ends[:, 1]]
            data[name] = np.concatenate([values, (first + second) / 2 if values.dtype.kind == "f" else first])
        threes = [(0, 1), (1, 2), (2, 0)]
        cells = [("tetra10", self._nodes_of(self.tets, [*threes, (0, 3), (1, 3), (2, 3)])),
                 ("triangle6", self._nodes_of(self.faces, threes))]
        return meshio.Mesh(np.concatenate([self.vertices, self.edge_nodes]), cells, point_data=data,
                           cell_data=mesh.cell_data)

    def save_boundary(self, path: "str | os.PathLike[str]") -> None:
        """Writes the boundary as a surface."""
        self._save(path, "boundary")

    def _cells(self) -> "list[tuple[str, npt.NDArray[np.int64]]]":
        return [("tetra", self.tets), ("triangle", self.faces)]

    def _cell_data(self) -> "dict[str, list[npt.NDArray[Any]]]":
        data = {}
        for name, values in self.cell_data.items():  # triangles have none
            none = np.nan if values.dtype.kind == "f" else 0
            data[name] = [values.copy(), np.full((len(self.faces), *values.shape[1:]), none, values.dtype)]
        if self.labels is None and self.regions is None:
            return data
        regions = np.zeros(len(self.tets), np.int64) if self.regions is None else self.regions
        labels = np.zeros(len(self.faces), np.int64) if self.labels is None else self.labels
        return {"label": [regions, labels], **data}

    def to_trimesh(self) -> Any:
        """The boundary as a trimesh.Trimesh, over all vertices."""
        return super().to_trimesh()

    def to_pyvista(self) -> Any:
        """A pyvista.UnstructuredGrid of the tetrahedra, with the regions as cell data."""
        import pyvista

        fours = np.full((len(self.tets), 1), 4, dtype=np.int64)
        kinds = np.full(len(self.tets), 10, dtype=np.uint8)
        grid = pyvista.UnstructuredGrid(np.hstack([fours, self.tets]).reshape(-1), kinds, self.vertices.copy())
        if self.regions is not None:
            grid.cell_data["region"] = self.regions.copy()
        _add_data(grid, self._point_data(), _copies(self.cell_data))
        return grid


class SegmentResult(SurfaceResult):
    """The input's triangles; `labels` are their regions, and report["segmentation"]["regions"] has the surfaces."""

    def __init__(self, handle: Handle, has_polygons: bool) -> None:
        super().__init__(handle)
        self._has_polygons = has_polygons

    @property
    def polygons(self) -> "Optional[tuple[npt.NDArray[np.float64], list[npt.NDArray[np.int64]]]]":
        """With `polygons=True`: vertices (n, 3) and the corners of each polygon; else None."""
        if not self._has_polygons:
            return None
        offsets = self._array("polygon_offsets")
        corners = self._array("polygon_corners")
        return self._array("polygon_vertices"), np.split(corners, offsets[1:-1])

    @property
    def polygon_labels(self) -> Optional[npt.NDArray[np.int64]]:
        """The region of each polygon, or None."""
        return self._array("polygon_labels") if self._has_polygons else None

    def save_polygons(self, path: "str | os.PathLike[str]") -> None:
        """Writes the polygons, for which the call needs `polygons=True`."""
        self._save(path, "polygons")

    def save_json(self, path: "str | os.PathLike[str]") -> None:
        """Writes the surfaces with the loops that trim them, which bisector-step reads."""
        self._save(path, "json")


class TreeResult(SurfaceResult):
    """The branches of trees as closed surfaces; `labels` are the branches of the triangles."""

    @property
    def nodes(self) -> npt.NDArray[np.float64]:
        """(k, 3) float64: points on the axes of branches, parents first."""
        return self._array("nodes")

    @property
    def node_radii(self) -> npt.NDArray[np.float64]:
        """(k,) float64, in the points' unit."""
        return self._array("node_radii")

    @property
    def node_parents(self) -> npt.NDArray[np.int64]:
        """(k,) int64: the node that each grows from; -1: a root."""
        return self._array("node_parents")

    @property
    def node_branches(self) -> npt.NDArray[np.int64]:
        """(k,) int64: the branch of each node."""
        return self._array("node_branches")

    @property
    def point_branches(self) -> npt.NDArray[np.int64]:
        """The branch of each point of the scan; -1: none."""
        return self._array("point_branches")

    def save_skeleton(self, path: "str | os.PathLike[str]") -> None:
        """Writes the axes with radii, as .ply."""
        self._save(path, "skeleton")

    def save_cylinders(self, path: "str | os.PathLike[str]") -> None:
        """Writes the branches as cylinders, as .csv in the columns of TreeQSM."""
        self._save(path, "cylinders")

    def save_labels(self, path: "str | os.PathLike[str]") -> None:
        """Writes the points with their branches, as .ply."""
        self._save(path, "labels")


class DiagramResult(Result):
    """A restricted Voronoi diagram: one cell for each seed."""

    @property
    def seeds(self) -> npt.NDArray[np.float64]:
        """(n, 3) float64."""
        return self._array("seeds")

    @property
    def masses(self) -> npt.NDArray[np.float64]:
        """(n,) float64: the area of each cell; 0: it is empty."""
        return self._array("masses")

    @property
    def centroids(self) -> npt.NDArray[np.float64]:
        """(n, 3) float64; not a number for empty cells."""
        return self._array("centroids")

    @property
    def energies(self) -> npt.NDArray[np.float64]:
        """(n,) float64: the integral of the squared distance to the seed over its cell."""
        return self._array("energies")

    @property
    def rdt(self) -> npt.NDArray[np.int64]:
        """(k, 3) int64: the restricted Delaunay triangulation, each triple ascending, sorted."""
        return self._array("rdt")

    @property
    def dual_tets(self) -> npt.NDArray[np.int64]:
        """(l, 4) int64: of a solid, four seeds whose cells meet in a point inside, each ascending, sorted."""
        return self._array("dual_tets")

    @property
    def pairs(self) -> npt.NDArray[np.int64]:
        """(p, 2) int64: each face of the input, or tetrahedron, and cell that meet, sorted."""
        return self._array("pairs")

    @property
    def polygons(self) -> "tuple[npt.NDArray[np.float64], npt.NDArray[np.int64], npt.NDArray[np.int64]]":
        """The cells cut up by the input's triangles: corners (c, 3); offsets (q + 1,), polygon k having the corners
        offsets[k] to offsets[k + 1]; and the cell of each polygon (q,)."""
        return self._array("polygon_vertices"), self._array("polygon_offsets"), self._array("polygon_cells")

    def save(self, path: "str | os.PathLike[str]") -> None:
        """Writes the cells as coloured polygons, as .ply, or those of a solid as polyhedra, as .vtu."""
        self._save(path, "output")

    def save_pairs(self, path: "str | os.PathLike[str]") -> None:
        """Writes `pairs` as lines."""
        self._save(path, "pairs")

    def save_preview(self, path: "str | os.PathLike[str]") -> None:
        """Draws a picture of the cells, as .png."""
        self._save(path, "preview")

"""Meshes of callers to the library's: files, arrays, and objects of trimesh, PyVista and meshio."""

from __future__ import annotations

import ctypes
import os
from ctypes import byref
from dataclasses import dataclass, field, replace
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from ._errors import Error
from ._library import Attribute, Handle, MeshArrays, path_bytes

VERTEX, ELEMENT, CORNER = range(3)  # sites of attributes
NUMBERS = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64")

Points = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


@dataclass
class Data:
    """Numbers of each vertex, face, tetrahedron or corner of a face."""

    name: str
    site: int
    values: npt.NDArray[Any]  # (n,) or (n, k)


def data_of(name: str, site: int, values: Any) -> Optional[Data]:
    """None for what is no numbers."""
    array = np.asarray(values)
    if array.dtype.kind == "b":
        array = array.astype(np.uint8)
    elif array.dtype.kind == "f" and array.dtype.itemsize not in (4, 8):
        array = array.astype(np.float32 if array.dtype.itemsize < 4 else np.float64)
    if array.dtype.name not in NUMBERS or array.ndim == 0 or array.size == 0:
        return None
    array = array.reshape(array.shape[0], -1) if array.ndim > 2 else array
    return Data(name, site, array)


def all_data(named: Any, site: int, *others: str) -> "list[Data]":
    """Of all numbers in a mapping but those called as others."""
    data = [data_of(str(name), site, named[name]) for name in named.keys() if name not in others]
    return [item for item in data if item is not None]


def _given_data(what: str, site: int, named: Any) -> "list[Data]":
    """Of a caller's dict, where all are numbers."""
    data = []
    for name, values in ({} if named is None else named).items():
        if site == CORNER:
            values = np.asarray(values)
            if values.ndim < 2 or values.shape[1] != 3:
                raise Error(f"{what}['{name}']: the shape {values.shape} is neither (m, 3) nor (m, 3, k)")
            values = values.reshape(values.shape[0] * 3, -1)
        item = data_of(str(name), site, values)
        if item is None:
            raise Error(f"{what}['{name}']: these are no numbers; give an array of them")
        data.append(item)
    return data


@dataclass
class Arrays:
    """A mesh in memory; indices count from 0."""

    vertices: Points                    # (n, 3)
    faces: Optional[Indices] = None     # (m, 3), or with offsets the corners of all faces
    offsets: Optional[Indices] = None   # (m + 1,)
    tets: Optional[Indices] = None      # (t, 4)
    labels: Optional[Indices] = None    # (m,)
    regions: Optional[Indices] = None   # (t,)
    feature_edges: Optional[Indices] = None  # (k, 2)
    data: "list[Data]" = field(default_factory=list)


def points(values: Any, name: str) -> Points:
    """(n, 3) numbers, or (n, 2), whose z is 0."""
    try:
        array = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise Error(f"{name}: these are no coordinates ({error}); give an (n, 3) array") from None
    if array.ndim == 2 and array.shape[1] == 2:
        array = np.column_stack([array, np.zeros(len(array))])
    if array.ndim != 2 or array.shape[1] != 3:
        raise Error(f"{name}: the shape {array.shape} is not (n, 3)")
    return array


def numbers(values: Any, name: str) -> Points:
    try:
        array = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise Error(f"{name}: these are no numbers ({error}); give one for each vertex") from None
    if array.ndim != 1:
        raise Error(f"{name}: the shape {array.shape} is not (n,)")
    return array


def indices(values: Any, columns: int, name: str) -> Indices:
    """(m, columns) whole numbers, or (m,) where columns is 0."""
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise Error(f"{name}: {error}") from None
    if array.size == 0 and array.ndim < 2:
        array = np.zeros((0, columns) if columns else (0,), dtype=np.int64)
    if array.dtype.kind not in "iu":
        raise Error(f"{name}: the type {array.dtype} is not one of whole numbers; convert it")
    if array.ndim != (2 if columns else 1) or (columns and array.shape[1] != columns):
        raise Error(f"{name}: the shape {array.shape} is not {f'(m, {columns})' if columns else '(m,)'}")
    if array.dtype == np.uint64 and array.size and array.max() > np.iinfo(np.int64).max:
        raise Error(f"{name}: {array.max()} is out of range")
    return np.ascontiguousarray(array, dtype=np.int64)


def _ragged(faces: Any) -> Arrays:
    """Faces as (m, k) rows or as a list of lists of corners."""
    try:
        array = np.asarray(faces)
    except ValueError:
        array = np.zeros((0, 0, 0))
    if array.ndim == 2 and array.shape[1] == 3 or array.size == 0 and array.ndim == 1:
        return Arrays(np.zeros((0, 3)), indices(array, 3, "faces"))
    if array.ndim == 2 and array.shape[1] > 3:
        corners = indices(array, array.shape[1], "faces")
        return Arrays(np.zeros((0, 3)), corners.reshape(-1), np.arange(len(corners) + 1) * array.shape[1])
    try:
        rows = [np.asarray(face) for face in faces]
    except TypeError:
        rows = []
    if not rows or any(row.ndim != 1 or (row.size and row.dtype.kind not in "iu") for row in rows):
        raise Error("faces: give an (m, 3) array of whole numbers, or a list of faces, each a list of corners")
    offsets = np.concatenate([[0], np.cumsum([len(row) for row in rows])])
    return Arrays(np.zeros((0, 3)), np.concatenate(rows).astype(np.int64), offsets.astype(np.int64))


def _from_vtk_faces(faces: Any) -> "tuple[Indices, Indices]":
    """The corners and offsets of VTK's [3, a, b, c, 4, d, ...]."""
    stream = np.asarray(faces, dtype=np.int64)
    starts, at = [], 0
    if stream.size % 4 == 0 and np.all(stream[::4] == 3):
        return stream.reshape(-1, 4)[:, 1:].reshape(-1), np.arange(stream.size // 4 + 1) * 3
    while at < stream.size:
        starts.append(at)
        at += int(stream[at]) + 1
    degrees = stream[starts]
    keep = np.ones(stream.size, dtype=bool)
    keep[starts] = False
    return stream[keep], np.concatenate([[0], np.cumsum(degrees)])


def _from_pyvista(mesh: Any) -> Arrays:
    vertices = points(mesh.points, "points")
    corners, offsets = _from_vtk_faces(mesh.faces)
    arrays = Arrays(vertices, corners, offsets)
    if "label" in mesh.cell_data and len(offsets) - 1 == mesh.n_cells:
        arrays.labels = indices(mesh.cell_data["label"], 0, "cell_data['label']")
    arrays.data = all_data(getattr(mesh, "point_data", {}), VERTEX)
    if len(offsets) - 1 == mesh.n_cells:
        arrays.data += all_data(mesh.cell_data, ELEMENT, "label")
    return arrays


def _from_grid(mesh: Any) -> Arrays:
    """Of a pyvista.UnstructuredGrid the triangles, quadrangles and tetrahedra."""
    vertices = points(mesh.points, "points")
    kinds = np.asarray(mesh.celltypes)
    known = {5: 3, 9: 4, 10: 4}  # VTK's numbers of cell types: corners
    other = set(kinds.tolist()) - set(known)
    if other:
        raise Error(f"cells of VTK's types {sorted(other)} are not read; convert them to triangles or tetrahedra")
    starts, stream = np.asarray(mesh.offset, dtype=np.int64)[:-1], np.asarray(mesh.cell_connectivity, dtype=np.int64)
    tets = kinds == 10
    arrays = Arrays(vertices)
    if tets.any():
        arrays.tets = stream[starts[tets][:, None] + np.arange(4)]
    if not tets.all():
        degrees = np.array([known[kind] for kind in kinds[~tets].tolist()], dtype=np.int64)
        arrays.offsets = np.concatenate([[0], np.cumsum(degrees)]).astype(np.int64)
        arrays.faces = np.concatenate([stream[s:s + d] for s, d in zip(starts[~tets], degrees)])
    if not tets.all() and "label" in mesh.cell_data:
        arrays.labels = indices(np.asarray(mesh.cell_data["label"])[~tets], 0, "cell_data['label']")
    if tets.any() and "region" in mesh.cell_data:
        arrays.regions = indices(np.asarray(mesh.cell_data["region"])[tets], 0, "cell_data['region']")
    chosen = tets if tets.any() else ~tets
    arrays.data = all_data(getattr(mesh, "point_data", {}), VERTEX) + all_data(
        {name: np.asarray(mesh.cell_data[name])[chosen] for name in mesh.cell_data.keys()}, ELEMENT, "label", "region")
    return arrays


# Names of numbers of cells, as readers of files know them.
_MARKS = ("label", "region", "medit:ref", "gmsh:physical", "gmsh:geometrical")


def _from_meshio(mesh: Any) -> Arrays:
    vertices = points(mesh.points, "points")
    rows: "list[Indices]" = []
    degrees: "list[Indices]" = []
    tets: "list[Indices]" = []
    edges: "list[Indices]" = []
    labels: "list[Any]" = []
    regions: "list[Any]" = []
    marks = next((name for name in _MARKS if name in mesh.cell_data), None)
    for number, block in enumerate(mesh.cells):
        mark = None if marks is None else np.asarray(mesh.cell_data[marks][number])
        if block.type in ("triangle", "quad") or block.type.startswith("polygon"):
            faces = [np.asarray(block.data)] if np.ndim(block.data) == 2 else [np.atleast_2d(f) for f in block.data]
            rows += [face.reshape(-1) for face in faces]
            degrees += [np.full(len(face), face.shape[1]) for face in faces]
            labels.append(mark)
        elif block.type == "tetra":
            tets.append(np.asarray(block.data))
            regions.append(mark)
        elif block.type == "line":
            edges.append(np.asarray(block.data))
        elif block.type != "vertex":
            raise Error(f"cells of type '{block.type}' are not read; convert them to triangles or tetrahedra")
    arrays = Arrays(vertices)
    if rows:
        arrays.faces = np.concatenate(rows).astype(np.int64)
        arrays.offsets = np.concatenate([[0], np.cumsum(np.concatenate(degrees))]).astype(np.int64)
    if tets:
        arrays.tets = np.concatenate(tets).astype(np.int64)
    if edges:
        arrays.feature_edges = np.concatenate(edges).astype(np.int64)
    if marks is not None:
        if rows and any(np.any(mark) for mark in labels):
            arrays.labels = np.concatenate(labels).astype(np.int64)
        if tets and any(np.any(mark) for mark in regions):
            arrays.regions = np.concatenate(regions).astype(np.int64)
    elements = [number for number, block in enumerate(mesh.cells)
                if (block.type == "tetra" if tets else block.type not in ("line", "vertex"))]
    arrays.data = all_data(getattr(mesh, "point_data", {}), VERTEX) + all_data(
        {name: np.concatenate([np.asarray(blocks[number]) for number in elements])
         for name, blocks in mesh.cell_data.items() if name != marks and elements}, ELEMENT)
    return arrays


def _from_faces(mesh: Any) -> Arrays:
    """Of a trimesh.Trimesh, a result or what else has vertices and faces."""
    arrays = replace(_ragged(mesh.faces), vertices=points(mesh.vertices, "vertices"))
    arrays.data = all_data(getattr(mesh, "vertex_attributes", {}), VERTEX) + all_data(
        getattr(mesh, "face_attributes", {}), ELEMENT, "label")
    arrays.data += _given_data("vertex_data", VERTEX, getattr(mesh, "vertex_data", None))
    arrays.data += _given_data("face_data", ELEMENT, getattr(mesh, "face_data", None))
    arrays.data += _given_data("corner_data", CORNER, getattr(mesh, "corner_data", None))
    visual = getattr(mesh, "visual", None)
    coloured = getattr(visual, "kind", None) == "vertex"
    for name, values in (("color", getattr(visual, "vertex_colors", None) if coloured else None),
                         ("texcoord", getattr(visual, "uv", None))):
        item = None if values is None else data_of(name, VERTEX, values)
        if item is not None:
            arrays.data.append(item)
    label = getattr(mesh, "face_attributes", {}).get("label")
    if label is not None:
        arrays.labels = indices(label, 0, "face_attributes['label']")
    return arrays


def arrays_of(mesh: Any) -> Arrays:
    """Arrays, by what the object has rather than by its class: none of the packages is imported."""
    if isinstance(mesh, Arrays):
        return mesh
    if hasattr(mesh, "points") and hasattr(mesh, "cells") and hasattr(mesh, "cell_data") and isinstance(
            mesh.cells, list):
        return _from_meshio(mesh)
    if hasattr(mesh, "points") and hasattr(mesh, "faces") and hasattr(mesh, "n_cells"):
        return _from_pyvista(mesh)
    if hasattr(mesh, "points") and hasattr(mesh, "celltypes"):
        return _from_grid(mesh)
    if hasattr(mesh, "vertices") and hasattr(mesh, "tets"):
        return Arrays(points(mesh.vertices, "vertices"), tets=indices(mesh.tets, 4, "tets"),
                      data=_given_data("vertex_data", VERTEX, getattr(mesh, "vertex_data", None)) +
                      _given_data("cell_data", ELEMENT, getattr(mesh, "cell_data", None)))
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        return _from_faces(mesh)
    if isinstance(mesh, (tuple, list)) and len(mesh) == 2:
        return replace(_ragged(mesh[1]), vertices=points(mesh[0], "vertices"))
    raise Error(f"a {type(mesh).__name__} is no mesh; give the path of a file, (vertices, faces), or a mesh of trimesh, "
                "PyVista or meshio")


MeshLike = Union[str, "os.PathLike[str]", "tuple[Any, Any]", Any]


def _address(array: Optional[npt.NDArray[Any]]) -> Optional[int]:
    return None if array is None or array.size == 0 else array.ctypes.data


def mesh_handle(mesh: MeshLike, labels: Any = None, feature_edges: Any = None, vertex_data: Any = None,
                face_data: Any = None, corner_data: Any = None, cell_data: Any = None) -> Handle:
    extra = {"labels": labels, "feature_edges": feature_edges, "vertex_data": vertex_data, "face_data": face_data,
             "corner_data": corner_data, "cell_data": cell_data}
    if isinstance(mesh, (str, os.PathLike)):
        if any(value is not None for value in extra.values()):
            raise Error("labels, feature_edges and data belong to a mesh in memory; a file has its own")
        return Handle.made_by("mesh", "mesh_from_file", path_bytes(mesh))
    arrays = replace(arrays_of(mesh))
    if cell_data is not None and arrays.tets is None or face_data is not None and arrays.tets is not None:
        raise Error("cell_data are of tetrahedra, face_data of surfaces; give those that fit the mesh")
    given = (_given_data("vertex_data", VERTEX, vertex_data) + _given_data("face_data", ELEMENT, face_data) +
             _given_data("corner_data", CORNER, corner_data) + _given_data("cell_data", ELEMENT, cell_data))
    names = {(item.name, item.site) for item in given}
    arrays.data = [item for item in arrays.data if (item.name, item.site) not in names] + given
    if labels is not None:
        arrays.labels = indices(labels, 0, "labels")
    if feature_edges is not None:
        arrays.feature_edges = indices(feature_edges, 2, "feature_edges")
    return arrays_handle(arrays)


def points_handle(values: Any) -> Handle:
    if isinstance(values, (str, os.PathLike)):
        return mesh_handle(values)
    if hasattr(values, "points"):
        values = values.points
    elif hasattr(values, "vertices"):
        values = values.vertices
    return arrays_handle(Arrays(points(values, "points")))


def tet_arrays(mesh: Any) -> Arrays:
    """Like arrays_of; of a pair (V, C) rows of four are tetrahedra."""
    if isinstance(mesh, (tuple, list)) and len(mesh) == 2 and np.ndim(mesh[1]) == 2 and np.shape(mesh[1])[1] == 4:
        return Arrays(points(mesh[0], "vertices"), tets=indices(mesh[1], 4, "tets"))
    return arrays_of(mesh)


def tets_handle(mesh: MeshLike, labels: Any = None, feature_edges: Any = None, vertex_data: Any = None,
                cell_data: Any = None) -> Handle:
    """Like mesh_handle, of what tet_arrays takes."""
    return mesh_handle(mesh if isinstance(mesh, (str, os.PathLike)) else tet_arrays(mesh), labels, feature_edges,
                       vertex_data, cell_data=cell_data)


def arrays_handle(arrays: Arrays) -> Handle:
    given = MeshArrays()
    given.size = ctypes.sizeof(MeshArrays)
    given.vertices, given.vertex_count = _address(arrays.vertices), len(arrays.vertices)
    if arrays.offsets is not None:
        given.face_count = len(arrays.offsets) - 1
        offsets = np.ascontiguousarray(arrays.offsets, dtype=np.int64)
        given.face_offsets = _address(offsets)
    elif arrays.faces is not None:
        given.face_count = len(arrays.faces)
    given.faces = _address(arrays.faces)
    for name, count in (("tets", "tet_count"), ("labels", "label_count"), ("regions", "region_count"),
                        ("feature_edges", "edge_count")):
        array = getattr(arrays, name)
        setattr(given, name, _address(array))
        setattr(given, count, 0 if array is None else len(array))
    values = [np.ascontiguousarray(item.values, dtype=np.float64) for item in arrays.data]
    attributes = (Attribute * max(1, len(values)))()
    for to, item, array in zip(attributes, arrays.data, values):
        to.name, to.site, to.number = item.name.encode(), item.site, NUMBERS.index(item.values.dtype.name)
        to.components = array.shape[1] if array.ndim == 2 else 1
        to.values, to.count = _address(array), array.size
    given.attributes, given.attribute_count = ctypes.addressof(attributes), len(values)
    return Handle.made_by("mesh", "mesh_from_arrays", byref(given))

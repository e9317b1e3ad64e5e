"""Meshes of callers to the library's: files, arrays, and objects of trimesh, PyVista and meshio."""

from __future__ import annotations

import ctypes
import os
from ctypes import byref
from dataclasses import dataclass, replace
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from ._errors import Error
from ._library import Handle, MeshArrays, path_bytes

Points = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


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
        return Arrays(points(mesh.vertices, "vertices"), tets=indices(mesh.tets, 4, "tets"))
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        return replace(_ragged(mesh.faces), vertices=points(mesh.vertices, "vertices"))
    if isinstance(mesh, (tuple, list)) and len(mesh) == 2:
        return replace(_ragged(mesh[1]), vertices=points(mesh[0], "vertices"))
    raise Error(f"a {type(mesh).__name__} is no mesh; give the path of a file, (vertices, faces), or a mesh of trimesh, "
                "PyVista or meshio")


MeshLike = Union[str, "os.PathLike[str]", "tuple[Any, Any]", Any]


def _address(array: Optional[npt.NDArray[Any]]) -> Optional[int]:
    return None if array is None or array.size == 0 else array.ctypes.data


def mesh_handle(mesh: MeshLike, labels: Any = None, feature_edges: Any = None) -> Handle:
    if isinstance(mesh, (str, os.PathLike)):
        if labels is not None or feature_edges is not None:
            raise Error("labels and feature_edges belong to a mesh in memory; a file has its own")
        return Handle.made_by("mesh", "mesh_from_file", path_bytes(mesh))
    arrays = replace(arrays_of(mesh))
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


def tets_handle(mesh: MeshLike, labels: Any = None, feature_edges: Any = None) -> Handle:
    """Like mesh_handle, of what tet_arrays takes."""
    return mesh_handle(mesh if isinstance(mesh, (str, os.PathLike)) else tet_arrays(mesh), labels, feature_edges)


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
    return Handle.made_by("mesh", "mesh_from_arrays", byref(given))

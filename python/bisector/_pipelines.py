"""The commands of the program as functions. Keywords are its options, which docs/cli.md explains; None is the default
that it tells. A value is checked by the code that reads the command line."""

from __future__ import annotations

import json
import os
from typing import Any, Mapping, Optional, Union

import numpy as np

from . import _meshes
from ._errors import Error
from ._library import Handle, call, text
from ._meshes import MeshLike
from ._results import DiagramResult, RemeshResult, SegmentResult, TetResult, TreeResult
from ._run import ProgressCallback, interruptible, set_options

Path = Union[str, "os.PathLike[str]"]
Number = Union[int, float]


def _is_word(value: Any) -> bool:
    return isinstance(value, (str, os.PathLike))


def _options(command: str, values: "dict[str, Any]", seeds: Any = None, density: Any = None) -> Handle:
    options = Handle.made_by("options", "options_new", command.encode())
    if seeds is not None and not _is_word(seeds):
        array = _meshes.points(seeds, "seeds")
        call("options_seeds", options.value, array.ctypes.data, len(array))
    else:
        values = {**values, "seeds": seeds}
    if density is not None and not _is_word(density):
        array = _meshes.numbers(density, "density")
        call("options_density", options.value, array.ctypes.data, len(array))
    else:
        values = {**values, "density": density}
    set_options(options, command, values)
    return options


def _words(given: "dict[str, Any]", *others: str) -> "dict[str, Any]":
    return {name: value for name, value in given.items() if name not in others}


def _run(options: Handle, mesh: Handle, progress: Optional[ProgressCallback]) -> Handle:
    return interruptible(
        lambda callbacks: Handle.made_by("result", "run", options.value, mesh.value, callbacks), progress)


def remesh(
    mesh: MeshLike,
    n: Optional[int] = None,
    *,
    edge_length: Optional[Number] = None,
    edge_length_relative: Optional[Number] = None,
    seeds: Any = None,
    random_seed: Optional[int] = None,
    density: Any = None,
    gradation: Optional[Number] = None,
    edge_min: Optional[Number] = None,
    edge_max: Optional[Number] = None,
    distance_max: Optional[Number] = None,
    distance_max_relative: Optional[Number] = None,
    vertices_max: Optional[int] = None,
    features: Union[str, Number, None] = None,
    detail: Optional[str] = None,
    feature_file: Optional[Path] = None,
    keep_vertices: Any = None,
    keep_faces: Any = None,
    weld: Optional[Number] = None,
    wrap: Union[bool, Number, None] = None,
    topology: Optional[str] = None,
    energy: Optional[str] = None,
    min_angle: Optional[Number] = None,
    fit: Optional[bool] = None,
    iterations: Optional[int] = None,
    tolerance: Optional[Number] = None,
    levels: Optional[int] = None,
    device: Optional[str] = None,
    precision: Optional[str] = None,
    neighbors: Optional[str] = None,
    threads: Optional[int] = None,
    checkpoint: Optional[Path] = None,
    checkpoint_every: Optional[Number] = None,
    resume: Optional[bool] = None,
    map: bool = False,
    labels: Any = None,
    feature_edges: Any = None,
    vertex_data: "Optional[Mapping[str, Any]]" = None,
    face_data: "Optional[Mapping[str, Any]]" = None,
    corner_data: "Optional[Mapping[str, Any]]" = None,
    progress: Optional[ProgressCallback] = None,
) -> RemeshResult:
    """A high-quality triangle mesh of a surface, of n vertices or of a mean edge length.

    `mesh` is the path of a file in any format of docs/cli.md, (vertices, faces), or a mesh of trimesh, PyVista or
    meshio.
    Lengths are in its unit. `seeds` is an (n, 3) array of points to start from, or a file of them; `density` a word
    ("lfs", "curvature:2", "attribute:NAME") or one positive value for each vertex, edges being as long as its power
    -1/4. `labels` is (m,), a number for each face of a mesh in memory, and `feature_edges` (k, 2), edges of it to keep.
    `keep_vertices` and `keep_faces` are indices of what stays as it is, or files of them. With `distance_max` edges
    become shorter where a point of result or input may be farther from the other; report["distance"] has the bounds.

    Numbers of vertices, faces and their corners come with the mesh or in `vertex_data`, `face_data` and `corner_data`,
    dicts of arrays of n, m or (m, 3) rows by name, and are those of the result at the same place (docs/cli.md,
    "Attributes"). `map` asks for where on the input each vertex of the result is.

    `checkpoint` is a file that keeps what has been computed; with `resume` a run that was cut off goes on from it to
    the same result. It stays until you delete it.

    `progress` is called with a Progress now and then. Ctrl-C, or an exception in `progress`, ends the run within about
    a second. Raises Error for bad input and options, DeviceError if the device asked for is missing or fails, and
    MemoryError; warns with BisectorWarning.
    """
    given = locals()
    words = _words(given, "mesh", "seeds", "density", "labels", "feature_edges", "progress", "vertex_data", "face_data",
                   "corner_data")
    arrays = {name: words.pop(name) for name in ("keep_vertices", "keep_faces")
              if words[name] is not None and not _is_word(words[name])}
    options = _options("remesh", words, seeds, density)
    for name, kept in arrays.items():
        array = _meshes.indices(kept, 0, name)
        call(f"options_{name}", options.value, array.ctypes.data, len(array))
    return RemeshResult(_run(options, _meshes.mesh_handle(mesh, labels, feature_edges, vertex_data, face_data, corner_data),
                             progress))


def tetrahedralize(
    mesh: MeshLike,
    n: Optional[int] = None,
    *,
    edge_length: Optional[Number] = None,
    edge_length_relative: Optional[Number] = None,
    seeds: Any = None,
    random_seed: Optional[int] = None,
    density: Any = None,
    sizes: Any = None,
    gradation: Optional[Number] = None,
    edge_min: Optional[Number] = None,
    edge_max: Optional[Number] = None,
    features: Union[str, Number, None] = None,
    detail: Optional[str] = None,
    feature_file: Optional[Path] = None,
    weld: Optional[Number] = None,
    wrap: Union[bool, Number, None] = None,
    regions: Optional[bool] = None,
    min_angle: Optional[Number] = None,
    min_dihedral: Optional[Number] = None,
    order: Optional[int] = None,
    iterations: Optional[int] = None,
    tolerance: Optional[Number] = None,
    device: Optional[str] = None,
    precision: Optional[str] = None,
    neighbors: Optional[str] = None,
    threads: Optional[int] = None,
    checkpoint: Optional[Path] = None,
    checkpoint_every: Optional[Number] = None,
    resume: Optional[bool] = None,
    labels: Any = None,
    feature_edges: Any = None,
    vertex_data: "Optional[Mapping[str, Any]]" = None,
    cell_data: "Optional[Mapping[str, Any]]" = None,
    progress: Optional[ProgressCallback] = None,
) -> TetResult:
    """A high-quality tetrahedral mesh of a solid, of about n vertices or of a mean edge length.

    `mesh` is a closed surface as for remesh(), or tetrahedra: a file in a format that has them, (vertices, tets) with
    tets (t, 4), a TetResult, or a meshio.Mesh. `sizes` are edge lengths: one for each vertex of the mesh, a pair of
    points (k, 3) and lengths (k,), or a file, "FILE:NAME". A density makes edges as long as its power -1/5. The rest,
    what is raised and what is warned of are as for remesh(). Surfaces are filled by TetGen.

    Regions of tetrahedra are kept with the interfaces between them. With `regions` each part of space that a surface
    encloses is a region of its own; it may branch where several meet.

    Numbers of vertices and tetrahedra come with the mesh or in `vertex_data` and `cell_data`, and are those of the
    result at the same place; of a surface vertices inside have those of the nearest point of it.
    """
    given = locals()
    options = _options(
        "tet", _words(given, "mesh", "seeds", "density", "sizes", "labels", "feature_edges", "vertex_data", "cell_data",
                      "progress"), seeds, density)
    if sizes is not None and _is_word(sizes):
        set_options(options, "tet", {"sizes": sizes})
    elif sizes is not None:
        places, lengths, tets = _sizes(mesh, sizes)
        call("options_sizes", options.value, places.ctypes.data, lengths.ctypes.data, len(lengths),
             None if tets is None else tets.ctypes.data, 0 if tets is None else len(tets))
    return TetResult(_run(options, _meshes.tets_handle(mesh, labels, feature_edges, vertex_data, cell_data), progress))


def _sizes(mesh: Any, sizes: Any) -> "tuple[Any, Any, Any]":
    """Points, lengths, and the tetrahedra in which they are linear, or None."""
    if isinstance(sizes, (tuple, list)) and len(sizes) == 2 and np.ndim(sizes[0]) == 2:
        places, lengths, tets = _meshes.points(sizes[0], "sizes"), _meshes.numbers(sizes[1], "sizes"), None
    else:
        if _is_word(mesh):
            raise Error("sizes: the vertices of a file are not known here; give points and lengths, or a mesh in memory")
        arrays = _meshes.tet_arrays(mesh)
        places, lengths, tets = arrays.vertices, _meshes.numbers(sizes, "sizes"), arrays.tets
    if len(places) != len(lengths):
        raise Error(f"sizes: {len(lengths)} lengths for {len(places)} points; give one each")
    return places, lengths, tets


def segment(
    mesh: MeshLike,
    proxies: Optional[int] = None,
    *,
    error: Optional[Number] = None,
    surfaces: Optional[str] = None,
    start: Optional[str] = None,
    random_seed: Optional[int] = None,
    iterations: Optional[int] = None,
    regularize: Optional[bool] = None,
    smooth: Optional[Number] = None,
    fuzzy_rings: Optional[int] = None,
    project: Optional[bool] = None,
    polygons: Optional[bool] = None,
    chord: Optional[Number] = None,
    triangulate: Optional[bool] = None,
    threads: Optional[int] = None,
    labels: Any = None,
    feature_edges: Any = None,
    progress: Optional[ProgressCallback] = None,
) -> SegmentResult:
    """The planes, quadrics and tori that a surface is made of: a region for each triangle.

    `proxies` regions, or as few as keep the root mean square distance to their surfaces below `error` percent of the
    bounding box's diagonal. With `polygons` planar regions become polygons, too. `mesh`, `progress` and what is raised
    are as for remesh().
    """
    given = locals()
    options = _options("segment", _words(given, "mesh", "labels", "feature_edges", "progress"))
    handle = _run(options, _meshes.mesh_handle(mesh, labels, feature_edges), progress)
    return SegmentResult(handle, bool(polygons))


def reconstruct_tree(
    points: MeshLike,
    *,
    ground: Union[str, Number, None] = None,
    scene: Optional[bool] = None,
    components: Optional[str] = None,
    leaves: Optional[str] = None,
    tip_radius: Optional[Number] = None,
    clusters: Optional[int] = None,
    delta: Optional[Number] = None,
    max_cluster_points: Optional[int] = None,
    unit: Optional[str] = None,
    threads: Optional[int] = None,
    progress: Optional[ProgressCallback] = None,
) -> TreeResult:
    """The branches of a tree, or of several, from a laser scan.

    `points` is (n, 3), z up, the path of a scan (.las, .ply, .pcd, .pts, .xyz), or an object with `points` or
    `vertices`. Lengths are in their unit, which `unit` names for .igs files. `progress` and what is raised are as for
    remesh().
    """
    given = locals()
    options = _options("tree", _words(given, "points", "progress"))
    return TreeResult(_run(options, _meshes.points_handle(points), progress))


def rvd(
    mesh: MeshLike,
    n: Optional[int] = None,
    *,
    seeds: Any = None,
    random_seed: Optional[int] = None,
    device: Optional[str] = None,
    precision: Optional[str] = None,
    neighbors: Optional[str] = None,
    threads: Optional[int] = None,
    progress: Optional[ProgressCallback] = None,
) -> DiagramResult:
    """The Voronoi diagram of seeds on a surface or in a solid: (n, 3) points, a file of them, or n random ones.

    `mesh` is a surface as for remesh(), or tetrahedra: a file of them, a TetResult or a meshio.Mesh. `progress` and what
    is raised are as for remesh().
    """
    given = locals()
    options = _options("rvd", _words(given, "mesh", "seeds", "progress"), seeds)
    return DiagramResult(_run(options, _meshes.mesh_handle(mesh), progress))


def quality(
    mesh: MeshLike,
    *,
    reference: Optional[MeshLike] = None,
    threads: Optional[int] = None,
    progress: Optional[ProgressCallback] = None,
) -> "dict[str, Any]":
    """Angles, topology and intersections of triangles or tetrahedra, and their distance to a reference.

    Gives the report of docs/cli.md: its entries "quality" and "topology" above all. Distances are in percent of the
    diagonal of the reference's bounding box. `mesh` and `reference` are as for tetrahedralize(); what is raised is as
    for remesh().
    """
    options = _options("quality", {"threads": threads})
    if reference is not None:
        other = _meshes.tets_handle(reference)
        call("options_reference", options.value, other.value)
    handle = _run(options, _meshes.tets_handle(mesh), progress)
    report = interruptible(lambda callbacks: text("result_report", handle.value, callbacks))
    return json.loads(report)  # type: ignore[no-any-return]


def devices() -> "list[dict[str, Any]]":
    """What can compute here, the CPU first: dicts with "name", "kind", "precision", "memory" (bytes) and, of a GPU, the
    "index" and "uuid" by which `device="vulkan:INDEX"` names it."""
    return json.loads(interruptible(lambda _: text("devices")))["devices"]  # type: ignore[no-any-return]

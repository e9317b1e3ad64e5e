"""The functions as methods of PyVista's datasets: `mesh.bisector.remesh(n=5000)`.

PyVista 0.48 and newer imports this by the entry point `pyvista.accessors` when `mesh.bisector` is first used; older
ones do not, and take the functions and `to_pyvista()`. Keywords are those of the functions.
"""

from __future__ import annotations

from typing import Any

import pyvista

from . import _pipelines


class Accessor:
    """Of a pyvista.PolyData or pyvista.UnstructuredGrid."""

    def __init__(self, dataset: Any) -> None:
        self._dataset = dataset

    def remesh(self, n: Any = None, **options: Any) -> Any:
        """The remeshed surface as a pyvista.PolyData."""
        return _pipelines.remesh(self._dataset, n, **options).to_pyvista()

    def tetrahedralize(self, n: Any = None, **options: Any) -> Any:
        """The tetrahedra as a pyvista.UnstructuredGrid."""
        return _pipelines.tetrahedralize(self._dataset, n, **options).to_pyvista()

    def segment(self, proxies: Any = None, **options: Any) -> Any:
        """The surface as a pyvista.PolyData whose cell data `label` are the regions."""
        return _pipelines.segment(self._dataset, proxies, **options).to_pyvista()

    def reconstruct_tree(self, **options: Any) -> Any:
        """The branches of the tree that the points show as a pyvista.PolyData; cell data `label` are the branches."""
        return _pipelines.reconstruct_tree(self._dataset, **options).to_pyvista()

    def quality(self, **options: Any) -> "dict[str, Any]":
        """The report of quality()."""
        return _pipelines.quality(self._dataset, **options)


for _kind in (pyvista.PolyData, pyvista.UnstructuredGrid):
    pyvista.register_dataset_accessor("bisector", _kind)(Accessor)

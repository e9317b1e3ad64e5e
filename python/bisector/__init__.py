"""Bisector: high-quality triangle and tetrahedral meshes by certified centroidal Voronoi tessellation, segmentation, and
trees from laser scans.

    import bisector as bs
    r = bs.remesh("in.off", n=5000)
    r.vertices, r.faces          # (n, 3) float64, (m, 3) int64
    r.save("out.ply")
    r.report["quality"]

All functions may be called from several threads; the interpreter's lock is free while they compute. Results are those
of the command line, byte for byte.
"""

from ._errors import BisectorWarning, DeviceError, Error
from ._library import version as __version__
from ._pipelines import devices, quality, reconstruct_tree, remesh, rvd, segment, tetrahedralize
from ._results import DiagramResult, RemeshResult, Result, SegmentResult, SurfaceResult, TetResult, TreeResult
from ._run import Progress

__all__ = [
    "BisectorWarning", "DeviceError", "DiagramResult", "Error", "Progress", "RemeshResult", "Result", "SegmentResult",
    "SurfaceResult", "TetResult", "TreeResult", "__version__", "devices", "quality", "reconstruct_tree", "remesh",
    "rvd", "segment", "tetrahedralize",
]

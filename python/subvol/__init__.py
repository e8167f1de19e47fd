# SPDX-License-Identifier: GPL-3.0-or-later
"""Volume meshes fitted to surfaces: subdivision volumes, curved cells, shells.

    import subvol
    fit = subvol.fit("torus_target.off", "torus_template.mesh", levels=2)
    fit.cage.points, fit.mesh.hexes, fit.report["distance"]["mean_percent"]

Meshes are NumPy arrays in and out; options have the names of the command line.
"""

import os as _os


def _load_with_short_waits():
    """OpenMP's library reads its settings when it is loaded: threads that wait spin for microseconds, not milliseconds."""
    if "OMP_WAIT_POLICY" in _os.environ or "GOMP_SPINCOUNT" in _os.environ:
        return
    _os.environ["GOMP_SPINCOUNT"] = "1000"
    try:
        from . import _subvol  # noqa: F401
    finally:
        del _os.environ["GOMP_SPINCOUNT"]


_load_with_short_waits()

from . import _subvol, template

__version__ = _subvol.__version__
__all__ = ["template"] + [name for name in dir(_subvol) if not name.startswith("_")]
globals().update({name: getattr(_subvol, name) for name in __all__ if name != "template"})

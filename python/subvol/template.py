# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes and edits coarse meshes to fit with: the verbs of `subvol template`."""

from ._subvol import _template

__all__ = [name for name in dir(_template) if not name.startswith("_")]
globals().update({name: getattr(_template, name) for name in __all__})

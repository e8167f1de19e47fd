# SPDX-License-Identifier: GPL-3.0-or-later
from typing import Literal, Optional, Sequence

import numpy.typing as npt

from . import Callback, Surface, Volume, VolumeMesh

__all__: Sequence[str]

def auto(
    target: Surface,
    *,
    cells: int = 300,
    pillow: bool = False,
    progress: Optional[Callback] = None,
    threads: Optional[int] = None,
) -> VolumeMesh: ...
def grid(
    surface: Optional[Surface] = None,
    *,
    box: Optional[Sequence[float]] = None,
    counts: Optional[Sequence[int]] = None,
    size: Optional[float] = None,
    margin: float = 5.0,
) -> VolumeMesh: ...
def carve(
    mesh: Volume,
    *,
    inside: Optional[Surface] = None,
    share: float = 0.5,
    box: Optional[Sequence[float]] = None,
    list: Optional[npt.ArrayLike] = None,
    invert: bool = False,
) -> VolumeMesh: ...
def extrude(
    surface: Surface,
    *,
    thickness: float,
    layers: int = 1,
    growth: float = 1.0,
    direction: Optional[Sequence[float]] = None,
) -> VolumeMesh: ...
def pillow(mesh: Volume, *, list: Optional[npt.ArrayLike] = None) -> VolumeMesh: ...
def refine(
    mesh: Volume,
    *,
    inside: Optional[Surface] = None,
    share: float = 0.5,
    box: Optional[Sequence[float]] = None,
    list: Optional[npt.ArrayLike] = None,
    thin: bool = False,
) -> VolumeMesh: ...
def collapse(
    mesh: Volume, *, vertices: Sequence[int], what: Literal["sheet", "face", "edge"] = "sheet"
) -> VolumeMesh: ...
def merge(mesh: Volume, other: Optional[Volume] = None, *, tolerance: float = 1e-06) -> VolumeMesh: ...
def split(
    mesh: Volume,
    *,
    into: Literal["parts", "prisms", "tets"] = "parts",
    edge: Optional[Sequence[int]] = None,
    parts: int = 2,
) -> VolumeMesh: ...

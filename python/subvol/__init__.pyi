# SPDX-License-Identifier: GPL-3.0-or-later
# Types of the module; docs/python.md and the docstrings say what things are.
from os import PathLike
from typing import Any, Callable, Dict, List, Literal, Optional, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from . import template as template

Path = Union[str, bytes, PathLike[str]]
Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]
Longs = npt.NDArray[np.int64]
Report = Dict[str, Any]
Volume = Union["VolumeMesh", Path]
Surface = Union["SurfaceMesh", "VolumeMesh", Path]
Callback = Callable[["Progress"], Optional[bool]]
BoundaryRule = Literal["catmull-clark", "averaging"]
Basis = Literal["fourier", "legendre"]

__version__: str
__all__: Sequence[str]
TET: int
PRISM: int
HEX: int
PYRAMID: int

class Error(Exception): ...
class InputError(Error, ValueError): ...
class IoError(Error, OSError): ...

class Progress:
    @property
    def stage(self) -> str: ...
    @property
    def level(self) -> int: ...
    @property
    def iteration(self) -> int: ...
    @property
    def energy(self) -> float: ...
    @property
    def fraction(self) -> float: ...

class View:
    @property
    def html(self) -> str: ...
    def save(self, path: Path) -> None: ...

class VolumeMesh:
    def __init__(
        self,
        points: npt.ArrayLike,
        *,
        hexes: Optional[npt.ArrayLike] = None,
        prisms: Optional[npt.ArrayLike] = None,
        tets: Optional[npt.ArrayLike] = None,
        pyramids: Optional[npt.ArrayLike] = None,
        references: Optional[npt.ArrayLike] = None,
        creases: Optional[npt.ArrayLike] = None,
        crease_sharpness: Optional[npt.ArrayLike] = None,
        corners: Optional[npt.ArrayLike] = None,
        corner_sharpness: Optional[npt.ArrayLike] = None,
        grouped_faces: Optional[npt.ArrayLike] = None,
        face_groups: Optional[npt.ArrayLike] = None,
        group_names: Optional[Sequence[str]] = None,
        group_numbers: Optional[npt.ArrayLike] = None,
    ) -> None: ...
    @property
    def points(self) -> Floats: ...
    @property
    def hexes(self) -> Ints: ...
    @property
    def prisms(self) -> Ints: ...
    @property
    def tets(self) -> Ints: ...
    @property
    def pyramids(self) -> Ints: ...
    @property
    def kinds(self) -> npt.NDArray[np.uint8]: ...
    @property
    def cell_points(self) -> Ints: ...
    @property
    def cell_offsets(self) -> Longs: ...
    @property
    def references(self) -> Ints: ...
    @property
    def regions(self) -> Dict[str, Any]: ...
    @property
    def creases(self) -> Ints: ...
    @property
    def crease_sharpness(self) -> Floats: ...
    @property
    def corners(self) -> Ints: ...
    @property
    def corner_sharpness(self) -> Floats: ...
    @property
    def group_names(self) -> List[str]: ...
    @property
    def group_numbers(self) -> Ints: ...
    @property
    def grouped_faces(self) -> Ints: ...
    @property
    def face_groups(self) -> Ints: ...
    @property
    def region_names(self) -> Dict[int, str]: ...
    def boundary(self) -> SurfaceMesh: ...
    def show(self, target: Optional[Surface] = None, *, limit: bool = False, title: str = "subvol") -> View: ...
    def copy(self) -> VolumeMesh: ...

class SurfaceMesh:
    def __init__(
        self,
        points: npt.ArrayLike,
        triangles: Optional[npt.ArrayLike] = None,
        quads: Optional[npt.ArrayLike] = None,
        *,
        face_points: Optional[npt.ArrayLike] = None,
        face_offsets: Optional[npt.ArrayLike] = None,
        creases: Optional[npt.ArrayLike] = None,
        crease_sharpness: Optional[npt.ArrayLike] = None,
        corners: Optional[npt.ArrayLike] = None,
        corner_sharpness: Optional[npt.ArrayLike] = None,
        face_groups: Optional[npt.ArrayLike] = None,
        group_names: Optional[Sequence[str]] = None,
        group_numbers: Optional[npt.ArrayLike] = None,
    ) -> None: ...
    @property
    def points(self) -> Floats: ...
    @property
    def triangles(self) -> Ints: ...
    @property
    def quads(self) -> Ints: ...
    @property
    def face_points(self) -> Ints: ...
    @property
    def face_offsets(self) -> Longs: ...
    @property
    def creases(self) -> Ints: ...
    @property
    def crease_sharpness(self) -> Floats: ...
    @property
    def corners(self) -> Ints: ...
    @property
    def corner_sharpness(self) -> Floats: ...
    @property
    def group_names(self) -> List[str]: ...
    @property
    def group_numbers(self) -> Ints: ...
    @property
    def face_groups(self) -> Ints: ...
    def triangulated(self) -> SurfaceMesh: ...
    def show(self, target: Optional[Surface] = None, *, limit: bool = False, title: str = "subvol") -> View: ...
    def copy(self) -> SurfaceMesh: ...

class HighOrderMesh:
    def __init__(self, mesh: Volume, order: int, *, basis: Basis = "legendre") -> None: ...
    @property
    def coefficients(self) -> Floats: ...
    @property
    def basis(self) -> Basis: ...
    @property
    def order(self) -> int: ...
    @property
    def edge_orders(self) -> Ints: ...
    @property
    def face_orders(self) -> Ints: ...
    @property
    def cell_orders(self) -> Ints: ...
    @property
    def references(self) -> Ints: ...
    @property
    def group_names(self) -> List[str]: ...
    @property
    def group_numbers(self) -> Ints: ...
    @property
    def grouped_faces(self) -> Ints: ...
    @property
    def face_groups(self) -> Ints: ...
    @property
    def region_names(self) -> Dict[int, str]: ...
    @property
    def regions(self) -> Dict[str, Any]: ...
    def point_map(self, cells: npt.ArrayLike, points: npt.ArrayLike) -> SparseMap: ...
    def evaluate(self, cells: npt.ArrayLike, points: npt.ArrayLike) -> Floats: ...
    def straight_sided(self) -> VolumeMesh: ...
    def linear_cells(self, intervals: int) -> VolumeMesh: ...
    def boundary(self, chord: float = 0.005) -> SurfaceMesh: ...
    def show(self, target: Optional[Surface] = None, *, limit: bool = False, title: str = "subvol") -> View: ...
    def copy(self) -> HighOrderMesh: ...

class SparseMap:
    @property
    def shape(self) -> Tuple[int, int]: ...
    @property
    def data(self) -> Floats: ...
    @property
    def indices(self) -> Ints: ...
    @property
    def indptr(self) -> Longs: ...
    def apply(self, points: npt.ArrayLike) -> Floats: ...
    def apply_transposed(self, points: npt.ArrayLike) -> Floats: ...

class Result:
    @property
    def report(self) -> Report: ...

class FitResult(Result):
    @property
    def template(self) -> VolumeMesh: ...
    @property
    def cage(self) -> Optional[VolumeMesh]: ...
    @property
    def mesh(self) -> Any: ...  # VolumeMesh; with order HighOrderMesh
    @property
    def states(self) -> List[Tuple[str, Floats]]: ...

class FillResult(Result):
    @property
    def cage(self) -> Optional[VolumeMesh]: ...
    @property
    def mesh(self) -> VolumeMesh: ...

class OptimizeResult(Result):
    @property
    def mesh(self) -> Any: ...  # VolumeMesh; with order HighOrderMesh

class ShellResult(Result):
    @property
    def surface(self) -> SurfaceMesh: ...  # with its repairs, without skipped patches
    @property
    def mesh(self) -> Any: ...  # VolumeMesh; with order HighOrderMesh
    @property
    def linear_mesh(self) -> VolumeMesh: ...
    @property
    def inside_layers(self) -> int: ...
    @property
    def thickness(self) -> Floats: ...
    @property
    def thickness_asked(self) -> Floats: ...
    @property
    def thickness_limited(self) -> Floats: ...
    @property
    def clearance(self) -> Floats: ...

def fit(
    target: Union[Surface, npt.ArrayLike],
    template: Optional[Volume] = None,
    *,
    cells: Optional[int] = None,
    levels: int = 3,
    tolerance: Optional[float] = None,
    surface: Literal["limit", "mesh"] = "limit",
    boundary: BoundaryRule = "catmull-clark",
    cage_only: bool = False,
    keep_cage: bool = True,
    crease_angle: Optional[float] = None,
    keep_groups: bool = False,
    lambda_far: float = 1.0,
    quality: float = 0.65,
    lambda_close: Optional[float] = None,
    correspondence: Literal["closest", "voronoi"] = "closest",
    solver: Literal["newton", "lbfgs"] = "newton",
    energy: Literal["hencky", "inverse_mean_ratio", "condition_number"] = "hencky",
    point_weights: Literal["equal", "area"] = "equal",
    max_iterations: int = 0,
    time_limit: float = 0.0,
    tune: Optional[Dict[str, float]] = None,
    order: Optional[int] = None,
    basis: Basis = "legendre",
    adaptive: bool = False,
    keep_states: bool = False,
    checkpoint: Optional[Path] = None,
    every: float = 60.0,
    resume: Optional[Path] = None,
    chord: float = 0.005,
    progress: Optional[Callback] = None,
    threads: Optional[int] = None,
) -> FitResult: ...
def fill(
    target: Surface,
    *,
    cells: Optional[int] = None,
    quality: float = 0.65,
    crease_angle: Optional[float] = None,
    regions: Literal["auto", "keep", "merge"] = "auto",
    wrap: Optional[float] = None,
    keep_groups: bool = False,
    cage: bool = False,
    levels: int = 1,
    tolerance: float = 0.02,
    max_tolerance: float = 0.5,
    max_iterations: int = 0,
    time_limit: float = 0.0,
    tune: Optional[Dict[str, float]] = None,
    checkpoint: Optional[Path] = None,
    every: float = 60.0,
    resume: Optional[Path] = None,
    chord: float = 0.005,
    progress: Optional[Callback] = None,
    threads: Optional[int] = None,
) -> FillResult: ...
def optimize(
    mesh: Volume,
    *,
    target: Optional[Surface] = None,
    fixed_boundary: bool = False,
    sizes: Literal["uniform", "local"] = "local",
    crease_angle: float = 40.0,
    tolerance: float = 0.05,
    max_tolerance: float = 0.5,
    quality: float = 0.65,
    lambda_: Optional[float] = None,
    order: Optional[int] = None,
    basis: Basis = "legendre",
    max_iterations: int = 0,
    time_limit: float = 0.0,
    tune: Optional[Dict[str, float]] = None,
    checkpoint: Optional[Path] = None,
    every: float = 60.0,
    resume: Optional[Path] = None,
    chord: float = 0.005,
    progress: Optional[Callback] = None,
    threads: Optional[int] = None,
) -> OptimizeResult: ...
def shell(
    surface: Surface,
    thickness: Union[float, str, npt.ArrayLike],
    *,
    layers: int = 1,
    growth: float = 1.0,
    side: Literal["outward", "inward", "both"] = "outward",
    free_surface: bool = False,
    straight: bool = False,
    crease_angle: Optional[float] = None,
    first_height: Optional[Union[float, str]] = None,
    region: Optional[Union[int, str]] = None,
    skip: Optional[Union[int, str, Sequence[Union[int, str]]]] = None,
    repair: Union[float, str] = "0.02%",
    order: int = 1,
    basis: Basis = "legendre",
    max_iterations: int = 0,
    time_limit: float = 0.0,
    chord: float = 0.005,
    progress: Optional[Callback] = None,
    threads: Optional[int] = None,
) -> ShellResult: ...
def subdivide(
    mesh: Volume,
    *,
    levels: int = 1,
    boundary: Literal["catmull-clark", "averaging", "linear"] = "catmull-clark",
    crease_angle: Optional[float] = None,
) -> VolumeMesh: ...
def subdivision_matrix(
    mesh: Volume,
    *,
    levels: int = 1,
    boundary: Literal["catmull-clark", "averaging", "linear"] = "catmull-clark",
    crease_angle: Optional[float] = None,
) -> SparseMap: ...
def limit_matrix(mesh: Volume) -> SparseMap: ...
def limit_surface(cage: Volume, *, chord: float = 0.005) -> SurfaceMesh: ...
def check(
    mesh: Union[Volume, HighOrderMesh],
    target: Optional[Union[Surface, npt.ArrayLike]] = None,
    *,
    chord: float = 0.005,
    progress: Optional[Callback] = None,
    threads: Optional[int] = None,
) -> Report: ...
def distance(
    surface: Surface,
    target: Surface,
    *,
    samples: int = 50000,
    progress: Optional[Callback] = None,
    threads: Optional[int] = None,
) -> Report: ...
def self_intersections(surface: Surface) -> Ints: ...
def read(path: Path, *, check: bool = True) -> Any: ...  # VolumeMesh, SurfaceMesh or HighOrderMesh
def write(
    path: Path,
    what: Union[VolumeMesh, SurfaceMesh, HighOrderMesh, Result],
    *,
    chord: float = 0.05,
    unit: float = 1.0,
    up: Literal["y", "z"] = "y",
    limit: bool = False,
    intervals: int = 0,
    cut: Optional[str] = None,
    wireframe: bool = True,
    quantize: bool = False,
    map_tolerance: float = 0.001,
    msh_version: Literal["2.2", "4.1"] = "4.1",
    vtu_cells: Literal["lagrange", "bezier"] = "lagrange",
) -> None: ...

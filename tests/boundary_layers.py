#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""boundary_layers.py PROGRAM SAMPLES SOURCE: runs the commands of docs/tasks/boundary-layers.md and looks at the meshes
of layers and far field with Gmsh and meshio: they conform, fill the box but for the part, and have the page's groups.

Exit status 0 if all is as the page says, 1 if not, 77 if there is no Gmsh or no meshio.
"""
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from docs_commands import blocks

SYSTEM_PYTHON = "/usr/bin/python3"  # the one that Debian's packages are for
PAGE = "docs/tasks/boundary-layers.md"
SCRIPT = "samples/far_field.py"
TOLERANCE = 1e-9                    # of areas and volumes, relative
TRIANGLE, QUAD, TET, PRISM = 2, 3, 4, 6  # Gmsh's types of elements
CORNERS = {TRIANGLE: 3, QUAD: 4, TET: 4, PRISM: 6}
MESHIO_KINDS = {TET: "tetra", PRISM: "wedge"}
FACES = {TET: [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)],
         PRISM: [(0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)]}

try:
    import gmsh
    import meshio
    import numpy as np
except (ImportError, OSError) as error:
    if os.path.exists(SYSTEM_PYTHON) and os.path.realpath(sys.executable) != os.path.realpath(SYSTEM_PYTHON):
        os.execv(SYSTEM_PYTHON, [SYSTEM_PYTHON, *sys.argv])
    print(f"SKIPPED: {error}; apt-get install python3-gmsh python3-meshio")
    sys.exit(77)


def run(words, folder, wanted=0):
    """Returns what a command of the shell has said; AssertionError if its exit status is not the one that is wanted."""
    environment = dict(os.environ, PATH=f"{folder}/bin:{os.environ['PATH']}", OMP_NUM_THREADS="1")
    done = subprocess.run(["bash", "-c", words], cwd=folder, env=environment, capture_output=True, text=True)
    said = done.stdout + done.stderr
    assert done.returncode == wanted, f"status {done.returncode}, expected {wanted}: {words}\n{said}"
    return said


def face_keys(faces):
    """Returns faces of three or four nodes as rows of four, in an order that does not depend on the cell."""
    faces = np.sort(faces, axis=1)
    return faces if faces.shape[1] == 4 else np.hstack([np.zeros((len(faces), 1), int), faces])


def measure(kind, entity=-1):
    """Returns the area or volume of all elements of a kind, and the least determinant at a point of integration."""
    points, weights = gmsh.model.mesh.getIntegrationPoints(kind, "Gauss4")
    determinants = np.array(gmsh.model.mesh.getJacobians(kind, points, entity)[1]).reshape(-1, len(weights))
    return (determinants @ np.array(weights)).sum(), determinants.min(initial=np.inf)


class Flow:
    """What Gmsh reads: extent, number of cells by kind, volume, faces on the boundary and inside, and groups."""

    def __init__(self, path):
        gmsh.initialize()
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(path))
        mesh = gmsh.model.mesh
        nodes = lambda kind, of=-1: np.asarray(mesh.getElementsByType(kind, of)[1], int).reshape(-1, CORNERS[kind])
        points = np.array(mesh.getNodes()[1]).reshape(-1, 3)
        self.extent = np.ptp(points, axis=0)
        self.cells = {kind: len(nodes(kind)) for kind in FACES}
        self.volume = 0
        for kind in FACES:
            volume, least = measure(kind)
            assert least > 0, f"{path}: a cell of Gmsh's kind {kind} is inverted"
            self.volume += volume
        faces = np.concatenate([face_keys(nodes(kind)[:, face]) for kind in FACES for face in FACES[kind]])
        found, counts = np.unique(faces, axis=0, return_counts=True)
        assert counts.max() == 2, f"{path}: a face of {counts.max()} cells"
        self.boundary = set(map(tuple, found[counts == 1].tolist()))
        self.inner = set(map(tuple, found[counts == 2].tolist()))
        self.area, self.faces = {}, {}
        for _, group in gmsh.model.getPhysicalGroups(2):
            name = gmsh.model.getPhysicalName(2, group)
            surfaces = gmsh.model.getEntitiesForPhysicalGroup(2, group)
            kinds = [(kind, surface) for kind in (TRIANGLE, QUAD) for surface in surfaces if len(nodes(kind, surface))]
            self.area[name] = sum(measure(*of)[0] for of in kinds)
            self.faces[name] = [tuple(face) for of in kinds for face in face_keys(nodes(*of)).tolist()]
        gmsh.finalize()


def require_equal(found, wanted, what):
    assert abs(found - wanted) <= TOLERANCE * abs(wanted), f"{what}: {found:.12g}, expected {wanted:.12g}"


def require_whole(flow, part_volume, name):
    """Expects each boundary face in one group, the sheet inside, and the box filled with cells but for the part."""
    assert set(flow.faces["outer"]) <= flow.inner and len(flow.faces["outer"]) > 0, f"{name}: the sheet is not inside"
    on_boundary = [face for group, faces in flow.faces.items() if group != "outer" for face in faces]
    assert len(on_boundary) == len(set(on_boundary)) and set(on_boundary) == flow.boundary, \
        f"{name}: {len(on_boundary)} faces in groups, {len(flow.boundary)} on the boundary"
    require_equal(flow.volume, np.prod(flow.extent) - part_volume, f"{name}: volume")
    print(f"{name}: {flow.cells[PRISM]} prisms, {flow.cells[TET]} tets, {len(flow.boundary)} faces on the boundary, "
          f"{len(flow.inner)} inside, volume {flow.volume:.9g}")


def volume_of(surface, folder):
    return sum(part["volume"] for part in json.loads(run(f"subvol check {surface} --json", folder))["parts"])


def look_at_rod(folder):
    flow = Flow(folder / "flow22.msh")
    require_whole(flow, volume_of("rod.stl", folder), "rod")
    layers = json.loads((folder / "layers.json").read_text())
    for group in layers["groups"]:
        require_equal(flow.area[group["name"]], group["area"], f"area of {group['name']}")
        assert len(flow.faces[group["name"]]) == group["faces"], f"faces of {group['name']}"
    x, y, z = flow.extent
    for name, area in (("inlet", y * z), ("outlet", y * z), ("far", 2 * x * (y + z))):
        require_equal(flow.area[name], area, f"area of {name}")
    assert set(flow.area) == {"small_bore", "large_bore", "top", "bottom", "side", "outer", "inlet", "outlet", "far"}
    require_equal(layers["layers"]["first_height_outside"], 0.002, "first height")
    assert round(layers["layers"]["growth"], 2) == 1.35, "growth"

    for name in ("flow22.msh", "flow.vtu", "flow.inp", "flow.mesh"):
        mesh = meshio.read(folder / name)
        for kind, called in MESHIO_KINDS.items():
            found = sum(len(block.data) for block in mesh.cells if block.type == called)
            assert found == flow.cells[kind], f"meshio: {name}: {found} cells called {called}"
    of_msh = meshio.read(folder / "flow22.msh")
    assert {"inlet", "outlet", "far", "small_bore"} <= set(of_msh.field_data), "meshio: names of groups"
    assert f"boundary\n{len(flow.boundary) + len(flow.faces['outer'])}\n" in (folder / "flow.mfem").read_text(), ".mfem"
    assert Flow(folder / "flow.msh").area.keys() == flow.area.keys(), "flow.msh"
    assert 'Name="group"' in (folder / "flow_faces.vtu").read_text(errors="replace"), "flow_faces.vtu"


def look_at_bracket(folder):
    flow = Flow(folder / "half22.msh")
    require_whole(flow, volume_of("bracket_target.off", folder), "bracket")
    layers = json.loads((folder / "half_layers.json").read_text())
    for group in layers["groups"]:
        require_equal(flow.area[group["name"]], group["area"], f"area of {group['name']}")
    x, y, z = flow.extent
    require_equal(flow.area["symmetry"] + flow.area["rim"] + layers["skipped"][0]["area"], y * z, "plane of symmetry")
    require_equal(flow.area["inlet"], x * z, "inlet")
    assert set(flow.area) == {"wall", "outer", "rim", "inlet", "outlet", "far", "symmetry"}


def look_at_refusals(folder):
    """Expects that the script refuses what it cannot use, says why, and writes nothing."""
    script = f"python3 {SCRIPT}"
    for words, wanted, said in (
            ("layers.msh -o no.msh --name y-=top", 1, "has a group top already"),
            ("layers.msh -o no.msh --box 0 0 0 1 1 1", 1, "the box must hold the sheet"),
            ("layers.msh -o no.msh --sheet nothing", 1, "no group of faces is called nothing"),
            ("layers.msh -o no.msh --name up=sky", 2, "must be one of x-, x+"),
            ("layers.msh -o far.msh", 2, "exists; give --force"),
            ("quads.msh -o no.msh", 1, "the sheet has quads"),
            ("rod.obj -o no.msh", 1, "cannot read the file"),
            ("gone.msh -o no.msh", 1, "the file does not exist"),
            ("half_layers.msh -o no.msh --box -9 -9 -9 9 9 9", 1, "the box must end there")):
        answer = run(f"{script} {words}", folder, wanted)
        assert said in answer and "Traceback" not in answer, f"{words}: {answer}"
    assert not (folder / "no.msh").exists()


def main():
    program, samples, source = (Path(path).resolve() for path in sys.argv[1:4])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "bin").mkdir()
        (folder / "bin" / "subvol").symlink_to(program)
        (folder / "samples").symlink_to(source / "samples")
        subprocess.run([samples, name], check=True, stdout=subprocess.DEVNULL)
        try:
            for block in blocks((source / PAGE).read_text()):
                for _, words in block.commands():
                    run(words, folder)
            look_at_rod(folder)
            look_at_bracket(folder)
            run("subvol shell rod.obj --thickness 1% -o quads.msh", folder)
            look_at_refusals(folder)
        except AssertionError as error:
            print(error)
            return 1
    return 0


sys.exit(main())

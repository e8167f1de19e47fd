// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/io/nodal_writers.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/grouped_meshes.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;
using Catch::Contains;

TEST_CASE("xdmf: cells of one kind, of several, and their references", "[io]") {
  VolumeMesh hex = single_cell(CellKind::hex);
  const std::string plain = xdmf_text(nodal_mesh(hex));
  CHECK_THAT(plain, Contains("TopologyType=\"Hexahedron\" NumberOfElements=\"1\" NodesPerElement=\"8\"") &&
                        Contains("0 1 2 3 4 5 6 7\n") && !Contains("Attribute") && !Contains("Information"));
  hex.references = {5};
  hex.regions = {{"a < b", 5, 3}};
  CHECK_THAT(xdmf_text(nodal_mesh(hex)), Contains("Attribute Name=\"reference\"") && Contains("\n5\n") &&
                                             Contains("<map key=\"a &lt; b\" dim=\"3\">5</map>"));
  // XDMF's wedge has its first triangle the other way round.
  CHECK_THAT(xdmf_text(nodal_mesh(single_cell(CellKind::prism))), Contains("0 2 1 3 5 4\n"));
  CHECK_THAT(xdmf_text(nodal_mesh(mixed_cells())), Contains("TopologyType=\"Mixed\"") && Contains("\n9 "));
}

TEST_CASE("xdmf: faces have the numbers of their groups and the nodes of the mesh", "[io]") {
  VolumeMesh mesh = with_floor_and_roof(single_cell(CellKind::hex), 1);
  mesh.face_groups.groups[1].number = -4;
  const std::string text = xdmf_faces_text(nodal_mesh(mesh));
  CHECK_THAT(text, Contains("Grid Name=\"groups\"") && Contains("\"Quadrilateral\" NumberOfElements=\"6\"") &&
                       Contains("\n1\n2\n0\n0\n0\n0\n") && Contains("dim=\"2\">2</map>"));
  NodalMesh high = nodal_mesh(mesh);
  high.orders = {3};
  CHECK_THROWS_AS(xdmf_text(high), InputError);
}

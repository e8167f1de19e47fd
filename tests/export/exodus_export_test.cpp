// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/export/curved_file.h"
#include "subvol/export/high_order_file.h"
#include "subvol/export/read_back.h"
#include "subvol/export/volume_writer.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/nodal_mesh.h"
#include "subvol/io/nodal_writers.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/grouped_meshes.h"
#include "tests/support/run_python.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <fstream>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;
using Catch::Contains;

namespace {

/// True, with a remark, if this build cannot read Exodus files.
bool is_missing() {
  if (has_exodus()) return false;
  WARN("SKIPPED: built without netCDF (libnetcdf-dev)");
  return true;
}

VolumeMesh exodus_cells() {
  VolumeMesh mesh = with_floor_and_roof(mixed_cells(), 1);
  mesh.face_groups.groups[0].name = "the \"floor\"";
  mesh.face_groups.groups[1].number = 7;
  mesh.references.assign(mesh.num_cells(), 4);
  mesh.references.back() = -2;
  mesh.regions = {{"steel", 4, 3}};
  return mesh;
}

std::vector<std::size_t> order_of(const VolumeMesh& mesh) { return exodus_order(nodal_mesh(mesh)); }

}  // namespace

TEST_CASE("exodus: cells, references, regions and groups of all kinds come back", "[export]") {
  if (is_missing()) return;
  const VolumeMesh mesh = exodus_cells();
  const TemporaryFolder folder;
  write_volume(folder / "a.e", mesh);
  CHECK_NOTHROW(require_written(folder / "a.e", mesh));
  std::vector<std::string> warnings;
  const VolumeMesh found = read_volume_mesh(folder / "a.e", {.warnings = &warnings});
  CHECK(warnings.empty());
  CHECK(found.positions == mesh.positions);
  CHECK(found.face_groups == mesh.face_groups);
  CHECK(found.regions == mesh.regions);
  const std::vector<std::size_t> order = order_of(mesh);  // by reference and kind
  REQUIRE(found.num_cells() == order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    CHECK(found.kinds[i] == mesh.kinds[order[i]]);
    CHECK(std::ranges::equal(found.cell(i), mesh.cell(order[i])));
    CHECK(found.references[i] == mesh.references[order[i]]);
  }
  write_volume(folder / "b.exo", found);
  CHECK(content_of(folder / "a.e") == content_of(folder / "b.exo"));
  VolumeMesh other = mesh;
  other.positions[0][0] += 1e-12;
  CHECK_THROWS_AS(require_written(folder / "a.e", other), IoError);
}

TEST_CASE("exodus: a node set without a side set becomes a group of the faces whose corners it holds", "[export]") {
  if (is_missing()) return;
  const VolumeMesh mesh = with_floor_and_roof(lattice(2, 2, 2), 2);
  const TemporaryFolder folder;
  write_volume(folder / "a.e", mesh);
  std::string bytes = content_of(folder / "a.e");
  bytes.replace(bytes.find("floor"), 5, "slabs");  // of the side set or the node set
  std::vector<std::string> warnings;
  const VolumeMesh found = read_volume_mesh(folder.file("b.e", bytes), {.warnings = &warnings});
  CHECK(warnings.empty());
  const auto faces_of = [&](const VolumeMesh& cells, const std::string& name) {
    const auto& groups = cells.face_groups.groups;
    const auto group = std::ranges::find_if(groups, [&](const Group& other) { return other.name == name; });
    REQUIRE(group != groups.end());
    std::vector<std::array<Index, 4>> faces;
    for (const GroupedFace& face : cells.face_groups.faces)
      if (face.group == group - groups.begin()) faces.push_back(face.face);
    return faces;
  };
  CHECK(found.face_groups.groups.size() == mesh.face_groups.groups.size() + 1);
  CHECK(faces_of(found, "floor") == faces_of(mesh, "floor"));
  CHECK(faces_of(found, "slabs") == faces_of(mesh, "floor"));
}

TEST_CASE("exodus: a mesh without references and groups has none after reading", "[export]") {
  if (is_missing()) return;
  const TemporaryFolder folder;
  const VolumeMesh mesh = single_cell(CellKind::hex);
  write_volume(folder / "a.e", mesh);
  const VolumeMesh found = read_volume_mesh(folder / "a.e");
  CHECK(found.references.empty());
  CHECK(found.regions.empty());
  CHECK(found.face_groups.empty());
}

TEST_CASE("exodus: cells of order 2 are exact, and have nodes on edges only if that is all they need", "[export]") {
  if (is_missing()) return;
  const TemporaryFolder folder;
  PointSource source(3);
  const VolumeMesh cells = exodus_cells();
  const HighOrderMesh mesh = random_mesh(ElementSpace(cells, Basis::legendre, 2), source);
  const HighOrderFileOptions options{
      .references = cells.references, .face_groups = &cells.face_groups, .regions = cells.regions};
  write_volume(folder / "full.e", mesh, options);
  CHECK_NOTHROW(require_written(folder / "full.e", mesh, options));
  CHECK_THAT(content_of(folder / "full.e"), Contains("HEX27") && Contains("WEDGE18") && Contains("TETRA10"));
  const HighOrderFile full = read_curved(folder / "full.e");
  const std::vector<std::size_t> order = order_of(cells);
  for (std::size_t i = 0; i < order.size(); ++i)
    for (const Vec3& u : {Vec3(0.1, 0.2, 0.3), Vec3(0.5, 0.1, 0.2), Vec3(0.05, 0.6, 0.2)})
      CHECK((full.mesh.position(i, u) - mesh.position(order[i], u)).norm() < 1e-13);
  CHECK(full.face_groups == cells.face_groups);
  CHECK(full.regions == cells.regions);
  const HighOrderMesh edges = file_cells(mesh, ".inp").mesh;
  write_volume(folder / "edges.e", edges, options);
  CHECK_THAT(content_of(folder / "edges.e"), Contains("HEX20") && Contains("WEDGE15") && Contains("TETRA10"));
  const HighOrderFile read = read_curved(folder / "edges.e");
  for (std::size_t i = 0; i < order.size(); ++i)
    CHECK((read.mesh.position(i, {0.3, 0.3, 0.3}) - edges.position(order[i], {0.3, 0.3, 0.3})).norm() < 1e-13);
  CHECK(read.face_groups == cells.face_groups);
  const HighOrderMesh high = random_mesh(ElementSpace(cells, Basis::legendre, 3), source);
  CHECK_THROWS_WITH(write_volume(folder / "high.e", high), Contains("order 2 at most"));
}

TEST_CASE("exodus: VTK sees the same cells, curved and straight", "[export][consumer][slow]") {
  if (is_missing()) return;
  const TemporaryFolder folder;
  PointSource source(4);
  constexpr int kTypes[2][3] = {{10, 13, 12}, {24, 32, 29}};  // of VTK, by order and CellKind
  for (const int order : {1, 2}) {
    const VolumeMesh cells = mixed_cells();
    const HighOrderMesh mesh = random_mesh(ElementSpace(cells, Basis::legendre, order), source);
    write_volume(folder / "mesh.e", mesh);
    {
      std::ofstream out(folder / "queries");
      out.precision(17);
      const std::vector<std::size_t> written = order_of(cells);
      for (std::size_t i = 0; i < written.size(); ++i) {
        const CellKind kind = cells.kinds[written[i]];
        for (const Vec3& u : {Vec3(0.1, 0.2, 0.3), Vec3(0.5, 0.1, 0.2), Vec3(0.05, 0.6, 0.2), Vec3(0, 0.3, 0)}) {
          const Vec3 x = mesh.position(written[i], u);
          out << i << ' ' << kTypes[order - 1][static_cast<std::size_t>(kind)] << ' ' << num_lattice_points(kind, order)
              << ' ' << u.transpose() << ' ' << x.transpose() << '\n';
        }
      }
    }
    const int status = run_python("vtk_reader.py", folder / "mesh.e", folder / "queries");
    if (status == kSkippedStatus) {
      WARN("SKIPPED: needs a Python with VTK (python3-vtk9)");
      return;
    }
    CHECK(status == 0);
  }
}

TEST_CASE("exodus: damaged files are refused", "[export]") {
  if (is_missing()) return;
  const TemporaryFolder folder;
  const std::string bytes = exodus_bytes(nodal_mesh(exodus_cells()));
  const NodalMesh whole = read_nodal_mesh(folder.file("whole.e", bytes));
  for (std::size_t size = 0; size < bytes.size(); size += 1 + bytes.size() / 200) {
    try {  // what lacks only its last bytes, those of node sets, is the same mesh
      const NodalMesh mesh = read_nodal_mesh(folder.file("a.e", bytes.substr(0, size)));
      CHECK(size > bytes.size() / 2);
      CHECK(mesh.nodes == whole.nodes);
      CHECK(mesh.positions == whole.positions);
    } catch (const InputError&) {
    }
  }
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = bytes;
    REQUIRE(text.find(from) != std::string::npos);
    return folder.file("b.e", text.replace(text.find(from), from.size(), to));
  };
  CHECK_THROWS_WITH(read_nodal_mesh(changed("coordx", "coordw")), Contains("expected the variable coordx"));
  CHECK_THROWS_WITH(read_nodal_mesh(changed("HEX8", "PYRA")), Contains("pyramids"));
  CHECK_THROWS_WITH(read_nodal_mesh(changed("HEX8", "TET8")), Contains("8 nodes is not read"));
  CHECK_THROWS_WITH(read_nodal_mesh(folder.file("c.e", "no netCDF")), Contains("no netCDF file"));
  std::vector<std::string> warnings;
  CHECK(read_nodal_mesh(changed("HEX8", "SPH8")).warnings.size() == 1);
}

TEST_CASE("exodus: a header that claims more than the file holds is refused before memory is taken", "[export]") {
  if (is_missing()) return;
  const TemporaryFolder folder;
  const std::string bytes = exodus_bytes(nodal_mesh(exodus_cells()));
  const std::size_t header = bytes.find("connect1");  // all of the header but some of its variables
  REQUIRE(header != std::string::npos);
  std::size_t refused = 0;
  for (std::size_t at = 4; at < header; at += 4) {
    std::string text = bytes;
    text.replace(at, 4, "\x7f\xff\xff\xf0");  // 2 GB
    try {
      read_nodal_mesh(folder.file("a.e", text));
    } catch (const InputError&) {
      ++refused;
    }
  }
  CHECK(refused > header / 8);
  std::string text = bytes;
  text.replace(4, 8, std::string("\0\0\0\0\0\0\0\x0a", 8)).replace(12, 4, "\x7f\xff\xff\xf0");
  CHECK_THROWS_WITH(read_nodal_mesh(folder.file("b.e", text)),
                    Contains("netCDF header: claims more than the file holds"));
  // A dimension of length 0 beside that of the records: netCDF would divide by it.
  const std::size_t nodes = bytes.find("num_nodes");
  text = bytes;
  text.replace(text.find("num_dim") + 8, 4, std::string(4, '\0'));
  CHECK_THROWS_AS(read_nodal_mesh(folder.file("c.e", text)), InputError);
  text = bytes;
  text.replace(nodes + 12, 4, std::string(4, '\0'));
  CHECK_THROWS_AS(read_nodal_mesh(folder.file("d.e", text)), InputError);
}

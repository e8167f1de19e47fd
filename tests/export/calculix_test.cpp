// SPDX-License-Identifier: GPL-3.0-or-later
// CalculiX computes on what is written for it. Skipped without the program (calculix-ccx).

#include "subvol/export/high_order_file.h"
#include "subvol/export/volume_writer.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <map>
#include <sstream>

using namespace subvol;
using namespace subvol::test;

namespace {

bool has_ccx() {
  if (std::system("command -v ccx >/dev/null 2>&1") == 0) return true;
  WARN("SKIPPED: needs CalculiX (calculix-ccx)");
  return false;
}

/// Runs a model and returns the displacements of the set NALL, by node.
std::map<int, Vec3> displacements(const TemporaryFolder& folder, const std::string& model) {
  folder.file("job.inp", model);
  const std::string command = "cd " + folder.path().string() + " && OMP_NUM_THREADS=1 ccx job >log 2>&1";
  REQUIRE(std::system(command.c_str()) == 0);
  std::istringstream lines(content_of(folder / "job.dat"));
  std::map<int, Vec3> result;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    int node = 0;
    Vec3 u;
    if (words >> node >> u[0] >> u[1] >> u[2]) result[node] = u;
  }
  return result;
}

const std::string kMaterial =
    "*MATERIAL, NAME=STEEL\n*ELASTIC\n1000., 0.3\n*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL\n";
const std::string kEnd = "*NODE PRINT, NSET=NALL\nU\n*END STEP\n";

/// Displacement of a patch test: any affine map.
Vec3 affine(const Vec3& x) {
  return {0.001 * x[0] + 0.002 * x[1] - 0.001 * x[2], 0.0005 * x[0] - 0.001 * x[1] + 0.001 * x[2],
          0.002 * x[0] + 0.001 * x[2]};
}

/// Prescribes the affine displacement at the nodes for which `is_outer` holds.
std::string patch_model(const std::string& mesh, const std::map<int, Vec3>& nodes,
                        const std::function<bool(const Vec3&)>& is_outer) {
  std::ostringstream text;
  text.precision(17);
  text << mesh << kMaterial << "*STEP\n*STATIC\n*BOUNDARY\n";
  for (const auto& [node, x] : nodes)
    for (int k = 0; is_outer(x) && k < 3; ++k)
      text << node << ", " << k + 1 << ", " << k + 1 << ", " << affine(x)[k] << '\n';
  text << kEnd;
  return text.str();
}

std::map<int, Vec3> nodes_of(const std::string& inp) {
  std::map<int, Vec3> nodes;
  std::istringstream lines(inp.substr(inp.find("*NODE")));
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line) && line[0] != '*') {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    int node = 0;
    Vec3 x;
    words >> node >> x[0] >> x[1] >> x[2];
    nodes[node] = x;
  }
  return nodes;
}

}  // namespace

TEST_CASE("CalculiX passes the patch test on hexes of both orders", "[consumer]") {
  if (!has_ccx()) return;
  VolumeMesh mesh = lattice(2, 2, 2);
  const auto is_outer = [](const Vec3& x) { return (x.array() < 1e-9).any() || (x.array() > 2 - 1e-9).any(); };
  for (Vec3& x : mesh.positions)
    if (!is_outer(x)) x += Vec3(0.2, -0.15, 0.1);
  for (const int order : {1, 2}) {
    CAPTURE(order);
    const TemporaryFolder folder;
    if (order == 1)
      write_volume(folder / "mesh.inp", mesh);
    else
      write_volume(folder / "mesh.inp", HighOrderMesh(ElementSpace(mesh, Basis::legendre, 2), mesh));
    const std::string inp = content_of(folder / "mesh.inp");
    CHECK((inp.find(order == 1 ? "C3D8," : "C3D20,") != std::string::npos));
    const std::map<int, Vec3> nodes = nodes_of(inp);
    const std::map<int, Vec3> found = displacements(folder, patch_model(inp, nodes, is_outer));
    REQUIRE(found.size() == nodes.size());
    for (const auto& [node, x] : nodes) CHECK((found.at(node) - affine(x)).norm() < 1e-7);
  }
}

TEST_CASE("CalculiX bends a cantilever of C3D8 and of C3D20 by the right amount, held and loaded by group names",
          "[consumer]") {
  if (!has_ccx()) return;
  for (const int order : {1, 2}) {
    CAPTURE(order);
    const int across = order == 1 ? 6 : 1;  // linear cells need more of them
    VolumeMesh mesh = lattice(10 * across, across, across);
    for (Vec3& p : mesh.positions) p /= across;
    const Group held{"held end", 1, 2}, loaded{"loaded", 2, 2};
    mesh.face_groups.groups = {held, loaded};
    for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
      const auto cell = mesh.cell(c);
      const auto add = [&](std::array<Index, 4> corners, Index group) {
        mesh.face_groups.faces.push_back({face_key(corners), group});
      };
      if (mesh.positions[cell[0]][0] == 0) add({cell[0], cell[3], cell[7], cell[4]}, 0);
      if (mesh.positions[cell[1]][0] == 10) add({cell[1], cell[2], cell[6], cell[5]}, 1);
    }
    normalize(mesh.face_groups);
    const TemporaryFolder folder;
    if (order == 1) {
      write_volume(folder / "mesh.inp", mesh);
    } else {
      const HighOrderMesh curved(ElementSpace(mesh, Basis::legendre, order), mesh);
      write_volume(folder / "mesh.inp", curved, {.face_groups = &mesh.face_groups});
    }
    const std::string inp = content_of(folder / "mesh.inp");
    CHECK(inp.find(order == 1 ? "TYPE=C3D8" : "TYPE=C3D20") != std::string::npos);
    const int loaded_nodes = order == 1 ? 49 : 8;  // 0.1 in all
    const std::string model = inp + kMaterial + "*STEP\n*STATIC\n*BOUNDARY\nheld_end, 1, 3\n*CLOAD\nloaded, 3, " +
                              std::to_string(-0.1 / loaded_nodes) + "\n" + kEnd;
    const std::map<int, Vec3> found = displacements(folder, model);
    double most = 0;
    for (const auto& [node, u] : found) most = std::max(most, -u[2]);
    // F l^3 / (3 E I) + F l / (k G A), k = 5/6: 0.4 + 0.0031; the cells and an end that cannot contract are stiffer.
    CHECK(most == Approx(0.4031).epsilon(0.03));
  }
}

// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes of other programs: every node of a sheared, bent cell has one right place.

#include "subvol/export/curved_file.h"
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/export/nodal_export.h"
#include "subvol/export/volume_writer.h"
#include "subvol/io/bezier_cells.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/nodal_writers.h"
#include "subvol/io/node_points.h"
#include "tests/support/require_data.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <utility>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;
using Catch::Matchers::Contains;

namespace {

using Pairs = std::vector<std::pair<int, int>>;

/// A quadratic polynomial without symmetries, which is a sheared and bent cell.
Vec3 bent(const Vec3& u) {
  return {2 * u[0] + 0.3 * u[1] + 0.1 * u[2] * u[2] + 1, u[1] + 0.2 * u[2] + 0.15 * u[0] * u[0],
          1.5 * u[2] + 0.1 * u[0] * u[1] - 0.2 * u[1] * u[1]};
}

std::vector<Vec3> corners_of(CellKind kind) {
  const auto corners = canonical_vertices(kind);
  return {corners.begin(), corners.end()};
}

/// The nodes of a cell of order 2: its corners and the middles between pairs of them.
std::vector<Vec3> quadratic_nodes(std::vector<Vec3> corners, const Pairs& pairs) {
  std::vector<Vec3> nodes = std::move(corners);
  for (const auto& [a, b] : pairs)
    nodes.push_back((nodes[static_cast<std::size_t>(a)] + nodes[static_cast<std::size_t>(b)]) / 2);
  return nodes;
}

// Edges in the order of the formats' manuals.
const Pairs kTet{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
const Pairs kGmshTet{{0, 1}, {1, 2}, {0, 2}, {0, 3}, {2, 3}, {1, 3}};
const Pairs kPrism{{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}};
const Pairs kNastranPrism{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 4}, {2, 5}, {3, 4}, {4, 5}, {5, 3}};
const Pairs kGmshPrism{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 4}, {2, 5}, {3, 4}, {3, 5}, {4, 5}};
const Pairs kHex{{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6}, {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
const Pairs kNastranHex{{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 4}, {1, 5}, {2, 6}, {3, 7}, {4, 5}, {5, 6}, {6, 7}, {7, 4}};
const Pairs kGmshHex{{0, 1}, {0, 3}, {0, 4}, {1, 2}, {1, 5}, {2, 3}, {2, 6}, {3, 7}, {4, 5}, {4, 7}, {5, 6}, {6, 7}};

std::string number(double value) {
  std::string text;
  append_number(text, value);
  return text;
}

std::string list(std::size_t first, std::size_t count, const char* separator) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += (i ? separator : "") + std::to_string(first + i);
  return text;
}

std::string position(const Vec3& u, const char* separator) {
  const Vec3 x = bent(u);
  return number(x[0]) + separator + number(x[1]) + separator + number(x[2]);
}

/// Numbers of nodes do not begin at 1 and are not in order: 1000 - i.
std::string inp(const std::vector<Vec3>& nodes, const char* type) {
  std::string text = "** a comment\n*Node\n", element = "7";
  for (std::size_t i = 0; i < nodes.size(); ++i)
    text += std::to_string(1000 - i) + ", " + position(nodes[i], ", ") + "\n";
  for (std::size_t i = 0; i < nodes.size(); ++i) element += (i == 9 ? ",\n" : ", ") + std::to_string(1000 - i);
  return text + "*Element, type=" + type + "\n" + element + "\n";
}

std::string bdf(const std::vector<Vec3>& nodes, const char* card) {
  std::string text = "BEGIN BULK\n", element = std::string(card) + ",7,3";
  for (std::size_t i = 0; i < nodes.size(); ++i)
    text += "GRID," + std::to_string(1000 - i) + ",," + position(nodes[i], ",") + "\n";
  for (std::size_t i = 0; i < nodes.size(); ++i) element += ((i + 2) % 8 == 0 ? "\n," : ",") + std::to_string(1000 - i);
  return text + element + "\nENDDATA\n";
}

std::string msh2(const std::vector<Vec3>& nodes, int type) {
  std::string text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + std::to_string(nodes.size()) + "\n";
  for (std::size_t i = 0; i < nodes.size(); ++i) text += std::to_string(5 + i) + " " + position(nodes[i], " ") + "\n";
  return text + "$EndNodes\n$Elements\n1\n3 " + std::to_string(type) + " 2 4 1 " + list(5, nodes.size(), " ") +
         "\n$EndElements\n";
}

std::string vtk(const std::vector<Vec3>& nodes, int type) {
  std::string text = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS " +
                     std::to_string(nodes.size()) + " double\n";
  for (const Vec3& u : nodes) text += position(u, " ") + "\n";
  return text + "CELLS 1 " + std::to_string(nodes.size() + 1) + "\n" + std::to_string(nodes.size()) + " " +
         list(0, nodes.size(), " ") + "\nCELL_TYPES 1\n" + std::to_string(type) + "\n";
}

std::string vtu(const std::vector<Vec3>& nodes, int type) {
  std::string text = "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\"><UnstructuredGrid><Piece NumberOfPoints=\"" +
                     std::to_string(nodes.size()) +
                     "\" NumberOfCells=\"1\"><Points><DataArray type=\"Float64\" "
                     "NumberOfComponents=\"3\" format=\"ascii\">\n";
  for (const Vec3& u : nodes) text += position(u, " ") + "\n";
  const auto array = [](const std::string& name, const std::string& values) {
    return "<DataArray type=\"Int64\" Name=\"" + name + "\" format=\"ascii\">" + values + "</DataArray>\n";
  };
  return text + "</DataArray></Points><Cells>" + array("connectivity", list(0, nodes.size(), " ")) +
         array("offsets", std::to_string(nodes.size())) + array("types", std::to_string(type)) +
         "</Cells></Piece></UnstructuredGrid></VTKFile>\n";
}

void require_bent(const std::filesystem::path& file, CellKind kind) {
  CAPTURE(file);
  REQUIRE(std::holds_alternative<NodalMesh>(read_cells(file)));
  const HighOrderFile read = read_curved(file);
  REQUIRE(read.mesh.space.num_cells() == 1);
  REQUIRE(read.mesh.space.kind(0) == kind);
  for (const Vec3& u : {Vec3(0.1, 0.2, 0.3), Vec3(0.5, 0.1, 0.2), Vec3(0.3, 0.3, 0.1), Vec3(0.05, 0.6, 0.2)})
    CHECK((read.mesh.position(0, u) - bent(u)).norm() < 1e-12);
}

VolumeMesh cells_of_all_kinds() {
  VolumeMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0},     {0, 1, 0},     {0, 0, 1},      {1, 0, 1.25},
                    {1, 1, 1}, {0, 1, 1}, {2, 0.5, 0.1}, {2, 0.5, 1.1}, {1.3, 0.5, 2.3}};
  mesh.add_cell(CellKind::hex, std::array<Index, 8>{0, 1, 2, 3, 4, 5, 6, 7});
  mesh.add_cell(CellKind::prism, std::array<Index, 6>{1, 8, 2, 5, 9, 6});
  mesh.add_cell(CellKind::tet, std::array<Index, 4>{5, 9, 6, 10});
  mesh.references = {2, 3, 5};
  return mesh;
}

void write_straight(const std::filesystem::path& path, const VolumeMesh& mesh) {
  const std::string extension = path.extension().string();
  extension == ".mesh" || extension == ".vtk" ? write_volume_mesh(path, mesh) : write_volume(path, mesh);
}

void require_same(const VolumeMesh& a, const VolumeMesh& b, double tolerance) {
  REQUIRE(a.num_vertices() == b.num_vertices());
  for (std::size_t v = 0; v < a.num_vertices(); ++v) CHECK((a.positions[v] - b.positions[v]).norm() <= tolerance);
  CHECK(a.kinds == b.kinds);
  CHECK(a.cell_vertices == b.cell_vertices);
  CHECK(a.references == b.references);
}

/// The mixed cells with modes that are no symmetric shape.
HighOrderMesh curved_cells(int order) {
  const VolumeMesh cells = cells_of_all_kinds();
  HighOrderMesh mesh(ElementSpace(cells, Basis::legendre, order), cells);
  for (std::size_t n = cells.num_vertices(); n < mesh.coefficients.size(); ++n) {
    const double s = static_cast<double>(n);
    mesh.coefficients[n] = Vec3(std::sin(1.3 * s), std::cos(2.1 * s), std::sin(0.7 * s + 1)) * 0.02;
  }
  return mesh;
}

}  // namespace

TEST_CASE("curved_file: quadratic cells of every format have their nodes in the right places", "[export]") {
  const TemporaryFolder folder;
  const std::vector<Vec3> tet = corners_of(CellKind::tet), prism = corners_of(CellKind::prism),
                          hex = corners_of(CellKind::hex);
  const std::vector<Vec3> wedge{prism[0], prism[2], prism[1], prism[3], prism[5], prism[4]};
  require_bent(folder.file("t.inp", inp(quadratic_nodes(tet, kTet), "C3D10")), CellKind::tet);
  require_bent(folder.file("p.inp", inp(quadratic_nodes(prism, kPrism), "C3D15")), CellKind::prism);
  require_bent(folder.file("h.inp", inp(quadratic_nodes(hex, kHex), "C3D20R")), CellKind::hex);
  require_bent(folder.file("t.bdf", bdf(quadratic_nodes(tet, kTet), "CTETRA")), CellKind::tet);
  require_bent(folder.file("p.bdf", bdf(quadratic_nodes(prism, kNastranPrism), "CPENTA")), CellKind::prism);
  require_bent(folder.file("h.bdf", bdf(quadratic_nodes(hex, kNastranHex), "CHEXA")), CellKind::hex);
  require_bent(folder.file("t.msh", msh2(quadratic_nodes(tet, kGmshTet), 11)), CellKind::tet);
  require_bent(folder.file("p.msh", msh2(quadratic_nodes(prism, kGmshPrism), 18)), CellKind::prism);
  require_bent(folder.file("h.msh", msh2(quadratic_nodes(hex, kGmshHex), 17)), CellKind::hex);
  require_bent(folder.file("t.vtk", vtk(quadratic_nodes(tet, kTet), 24)), CellKind::tet);
  require_bent(folder.file("p.vtk", vtk(quadratic_nodes(wedge, kPrism), 26)), CellKind::prism);
  require_bent(folder.file("h.vtk", vtk(quadratic_nodes(hex, kHex), 25)), CellKind::hex);
  require_bent(folder.file("t.vtu", vtu(quadratic_nodes(tet, kTet), 24)), CellKind::tet);
  require_bent(folder.file("p.vtu", vtu(quadratic_nodes(wedge, kPrism), 26)), CellKind::prism);
  require_bent(folder.file("h.vtu", vtu(quadratic_nodes(hex, kHex), 25)), CellKind::hex);
  // With the middles of faces: those of VTK by coordinates, those of Abaqus after the middle of the cell.
  std::vector<Vec3> nodes = quadratic_nodes(hex, kHex);
  for (const Vec3& u : {Vec3(0, .5, .5), Vec3(1, .5, .5), Vec3(.5, 0, .5), Vec3(.5, 1, .5), Vec3(.5, .5, 0),
                        Vec3(.5, .5, 1), Vec3(.5, .5, .5)})
    nodes.push_back(u);
  require_bent(folder.file("h27.vtk", vtk(nodes, 29)), CellKind::hex);
  nodes.resize(20);
  for (const Vec3& u : {Vec3(.5, .5, .5), Vec3(.5, .5, 0), Vec3(.5, .5, 1), Vec3(.5, 0, .5), Vec3(1, .5, .5),
                        Vec3(.5, 1, .5), Vec3(0, .5, .5)})
    nodes.push_back(u);
  require_bent(folder.file("h27.inp", inp(nodes, "C3D27")), CellKind::hex);
}

TEST_CASE("curved_file: linear meshes go from format to format and back", "[export]") {
  const TemporaryFolder folder;
  const VolumeMesh mesh = cells_of_all_kinds();
  const std::vector<std::string> formats{"mesh", "vtk", "vtu", "msh", "inp", "bdf", "mfem", "e"};
  for (const std::string& a : formats)
    for (const std::string& b : formats) {
      CAPTURE(a, b);
      const double tolerance = a == "bdf" || b == "bdf" ? 1e-12 : 0;
      const std::filesystem::path first = folder.path() / ("a." + a), second = folder.path() / ("b." + b);
      // Medit has hexes first, then prisms and tets; so have all others here.
      write_straight(first, mesh);
      const VolumeMesh one = read_volume_mesh(first);
      require_same(one, mesh, tolerance);
      write_straight(second, one);
      const VolumeMesh two = read_volume_mesh(second);
      require_same(two, mesh, tolerance);
      write_straight(first, two);
      require_same(read_volume_mesh(first), mesh, tolerance);
    }
}

TEST_CASE("curved_file: curved meshes come back as the same polynomials", "[export]") {
  const TemporaryFolder folder;
  for (const int order : {1, 2, 3, 5}) {
    const HighOrderMesh mesh = curved_cells(order);
    for (const std::string extension : {".msh", ".mfem"}) {
      if (extension == ".msh" && order > 2) continue;  // Gmsh's prisms end there
      CAPTURE(order, extension);
      const std::filesystem::path path = folder.path() / ("mesh" + extension);
      const std::vector<int> references{2, 3, 5};
      write_volume(path, mesh, {.references = references});
      const HighOrderFile read = read_curved(path);
      REQUIRE(read.mesh.space.num_cells() == 3);
      if (extension == ".mfem") {  // a .msh has its cells by reference, too
        CHECK(read.mesh.space.max_order() == order);
      }
      CHECK(read.references == references);
      CHECK(sampled_distance(mesh, read.mesh, 7) < 1e-12);
    }
  }
}

TEST_CASE("curved_file: Bezier cells of a foreign .vtu are read as their polynomials", "[export]") {
  const TemporaryFolder folder;
  const HighOrderMesh mesh = curved_cells(3);
  std::string text = vtu_text(mesh, {.vtu_cells = VtuCells::bezier});
  const auto replace = [&](const std::string& from, const std::string& to) {
    REQUIRE(text.find(from) != std::string::npos);
    text.replace(text.find(from), from.size(), to);
  };
  replace("subvol_format", "foreign_format");  // the exact map is not taken
  CHECK(sampled_distance(mesh, read_curved(folder.file("a.vtu", text)).mesh, 7) < 1e-12);
  const auto with_weights = [&](const std::string& weights) {
    replace("<CellData>", "<PointData><DataArray type=\"Float64\" Name=\"RationalWeights\" format=\"ascii\">" +
                              weights + "</DataArray></PointData><CellData>");
    return folder.file("b.vtu", text);
  };
  CHECK_THROWS_WITH(read_curved(with_weights("1 1 0.5")), Contains("rational Bezier cells are no polynomials"));
}

TEST_CASE("curved_file: Bezier cells that share a point, but no edge or face, are refused", "[export]") {
  NodalMesh mesh;
  NodalCells cells(mesh);
  for (const double x : {0.0, 2.0}) {
    std::vector<Index> nodes;
    for (const LatticePoint& at : cell_lattice(CellKind::hex, 2, NodeOrdering::vtk)) {
      nodes.push_back(static_cast<Index>(mesh.positions.size()));
      mesh.positions.push_back(at.cast<double>() / 2 + Vec3(x + 0.2 * at[1] * at[1], 0, 0));
    }
    if (x > 0) nodes[8] = 8;  // the middle of an edge of the first cell
    cells.add(CellKind::hex, 2, NodeOrdering::vtk, nodes);
  }
  const std::vector<std::size_t> both{0, 1};
  CHECK_THROWS_WITH(control_points_to_nodes(mesh, both), Contains("cells 0 and 1 share point 8"));
}

TEST_CASE("curved_file: an order-2 mesh becomes C3D20 with its edges on the curve", "[export]") {
  const TemporaryFolder folder;
  const HighOrderMesh mesh = curved_cells(2);
  for (const std::string extension : {".inp", ".bdf"}) {
    CAPTURE(extension);
    const std::filesystem::path path = folder.path() / ("mesh" + extension);
    write_volume(path, mesh);
    const HighOrderMesh read = read_curved(path).mesh;
    const double tolerance = extension == ".bdf" ? 1e-7 : 1e-12;
    const PolynomialMap cells = file_cells(mesh, extension);
    CHECK(cells.distance_bound > 0);
    CHECK(sampled_distance(cells.mesh, read, 7) < tolerance);
    CHECK(sampled_distance(mesh, read, 7) <= cells.distance_bound + tolerance);
    for (const Vec3& u : {Vec3(0.3, 0, 0), Vec3(1, 0.7, 0), Vec3(0, 0, 0.6)})  // on edges
      CHECK((mesh.position(0, u) - read.position(0, u)).norm() < tolerance);
  }
  CHECK_THROWS_WITH(write_volume(folder / "high.inp", curved_cells(3)), Contains("order 2 at most"));
}

TEST_CASE("curved_file: cells of several orders are joined, and gaps are refused", "[export]") {
  const TemporaryFolder folder;
  // Two hexes in a row, of 8 and of 27 nodes with straight edges.
  NodalMesh mesh;
  NodalCells cells(mesh);
  const auto add_hex = [&](double x, int order) {
    std::vector<Index> nodes;
    for (const LatticePoint& at : cell_lattice(CellKind::hex, order, NodeOrdering::vtk)) {
      const Vec3 p = at.cast<double>() / order + Vec3(x, 0, 0);
      Index found = kNoIndex;
      for (std::size_t n = 0; n < mesh.positions.size(); ++n)
        if (mesh.positions[n] == p) found = static_cast<Index>(n);
      if (found == kNoIndex) {
        found = static_cast<Index>(mesh.positions.size());
        mesh.positions.push_back(p);
      }
      nodes.push_back(found);
    }
    cells.add(CellKind::hex, order, NodeOrdering::vtk, nodes);
  };
  add_hex(0, 1);
  add_hex(1, 2);
  const HighOrderMesh joined = curved_mesh("two", mesh).mesh;
  CHECK(joined.space.max_order() == 2);
  CHECK(joined.space.num_vertices() == 12);
  CHECK((joined.position(1, {0.5, 0.5, 0.5}) - Vec3(1.5, 0.5, 0.5)).norm() < 1e-14);
  mesh.positions[mesh.cell(1)[11]] += Vec3(0.1, 0, 0);  // the middle of an edge of the common face
  CHECK_THROWS_WITH(curved_mesh("two", mesh), Contains("curve it differently"));
}

TEST_CASE("curved_file: reported files are read exactly", "[export]") {
  const auto data = require_data();
  if (!data) return;
  const std::filesystem::path folder = *data / "reported";
  const VolumeMesh msh = read_volume_mesh(folder / "04-m.msh");
  REQUIRE(msh.num_cells() == 1);
  const VolumeMesh inp_mesh = read_volume_mesh(folder / "05-m.inp");
  REQUIRE(inp_mesh.num_cells() == 1);
  for (const VolumeMesh& mesh : {msh, inp_mesh}) {
    CHECK(mesh.positions[mesh.cell(0)[6]] == Vec3(1, 1, 1));
    CHECK(mesh.references.empty());
  }
  const HighOrderFile hex = read_curved(folder / "06-hex20.vtk");
  CHECK(hex.mesh.space.max_order() == 2);
  CHECK((hex.mesh.position(0, {0.5, 0, 0}) - Vec3(0.5, 0, 0)).norm() < 1e-14);
  CHECK((hex.mesh.position(0, {1, 1, 0.5}) - Vec3(1.35, 1.1, 0.5)).norm() < 1e-14);
}

TEST_CASE("faces of groups that are faces of no curved cell are dropped with a warning", "[export][quick]") {
  std::string text =
      "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\nGRID,5,,.5,.1,.1\nGRID,6,,9.,0.,0.\n"
      "CTETRA,1,1,1,2,3,4,5\nCTRIA3,2,8,1,2,6\n";
  const TemporaryFolder folder;
  std::vector<std::string> warnings;
  CHECK(read_curved(folder.file("a.bdf", text), &warnings).face_groups.empty());
  REQUIRE(warnings.size() == 1);
  CHECK(warnings[0].ends_with("a.bdf: 1 faces with a group are faces of no cell: dropped"));
  text += "CTRIA3,3,7,1,2,3\n";
  warnings.clear();
  CHECK(read_curved(folder.file("b.bdf", text), &warnings).face_groups.faces.size() == 1);
  CHECK(warnings.size() == 1);
}

// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/high_order_file.h"

#include "subvol/base/error.h"
#include "subvol/export/cell_text.h"
#include "subvol/export/lagrange_mesh.h"
#include "subvol/export/read_back.h"
#include "subvol/fit/elements/quadrature.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/io/mesh_io.h"
#include "subvol/mesh/validate.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/run_python.h"
#include "tests/support/skipping.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <fstream>
#include <numeric>
#include <set>
#include <utility>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;
using Catch::Contains;

namespace {

/// All kinds in one mesh; orders between 1 and `max_order` that differ from part to part.
HighOrderMesh mixed_orders(Basis basis, int max_order, PointSource& source) {
  const VolumeMesh cells = renumbered(mixed_cells(), source.random());
  const MeshTopology topology(cells);
  EntityOrders orders = EntityOrders::uniform(topology, 1);
  const auto draw = [&](std::vector<int>& list) {
    for (int& order : list) order = 1 + static_cast<int>(source.number() * max_order);
  };
  draw(orders.edges), draw(orders.faces), draw(orders.cells);
  orders.edges[0] = max_order;
  orders.raise_borders(topology);
  return random_mesh(ElementSpace(cells, basis, orders), source);
}

HighOrderMesh of_one_order(CellKind kind, Basis basis, int order, PointSource& source) {
  return random_mesh(ElementSpace(single_cell(kind), basis, order), source);
}

std::string refusal(const std::string& bytes) {
  const TemporaryFolder folder;
  try {
    read_high_order(folder.file("in.vtu", bytes));
  } catch (const InputError& error) {
    CHECK_THAT(error.what(), Contains("in.vtu: "));
    return error.what();
  }
  return "";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  REQUIRE(text.find(from) != std::string::npos);
  return text.replace(text.find(from), from.size(), to);
}

/// The cell's position and derivatives at a point, for the readers.
void write_query(std::ostream& out, const std::string& what, const HighOrderMesh& mesh, std::size_t c, const Vec3& at) {
  const Vec3 position = mesh.position(c, at);
  const Mat3 jacobian = mesh.jacobian(c, at);
  out.precision(17);
  out << what;
  for (const double x : at) out << ' ' << x;
  for (const double x : position) out << ' ' << x;
  for (int column = 0; column < 3; ++column)
    for (const double x : jacobian.col(column)) out << ' ' << x;
  out << '\n';
}

constexpr VtuCells kBothCells[] = {VtuCells::lagrange, VtuCells::bezier};
const std::vector<int> kVtkTypes{71, 73, 72};  // by CellKind; 7 more for Bezier cells

/// Points between the nodes of any order, and on the cell's border.
std::vector<Vec3> dense_points(CellKind kind) { return make_quadrature(kind, QuadratureRule::trapezoidal, 7).points; }

/// Writes the mesh and compares the cells that VTK reads with those of `file_cells`, which are certified.
int compare_with_vtk(const HighOrderMesh& mesh, VtuCells vtu_cells) {
  const TemporaryFolder folder;
  write_volume(folder / "mesh.vtu", mesh, {.vtu_cells = vtu_cells});
  const HighOrderMesh cells = file_cells(mesh, ".vtu").mesh;
  {
    std::ofstream out(folder / "queries");
    const std::vector<int> orders = lagrange_orders(cells.space, kMaxVtkOrder);
    for (std::size_t c = 0; c < orders.size(); ++c) {
      const CellKind kind = cells.space.kind(c);
      const int type = kVtkTypes[static_cast<std::size_t>(kind)] + (vtu_cells == VtuCells::bezier ? 7 : 0);
      const std::string what =
          std::to_string(c) + ' ' + std::to_string(type) + ' ' + std::to_string(num_lattice_points(kind, orders[c]));
      for (const Vec3& at : dense_points(kind)) write_query(out, what, cells, c, at);
    }
  }
  return run_python("vtk_reader.py", folder / "mesh.vtu", folder / "queries");
}

/// Cells side by side, each of its own kind and order, with random modes that fall off as those of fitted meshes do.
HighOrderMesh separate_cells(Basis basis, const std::vector<std::pair<CellKind, int>>& kinds_and_orders,
                             PointSource& source) {
  VolumeMesh cells;
  std::vector<int> cell_orders;
  for (const auto& [kind, order] : kinds_and_orders) {
    std::vector<Index> corners;
    for (const Vec3& p : single_cell(kind).positions) {
      corners.push_back(static_cast<Index>(cells.num_vertices()));
      cells.positions.push_back(p + Vec3(0.1 * order, 0, 0));
    }
    cells.add_cell(kind, corners);
    cell_orders.push_back(order);
  }
  const MeshTopology topology(cells);
  EntityOrders orders = EntityOrders::uniform(topology, 1);
  orders.cells = cell_orders;
  orders.raise_borders(topology);
  return random_mesh(ElementSpace(cells, basis, orders), source);
}

}  // namespace

TEST_CASE("grids list every point of a cell once, corners first") {
  for (const CellKind kind : kAllKinds)
    for (int order = 1; order <= 7; ++order)
      for (const NodeOrdering ordering : {NodeOrdering::vtk, NodeOrdering::gmsh, NodeOrdering::rows}) {
        if (ordering == NodeOrdering::gmsh && kind == CellKind::prism && order > 2) continue;
        CAPTURE(cell_topology(kind).name, order, static_cast<int>(ordering));
        const auto points = cell_lattice(kind, order, ordering);
        const auto rows = cell_lattice(kind, order, NodeOrdering::rows);
        const auto as_set = [](const std::vector<LatticePoint>& list) {
          std::set<std::array<int, 3>> set;
          for (const LatticePoint& p : list) set.insert({p[0], p[1], p[2]});
          return set;
        };
        CHECK(points.size() == rows.size());
        CHECK(as_set(points).size() == rows.size());
        CHECK(as_set(points) == as_set(rows));
        if (ordering == NodeOrdering::rows) continue;
        const auto corners = canonical_vertices(kind);
        for (std::size_t k = 0; k < corners.size(); ++k) CHECK(points[k].cast<double>() == order * corners[k]);
      }
  CHECK_THROWS_AS(cell_lattice(CellKind::hex, 0, NodeOrdering::vtk), InputError);
  CHECK_THROWS_AS(cell_lattice(CellKind::prism, 3, NodeOrdering::gmsh), InputError);
}

TEST_CASE("Lagrange cells have their points on the map, and common points once") {
  PointSource source(3);
  for (const Basis basis : kBothBases) {
    const HighOrderMesh mesh = mixed_orders(basis, 5, source);
    const std::vector<int> orders = lagrange_orders(mesh.space, 12);
    const LagrangeMesh cells = lagrange_mesh(mesh, orders, NodeOrdering::vtk);
    for (std::size_t c = 0; c < orders.size(); ++c) {
      const auto grid = cell_lattice(mesh.space.kind(c), orders[c], NodeOrdering::vtk);
      REQUIRE(cells.cell(c).size() == grid.size());
      for (std::size_t q = 0; q < grid.size(); ++q)
        CHECK((cells.positions[cells.cell(c)[q]] - mesh.position(c, grid[q].cast<double>() / orders[c])).norm() <
              1e-13);
    }
  }
  const ElementSpace two(lattice(2, 1, 1), Basis::legendre, 3);
  const std::vector<int> orders(2, 3);
  CHECK(lagrange_mesh(random_mesh(two, source), orders, NodeOrdering::vtk).positions.size() == 7 * 4 * 4);
  CHECK_THROWS_AS(lagrange_mesh(random_mesh(two, source), std::vector<int>{3}, NodeOrdering::vtk), InputError);
}

TEST_CASE("a high-order .vtu reloads exactly", "[slow]") {
  const TemporaryFolder folder;
  PointSource source(11);
  for (const Basis basis : kBothBases)
    for (const int max_order : {1, 2, 4, 7}) {
      CAPTURE(to_string(basis), max_order);
      const HighOrderMesh mesh = mixed_orders(basis, max_order, source);
      const std::vector<int> references{3, 0, -2, 3};
      const std::vector<double> minima{0.5, 0.25, 0.125, 1};
      write_volume(folder / "mesh.vtu", mesh, {.cell_minima = minima, .references = references});
      const HighOrderFile file = read_high_order(folder / "mesh.vtu");
      const ElementSpace& space = file.mesh.space;
      CHECK(space.basis() == basis);
      CHECK(space.orders().edges == mesh.space.orders().edges);
      CHECK(space.orders().faces == mesh.space.orders().faces);
      CHECK(space.orders().cells == mesh.space.orders().cells);
      CHECK(file.mesh.coefficients == mesh.coefficients);
      CHECK(file.references == references);
      for (std::size_t c = 0; c < space.num_cells(); ++c) {
        CHECK(space.kind(c) == mesh.space.kind(c));
        const auto found = space.vertices(c), expected = mesh.space.vertices(c);
        CHECK(std::vector<Index>(found.begin(), found.end()) == std::vector<Index>(expected.begin(), expected.end()));
      }
      CHECK(vtu_text(file.mesh, {.cell_minima = minima, .references = references}) == content_of(folder / "mesh.vtu"));
    }
}

TEST_CASE("orders beyond VTK's reload too") {
  PointSource source(12);
  const TemporaryFolder folder;
  const HighOrderMesh mesh = of_one_order(CellKind::tet, Basis::fourier, kMaxOrder, source);
  write_volume(folder / "mesh.vtu", mesh);
  CHECK(read_high_order(folder / "mesh.vtu").mesh.coefficients == mesh.coefficients);
}

TEST_CASE("high_order_file: VTK reconstructs the cells that are certified, between their points too",
          "[export][slow]") {
  PointSource source(5);
  int status = 0;
  for (const Basis basis : kBothBases) {
    if (status == kSkippedStatus) break;
    // One file for each kind and order would start Python seventy times.
    std::vector<std::pair<CellKind, int>> kinds_and_orders;
    for (const CellKind kind : kAllKinds)
      for (int order = 1; order <= kMaxVtkOrder; ++order) kinds_and_orders.emplace_back(kind, order);
    for (const VtuCells vtu_cells : kBothCells) {
      if (basis == Basis::fourier && vtu_cells == VtuCells::bezier) continue;  // a control point knows no basis
      status = compare_with_vtk(separate_cells(basis, kinds_and_orders, source), vtu_cells);
      if (status != kSkippedStatus) CHECK(status == 0);
      if (status != kSkippedStatus) CHECK(compare_with_vtk(mixed_orders(basis, 6, source), vtu_cells) == 0);
    }
  }
  if (status == kSkippedStatus) WARN("SKIPPED: needs a Python with VTK (python3-vtk9)");
}

TEST_CASE("high_order_file: Gmsh reconstructs the cells that are certified, between their points too",
          "[export][slow]") {
  const TemporaryFolder folder;
  PointSource source(6);
  std::vector<std::pair<CellKind, int>> kinds_and_orders;
  for (const CellKind kind : kAllKinds)
    for (int order = 1; order <= max_gmsh_order(kind); ++order) kinds_and_orders.emplace_back(kind, order);
  for (const Basis basis : kBothBases) {
    const HighOrderMesh mesh = separate_cells(basis, kinds_and_orders, source);
    write_volume(folder / "mesh.msh", mesh);
    const HighOrderMesh cells = file_cells(mesh, ".msh").mesh;
    const std::vector<int> orders = lagrange_orders(cells.space, kMaxOrder);
    std::vector<std::size_t> numbered(orders.size());  // elements are numbered by order, then by kind
    std::iota(numbered.begin(), numbered.end(), std::size_t{0});
    std::stable_sort(numbered.begin(), numbered.end(), [&](std::size_t a, std::size_t b) {
      return std::pair(orders[a], cells.space.kind(a)) < std::pair(orders[b], cells.space.kind(b));
    });
    {
      std::ofstream out(folder / "queries");
      for (std::size_t i = 0; i < numbered.size(); ++i) {
        const std::size_t c = numbered[i];
        const CellKind kind = cells.space.kind(c);
        const std::string what = std::to_string(gmsh_type(kind, orders[c])) + ' ' + std::to_string(i + 1);
        for (const Vec3& at : dense_points(kind)) write_query(out, what, cells, c, at);
      }
    }
    const int status = run_python("gmsh_reader.py", folder / "mesh.msh", folder / "queries");
    if (status == kSkippedStatus) {
      WARN("SKIPPED: needs a Python with Gmsh (python3-gmsh)");
      break;
    }
    CHECK(status == 0);
  }
}

TEST_CASE("high_order_file: the cells of a file are read as they stand", "[export][slow]") {
  PointSource source(14);
  const TemporaryFolder folder;
  for (const Basis basis : kBothBases)
    for (const int order : {1, 2, 4, 7}) {
      CAPTURE(to_string(basis), order);
      const HighOrderMesh mesh = mixed_orders(basis, order, source);
      const PolynomialMap written = file_cells(mesh, ".vtu");
      if (basis == Basis::legendre) CHECK(written.distance_bound == 0);
      for (const VtuCells vtu_cells : kBothCells) {
        const HighOrderFileOptions options{.vtu_cells = vtu_cells};
        write_volume(folder / "mesh.vtu", mesh, options);
        CHECK_NOTHROW(require_written(folder / "mesh.vtu", mesh, options));
        CHECK(read_high_order(folder / "mesh.vtu").mesh.coefficients == mesh.coefficients);
        const HighOrderMesh read = read_polynomial_cells(folder / "mesh.vtu");
        CHECK(sampled_distance(written.mesh, read, 15) < 1e-9);
        CHECK(sampled_distance(mesh, read, 15) <= written.distance_bound + 1e-9);
      }
    }
}

TEST_CASE("tags that do not end are refused where they begin") {
  std::string text =
      "<VTKFile type=\"UnstructuredGrid\" version=\"2.2\" byte_order=\"LittleEndian\" header_type=\"UInt64\">";
  for (int i = 0; i < 20'000; ++i) text += "<DataArray Name=\"" + std::to_string(i) + "\" ";
  CHECK_THAT(refusal(text + "></VTKFile>"), Contains("a tag begins inside another"));
  CHECK_THAT(refusal("<VTKFile type=\"UnstructuredGrid\" </VTKFile>"), Contains("a tag begins inside another"));
}

TEST_CASE("orders that Gmsh does not evaluate are refused with the limit") {
  PointSource source(8);
  const auto refused = [&](CellKind kind, int order, const std::string& limit) {
    const HighOrderMesh mesh = of_one_order(kind, Basis::legendre, order, source);
    CHECK_THROWS_WITH(msh_text(mesh), Contains(limit) && Contains("write a .vtu"));
  };
  refused(CellKind::prism, 3, "prism up to order 2");
  refused(CellKind::tet, 11, "tet up to order 10");
  refused(CellKind::hex, 10, "hex up to order 9");
}

TEST_CASE("linear cells fill the curved mesh, conforming and right-handed") {
  PointSource source(9);
  const VolumeMesh straight = mixed_cells();
  const ElementSpace space(straight, Basis::fourier, 4);
  HighOrderMesh mesh(space, straight);
  for (std::size_t i = space.num_vertices(); i < space.num_nodes(); ++i)
    mesh.coefficients[i] = 0.02 * (source.vector() - Vec3::Constant(0.5));
  const VolumeMesh same = linear_cells(mesh, 1);
  CHECK(same.positions == straight.positions);
  CHECK(same.cell_vertices == straight.cell_vertices);
  for (const int n : {2, 3, 5}) {
    std::vector<Index> parents;
    const VolumeMesh cells = linear_cells(mesh, n, &parents);
    CHECK(cells.num_cells() == 4u * n * n * n);
    CHECK(parents.size() == cells.num_cells());
    CHECK(validate(cells).empty());
    CHECK(measure_quality(cells).inverted_cells == 0);
  }
  const TemporaryFolder folder;
  const std::vector<int> references{1, 2, 3, 4};
  write_volume(folder / "mesh.mesh", mesh, {.references = references});
  CHECK(read_volume_mesh(folder / "mesh.mesh").num_cells() == 4 * 64);
  write_volume(folder / "mesh.vtk", mesh, {.references = references, .linear_intervals = 2});
  CHECK(read_volume_mesh(folder / "mesh.vtk").references[8] == 2);
  CHECK_THROWS_AS(linear_cells(mesh, 0), InputError);
  CHECK_THROWS_AS(linear_cells(mesh, 100000), InputError);
}

TEST_CASE("high-order meshes that cannot be written are refused") {
  PointSource source(10);
  HighOrderMesh mesh = mixed_orders(Basis::fourier, 3, source);
  const TemporaryFolder folder;
  CHECK_THROWS_AS(write_volume(folder / "mesh.off", mesh), InputError);
  CHECK_THROWS_AS(vtu_text(mesh, {.cell_minima = std::vector<double>{1}}), InputError);
  CHECK_THROWS_AS(vtu_text(mesh, {.references = std::vector<int>{1}}), InputError);
  mesh.coefficients.back().x() = std::numeric_limits<double>::quiet_NaN();
  for (const char* name : {"mesh.vtu", "mesh.msh", "mesh.mesh"})
    CHECK_THROWS_AS(write_volume(folder / name, mesh), InputError);
  CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("files that are no high-order mesh of ours are refused by name") {
  PointSource source(13);
  const HighOrderMesh mesh = mixed_orders(Basis::fourier, 3, source);
  const std::string good = vtu_text(mesh);
  CHECK(refusal(good).empty());
  CHECK_THAT(refusal(""), Contains("VTK XML"));
  CHECK_THAT(refusal("<VTKFile"), Contains("VTK XML"));
  CHECK_THAT(refusal(good.substr(0, good.size() / 2)), Contains("whole"));
  CHECK_THAT(refusal(replaced(good, "version=\"2.2\"", "version=\"1.0\"")), Contains("version"));
  CHECK_THAT(refusal(replaced(good, "LittleEndian", "BigEndian")), Contains("byte_order"));
  CHECK_THAT(refusal(replaced(good, "UInt64\">", "UInt64\" compressor=\"vtkZLibDataCompressor\">")),
             Contains("compressed"));
  CHECK_THAT(refusal(replaced(good, "subvol_format", "format")), Contains("high-order mesh as subvol writes it"));
  CHECK_THAT(refusal(replaced(good, "subvol_coefficients", "other")), Contains("subvol_coefficients"));
  CHECK_THAT(refusal(replaced(good, "subvol_face_orders", "other")), Contains("subvol_face_orders"));
  CHECK_THAT(refusal(replaced(good, "subvol_face_orders", "subvol_edge_orders")), Contains("more"));
  CHECK_THAT(refusal(replaced(good, "format=\"binary\"", "format=\"ascii\"")), Contains("binary"));
  CHECK_THAT(refusal(replaced(good, "Int64\" Name=\"subvol_format", "Int32\" Name=\"subvol_format")), Contains("type"));
  const std::size_t digits = good.find('>', good.find("\"connectivity\"")) + 1;
  for (const std::size_t at : {digits, digits + 40}) {
    std::string bad = good;
    bad[at] = '*';
    CHECK_THAT(refusal(bad), Contains("base64"));
  }
  // A digit changed: another vertex, another order, or another coefficient than the point has.
  for (const char* name : {"connectivity", "offsets", "types", "subvol_format", "subvol_edge_orders",
                           "subvol_face_orders", "subvol_cell_orders", "Points"}) {
    std::string bad = good;
    const std::size_t begin = bad.find('>', bad.find('"' + std::string(name) + '"')) + 1;
    bad[begin + 12] = '/';
    bad[begin + 13] = '/';
    CAPTURE(name);
    CHECK_FALSE(refusal(bad).empty());
  }
  // Whatever else happens to the bytes, a file is read or refused.
  for (int i = 0; i < 300; ++i) {
    std::string bad = good;
    const auto at = [&] { return static_cast<std::size_t>(source.number() * static_cast<double>(bad.size() - 1)); };
    for (int k = 0; k < 3; ++k) bad[at()] = "Az/+09=<\"> "[static_cast<std::size_t>(source.number() * 11)];
    if (i % 3 == 0) bad.erase(at(), 1 + at() % 40);
    refusal(bad);
  }
  const TemporaryFolder folder;
  CHECK_THROWS_AS(read_high_order(folder / "none.vtu"), InputError);
  CHECK_THROWS_AS(read_high_order(folder.file("mesh.mesh", good)), InputError);
}

// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/nodal_mesh.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#ifdef SUBVOL_CGNS
#include <cgnslib.h>

#include <algorithm>
#include <array>
#include <numeric>

using namespace subvol;
using namespace subvol::test;
using Catch::Contains;

namespace {

/// A CGNS file that is written piece by piece.
class WrittenCgns {
 public:
  explicit WrittenCgns(const std::filesystem::path& path) {
    REQUIRE(cg_open(path.c_str(), CG_MODE_WRITE, &file_) == CG_OK);
    REQUIRE(cg_base_write(file_, "base", 3, 3, &base_) == CG_OK);
  }
  ~WrittenCgns() { cg_close(file_); }
  WrittenCgns(const WrittenCgns&) = delete;
  WrittenCgns& operator=(const WrittenCgns&) = delete;

  void zone(const char* name, const std::vector<Vec3>& points, cgsize_t cells) {
    cgsize_t size[3] = {static_cast<cgsize_t>(points.size()), cells, 0};
    REQUIRE(cg_zone_write(file_, base_, name, size, CGNS_ENUMV(Unstructured), &zone_) == CG_OK);
    for (int k = 0; k < 3; ++k) {
      std::vector<double> values;
      for (const Vec3& p : points) values.push_back(p[k]);
      int coordinate = 0;
      constexpr const char* kNames[] = {"CoordinateX", "CoordinateY", "CoordinateZ"};
      REQUIRE(cg_coord_write(file_, base_, zone_, CGNS_ENUMV(RealDouble), kNames[k], values.data(), &coordinate) ==
              CG_OK);
    }
  }
  void section(const char* name, CGNS_ENUMT(ElementType_t) type, cgsize_t first, cgsize_t last,
               const std::vector<cgsize_t>& nodes) {
    int section = 0;
    REQUIRE(cg_section_write(file_, base_, zone_, name, type, first, last, 0, nodes.data(), &section) == CG_OK);
  }
  void mixed_section(const char* name, cgsize_t first, cgsize_t last, const std::vector<cgsize_t>& data,
                     const std::vector<cgsize_t>& offsets) {
    int section = 0;
    REQUIRE(cg_poly_section_write(file_, base_, zone_, name, CGNS_ENUMV(MIXED), first, last, 0, data.data(),
                                  offsets.data(), &section) == CG_OK);
  }
  void condition(const char* name, CGNS_ENUMT(PointSetType_t) set, CGNS_ENUMT(GridLocation_t) location,
                 const std::vector<cgsize_t>& points, const char* family = nullptr) {
    int condition = 0;
    REQUIRE(cg_boco_write(file_, base_, zone_, name, CGNS_ENUMV(BCWall), set, static_cast<cgsize_t>(points.size()),
                          points.data(), &condition) == CG_OK);
    REQUIRE(cg_boco_gridlocation_write(file_, base_, zone_, condition, location) == CG_OK);
    if (!family) return;
    REQUIRE(cg_goto(file_, base_, "Zone_t", zone_, "ZoneBC_t", 1, "BC_t", condition, "end") == CG_OK);
    REQUIRE(cg_famname_write(family) == CG_OK);
  }
  void structured_zone() {
    cgsize_t size[9] = {2, 2, 2, 1, 1, 1, 0, 0, 0};
    REQUIRE(cg_zone_write(file_, base_, "block", size, CGNS_ENUMV(Structured), &zone_) == CG_OK);
  }

 private:
  int file_ = 0, base_ = 0, zone_ = 0;
};

Vec3 sheared(const Vec3& u) { return {u[0] + 0.3 * u[1], u[1] + 0.2 * u[2], u[2] + 0.1 * u[0]}; }

using Corners = std::vector<std::vector<int>>;
const Corners kTetEdges{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
const Corners kPrismInner{{0, 1}, {1, 2}, {2, 0}, {0, 3},       {1, 4},       {2, 5},
                          {3, 4}, {4, 5}, {5, 3}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}};
const Corners kHexInner{{0, 1},
                        {1, 2},
                        {2, 3},
                        {3, 0},
                        {0, 4},
                        {1, 5},
                        {2, 6},
                        {3, 7},
                        {4, 5},
                        {5, 6},
                        {6, 7},
                        {7, 4},
                        {0, 3, 2, 1},
                        {0, 1, 5, 4},
                        {1, 2, 6, 5},
                        {2, 3, 7, 6},
                        {0, 4, 7, 3},
                        {4, 5, 6, 7},
                        {0, 1, 2, 3, 4, 5, 6, 7}};

/// The points of one element in the order of CGNS: corners, then means of the listed corners.
std::vector<Vec3> element_points(CellKind kind, std::size_t size) {
  std::vector<Vec3> points;
  for (const LatticePoint& at : cell_lattice(kind, 1, NodeOrdering::vtk)) points.push_back(sheared(at.cast<double>()));
  const std::vector<Vec3> corners = points;
  const Corners& inner = kind == CellKind::tet ? kTetEdges : kind == CellKind::prism ? kPrismInner : kHexInner;
  for (std::size_t i = 0; points.size() < size; ++i) {
    Vec3 mean = Vec3::Zero();
    for (const int corner : inner[i]) mean += corners[static_cast<std::size_t>(corner)];
    points.push_back(mean / static_cast<double>(inner[i].size()));
  }
  return points;
}

/// A cube of two prisms and beside it a hex, its floor as faces 4 to 6, the end of the hex as face 7.
void write_cells(WrittenCgns& file, const char* zone) {
  std::vector<Vec3> points;
  for (int z = 0; z < 2; ++z)
    for (int y = 0; y < 2; ++y)
      for (int x = 0; x < 3; ++x) points.emplace_back(x, y, z);
  file.zone(zone, points, 3);
  const cgsize_t prism = CGNS_ENUMV(PENTA_6), hex = CGNS_ENUMV(HEXA_8), triangle = CGNS_ENUMV(TRI_3),
                 quad = CGNS_ENUMV(QUAD_4);
  file.mixed_section("cells", 1, 3,
                     {prism, 1, 2, 4, 7, 8, 10, prism, 2, 5, 4, 8, 11, 10, hex, 2, 3, 6, 5, 8, 9, 12, 11},
                     {0, 7, 14, 23});
  file.mixed_section("floor", 4, 6, {triangle, 1, 4, 2, triangle, 2, 4, 5, quad, 2, 5, 6, 3}, {0, 4, 8, 13});
  file.section("end", CGNS_ENUMV(QUAD_4), 7, 7, {3, 6, 12, 9});
}

}  // namespace

TEST_CASE("CGNS: the nodes of every type of cell go to their places", "[io]") {
  const TemporaryFolder folder;
  const struct {
    CGNS_ENUMT(ElementType_t) type;
    CellKind kind;
    int order;
    std::size_t size;
  } types[] = {{CGNS_ENUMV(TETRA_4), CellKind::tet, 1, 4},     {CGNS_ENUMV(TETRA_10), CellKind::tet, 2, 10},
               {CGNS_ENUMV(PENTA_6), CellKind::prism, 1, 6},   {CGNS_ENUMV(PENTA_15), CellKind::prism, 2, 15},
               {CGNS_ENUMV(PENTA_18), CellKind::prism, 2, 18}, {CGNS_ENUMV(HEXA_8), CellKind::hex, 1, 8},
               {CGNS_ENUMV(HEXA_20), CellKind::hex, 2, 20},    {CGNS_ENUMV(HEXA_27), CellKind::hex, 2, 27},
               {CGNS_ENUMV(PYRA_5), CellKind::pyramid, 1, 5}};
  for (const auto& [type, kind, order, size] : types) {
    const auto path = folder / "cell.cgns";
    {
      WrittenCgns file(path);
      file.zone("zone", element_points(kind, size), 1);
      std::vector<cgsize_t> nodes(size);
      std::iota(nodes.begin(), nodes.end(), 1);
      file.section("cells", type, 1, 1, nodes);
    }
    const NodalMesh mesh = read_nodal_mesh(path);
    REQUIRE(mesh.num_cells() == 1);
    CHECK(mesh.kinds[0] == kind);
    CHECK(mesh.orders[0] == order);
    CHECK(mesh.references.empty());
    const std::vector<LatticePoint> lattice = cell_lattice(kind, order, NodeOrdering::vtk);
    for (std::size_t i = 0; i < lattice.size(); ++i)
      CHECK((mesh.positions[static_cast<std::size_t>(mesh.cell(0)[i])] - sheared(lattice[i].cast<double>() / order))
                .norm() < 1e-14);
    std::filesystem::remove(path);
  }
}

TEST_CASE("CGNS: boundary conditions become groups, by elements and by vertices", "[io]") {
  const TemporaryFolder folder;
  {
    WrittenCgns file(folder / "a.cgns");
    write_cells(file, "zone");
    file.condition("bc1", CGNS_ENUMV(PointRange), CGNS_ENUMV(FaceCenter), {4, 6}, "ground");
    file.condition("outlet", CGNS_ENUMV(PointList), CGNS_ENUMV(Vertex), {3, 6, 9, 12});
  }
  const VolumeMesh mesh = read_volume_mesh(folder / "a.cgns");
  CHECK(mesh.num_cells() == 3);
  REQUIRE(mesh.face_groups.groups.size() == 2);
  CHECK(mesh.face_groups.groups[0].name == "ground");
  CHECK(mesh.face_groups.groups[1].name == "outlet");
  CHECK(mesh.face_groups.faces.size() == 4);
  {
    WrittenCgns file(folder / "b.cgns");
    write_cells(file, "zone");
  }
  const VolumeMesh by_section = read_volume_mesh(folder / "b.cgns");
  REQUIRE(by_section.face_groups.groups.size() == 2);
  CHECK(by_section.face_groups.groups[0].name == "floor");
}

TEST_CASE("CGNS: several zones are regions, and zones with a structure are refused", "[io]") {
  const TemporaryFolder folder;
  {
    WrittenCgns file(folder / "two.cgns");
    write_cells(file, "fluid");
    write_cells(file, "solid");
  }
  const NodalMesh mesh = read_nodal_mesh(folder / "two.cgns");
  CHECK(mesh.num_cells() == 6);
  CHECK(mesh.references == std::vector<int>{1, 1, 1, 2, 2, 2});
  REQUIRE(mesh.regions.size() == 2);
  CHECK(mesh.regions[1].name == "solid");
  REQUIRE(mesh.warnings.size() == 1);
  CHECK_THAT(mesh.warnings[0], Contains("2 zones are not joined"));
  {
    WrittenCgns file(folder / "block.cgns");
    file.structured_zone();
  }
  CHECK_THROWS_WITH(read_nodal_mesh(folder / "block.cgns"), Contains("block.cgns") && Contains("structured"));
}

TEST_CASE("CGNS: what is wrong is told, and no prefix of a file does harm", "[io]") {
  const TemporaryFolder folder;
  {
    WrittenCgns file(folder / "far.cgns");
    file.zone("zone", element_points(CellKind::tet, 4), 1);
    file.section("cells", CGNS_ENUMV(TETRA_4), 1, 1, {1, 2, 3, 5});
  }
  CHECK_THROWS_WITH(read_nodal_mesh(folder / "far.cgns"), Contains("element 1 names vertex 5 of 4"));
  {
    WrittenCgns file(folder / "pyramid.cgns");
    file.zone("zone", element_points(CellKind::hex, 20), 1);
    file.section("cells", CGNS_ENUMV(PYRA_13), 1, 1, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13});
  }
  CHECK_THROWS_WITH(read_nodal_mesh(folder / "pyramid.cgns"), Contains("pyramids"));
  CHECK_THROWS_WITH(read_nodal_mesh(folder.file("text.cgns", "CGNS, they say")), Contains("no CGNS file"));
  {
    WrittenCgns file(folder / "whole.cgns");
    write_cells(file, "zone");
  }
  const std::string whole = content_of(folder / "whole.cgns");
  for (std::size_t size = 0; size < whole.size(); size += 97) {
    const auto path = folder.file("cut.cgns", std::string_view(whole).substr(0, size));
    CHECK_THROWS_AS(read_nodal_mesh(path), InputError);
  }
}

#else

TEST_CASE("CGNS: without its library, files are refused", "[io]") {
  const subvol::test::TemporaryFolder folder;
  CHECK_THROWS_WITH(subvol::read_nodal_mesh(folder.file("a.cgns", "CGNS")),
                    Catch::Contains("without the CGNS library"));
}

#endif

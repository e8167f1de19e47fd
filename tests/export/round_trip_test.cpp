// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes go from every format of cells to every other and back: what both of them hold is the same as before.

#include "subvol/export/curved_file.h"
#include "subvol/export/high_order_file.h"
#include "subvol/export/volume_writer.h"
#include "subvol/io/file_formats.h"
#include "subvol/io/mesh_io.h"
#include "subvol/mesh/mesh_topology.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/grouped_meshes.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <map>
#include <set>

using namespace subvol;
using namespace subvol::test;

namespace {

/// Cells with groups of faces and regions.
VolumeMesh marked(VolumeMesh cells) {
  double height = 0;
  for (const Vec3& p : cells.positions) height = std::max(height, p.z());
  VolumeMesh mesh = with_floor_and_roof(std::move(cells), height);
  mesh.references.assign(mesh.num_cells(), 4);
  mesh.references.back() = 7;
  mesh.regions = {{"steel", 4, 3}, {"brass", 7, 3}};
  return mesh;
}

/// Returns the formats that are read and written with cells of an order: 1, 2 or more.
std::vector<const FileFormat*> formats_of_cells(int order) {
  std::vector<const FileFormat*> formats;
  for (const FileFormat& format : file_formats()) {
    if (!format.holds_cells || format.read.empty() || format.written.empty()) continue;
    if (order > 1 && (format.orders_written == "1" || format.orders_read == "1")) continue;
    if (order > 2 && format.has_quadratic_cells_at_most()) continue;
    if (format.needs_netcdf && !has_exodus()) continue;
    formats.push_back(&format);
  }
  if (!has_exodus()) WARN("SKIPPED: Exodus, built without netCDF (libnetcdf-dev)");
  return formats;
}

Held least(std::initializer_list<Held> held) { return std::min(held); }
Held groups_of(const FileFormat& a, const FileFormat& b) {
  return least({a.groups_read, a.groups_written, b.groups_read, b.groups_written});
}
Held regions_of(const FileFormat& a, const FileFormat& b) {
  return least({a.regions_read, a.regions_written, b.regions_read, b.regions_written});
}

/// Largest difference of coordinates: numbers have sixteen characters in Nastran's files, twenty in those of Abaqus.
double rounding(const FileFormat& a, const FileFormat& b) {
  const auto has = [&](std::string_view extension) { return a.extension == extension || b.extension == extension; };
  return has(".bdf") ? 1e-7 : has(".inp") ? 1e-11 : 0;
}

using Corners = std::vector<std::array<double, 3>>;

/// The corners of a cell as they are in the first mesh, whose vertices are told by their places.
Corners corners_of(const std::vector<Vec3>& positions, std::span<const Index> cell, const std::vector<Vec3>& wanted) {
  Corners corners;
  for (const Index v : cell) {
    const auto nearest = std::ranges::min_element(
        wanted, {}, [&](const Vec3& x) { return (x - positions[static_cast<std::size_t>(v)]).squaredNorm(); });
    corners.push_back({(*nearest)[0], (*nearest)[1], (*nearest)[2]});
  }
  std::sort(corners.begin(), corners.end());
  return corners;
}

std::string mark_of(const Group& group, Held held) {
  return held == Held::none ? "" : held == Held::names ? group.name : std::to_string(group.number);
}

/// Returns the largest number of a group that has faces.
int largest_number(const VolumeFaceGroups& groups) {
  int largest = 0;
  for (const GroupedFace& entry : groups.faces)
    largest = std::max(largest, groups.groups[static_cast<std::size_t>(entry.group)].number);
  return largest;
}

/// The groups of each grouped face, by its corners.  most: largest number of a group that counts. MFEM gives a number
/// to all faces of the boundary: those of no group have one more.
std::map<Corners, std::set<std::string>> faces_of(const VolumeMesh& mesh, const VolumeFaceGroups& groups,
                                                  const std::vector<Vec3>& wanted, Held held, int most) {
  std::map<Corners, std::set<std::string>> faces;
  if (held == Held::none) return faces;
  for (const GroupedFace& entry : groups.faces) {
    if (groups.groups[static_cast<std::size_t>(entry.group)].number > most) continue;
    const std::size_t size = entry.face.back() == kNoIndex ? 3 : 4;
    faces[corners_of(mesh.positions, std::span(entry.face).first(size), wanted)].insert(
        mark_of(groups.groups[static_cast<std::size_t>(entry.group)], held));
  }
  return faces;
}

/// The kind of each cell and the region that it is in, by its corners.
std::map<Corners, std::pair<CellKind, std::string>> cells_of(const VolumeMesh& mesh, std::span<const int> references,
                                                             std::span<const Group> regions,
                                                             const std::vector<Vec3>& wanted, Held held) {
  std::map<Corners, std::pair<CellKind, std::string>> cells;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    std::string mark;
    const int reference = references.empty() ? 0 : references[c];
    if (held == Held::numbers) mark = std::to_string(reference);
    for (const Group& region : regions)
      if (held == Held::names && region.number == reference) mark = region.name;
    cells[corners_of(mesh.positions, mesh.cell(c), wanted)] = {mesh.kinds[c], mark};
  }
  return cells;
}

void write_linear(const std::filesystem::path& path, const VolumeMesh& mesh) {
  const std::string extension = path.extension().string();
  extension == ".mesh" || extension == ".vtk" ? write_volume_mesh(path, mesh) : write_volume(path, mesh);
}

/// Returns for each cell of a mesh the cell of another one with the same corners.
std::vector<std::size_t> matched(const HighOrderMesh& found, const HighOrderMesh& wanted) {
  const VolumeMesh a = found.straight_sided(), b = wanted.straight_sided();
  std::map<Corners, std::size_t> places;
  for (std::size_t c = 0; c < b.num_cells(); ++c) places[corners_of(b.positions, b.cell(c), b.positions)] = c;
  std::vector<std::size_t> result;
  for (std::size_t c = 0; c < a.num_cells(); ++c)
    result.push_back(places.at(corners_of(a.positions, a.cell(c), b.positions)));
  return result;
}

/// Sends linear cells through every pair of formats and back.
void check_round_trips(const VolumeMesh& mesh) {
  const TemporaryFolder folder;
  const auto formats = formats_of_cells(1);
  REQUIRE(formats.size() >= 7);
  const int most = largest_number(mesh.face_groups);
  for (const FileFormat* a : formats) {
    const auto first = folder.path() / ("a" + std::string(a->extension));
    write_linear(first, mesh);
    for (const FileFormat* b : formats) {
      CAPTURE(a->extension, b->extension);
      const auto second = folder.path() / ("b" + std::string(b->extension)),
                 third = folder.path() / ("c" + std::string(a->extension));
      write_linear(second, read_volume_mesh(first));
      write_linear(third, read_volume_mesh(second));
      const VolumeMesh found = read_volume_mesh(third);
      REQUIRE(found.num_vertices() == mesh.num_vertices());
      const double tolerance = rounding(*a, *b);
      for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
        CHECK((found.positions[v] - mesh.positions[v]).cwiseAbs().maxCoeff() <= tolerance);
      const Held groups = groups_of(*a, *b), regions = regions_of(*a, *b);
      CHECK(cells_of(found, found.references, found.regions, mesh.positions, regions) ==
            cells_of(mesh, mesh.references, mesh.regions, mesh.positions, regions));
      CHECK(faces_of(found, found.face_groups, mesh.positions, groups, most) ==
            faces_of(mesh, mesh.face_groups, mesh.positions, groups, most));
    }
  }
}

/// Sends curved cells through every pair of some formats and back.  cells: their groups and regions.
void check_round_trips(const HighOrderMesh& mesh, const VolumeMesh& cells, std::span<const FileFormat* const> formats,
                       double tolerance) {
  const TemporaryFolder folder;
  const HighOrderFileOptions options{
      .references = cells.references, .face_groups = &cells.face_groups, .regions = cells.regions};
  const auto write_file = [](const std::filesystem::path& path, const HighOrderFile& file) {
    write_volume(path, file.mesh,
                 {.references = file.references, .face_groups = &file.face_groups, .regions = file.regions});
  };
  const VolumeMesh straight = mesh.straight_sided();
  const int most = largest_number(cells.face_groups);
  for (const FileFormat* a : formats) {
    const auto first = folder.path() / ("a" + std::string(a->extension));
    write_volume(first, mesh, options);
    for (const FileFormat* b : formats) {
      CAPTURE(a->extension, b->extension, mesh.space.max_order());
      const auto second = folder.path() / ("b" + std::string(b->extension)),
                 third = folder.path() / ("c" + std::string(a->extension));
      write_file(second, read_curved(first));
      write_file(third, read_curved(second));
      const HighOrderFile found = read_curved(third);
      const VolumeMesh corners = found.mesh.straight_sided();
      REQUIRE(found.mesh.space.num_cells() == cells.num_cells());
      CHECK(found.mesh.space.max_order() == mesh.space.max_order());
      const Held groups = groups_of(*a, *b), regions = regions_of(*a, *b);
      CHECK(cells_of(corners, found.references, found.regions, straight.positions, regions) ==
            cells_of(straight, cells.references, cells.regions, straight.positions, regions));
      CHECK(faces_of(corners, found.face_groups, straight.positions, groups, most) ==
            faces_of(straight, cells.face_groups, straight.positions, groups, most));
      const std::vector<std::size_t> same = matched(found.mesh, mesh);
      for (std::size_t c = 0; c < same.size(); ++c) {
        const auto at = [&](const HighOrderMesh& m, std::size_t cell) { return m.position(cell, Vec3(0.3, 0.3, 0.3)); };
        CHECK((at(found.mesh, c) - at(mesh, same[c])).norm() < tolerance + 10 * rounding(*a, *b));
      }
    }
  }
}

}  // namespace

TEST_CASE("round trips: linear cells, regions and groups go through every pair of formats", "[export][slow]") {
  check_round_trips(marked(mixed_cells()));
}

TEST_CASE("round trips: pyramids go through every pair of formats", "[export][slow]") {
  check_round_trips(marked(mixed_cells_with_pyramid()));
}

TEST_CASE("round trips: cells of order 2 go through every pair of formats that holds them", "[export][slow]") {
  PointSource source(5);
  const VolumeMesh cells = marked(mixed_cells());
  const auto formats = formats_of_cells(2);
  REQUIRE(formats.size() >= 5);
  // Without modes of faces and inside, which C3D20 and the like do not have.
  const HighOrderMesh mesh = file_cells(random_mesh(ElementSpace(cells, Basis::legendre, 2), source), ".inp").mesh;
  check_round_trips(mesh, cells, formats, 1e-12);
}

TEST_CASE("round trips: cells of orders 3 to 9 go through every pair of formats that holds them", "[export][slow]") {
  const int order = GENERATE(3, 6, 9);
  PointSource source(7);
  const double tolerance = order == 3 ? 1e-12 : order == 6 ? 1e-11 : 1e-9;  // through points at equal steps
  std::vector<const FileFormat*> formats = formats_of_cells(order);
  REQUIRE(formats.size() >= 3);
  const VolumeMesh hexes = marked(test::lattice(2, 1, 2));
  check_round_trips(random_mesh(ElementSpace(hexes, Basis::legendre, order), source), hexes, formats, tolerance);
  std::erase_if(formats,
                [](const FileFormat* f) { return f->extension == ".msh"; });  // its prisms have order 2 at most
  REQUIRE(formats.size() >= 2);
  const VolumeMesh mixed = marked(mixed_cells());
  check_round_trips(random_mesh(ElementSpace(mixed, Basis::legendre, order), source), mixed, formats, tolerance);
}

// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/touching_solids.h"

#include "subvol/fit/geometry/contact_imprint.h"
#include "subvol/fit/mending/surface_repair.h"
#include "subvol/fit/target/region_matching.h"
#include "subvol/surface/named_solids.h"
#include "subvol/surface/welded_surface.h"

#include <catch2/catch.hpp>

#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

using namespace subvol;
using namespace subvol::internal;

namespace {

/// A surface of boxes with names, each with vertices of its own.
class Boxes {
 public:
  /// Adds a box to the solid of a name; empty: to none.
  Boxes& add(const std::string& name, const Vec3& low, const Vec3& high, bool has_other_diagonals = false) {
    const auto first = static_cast<Index>(mesh_.positions.size());
    for (int v = 0; v < 8; ++v)
      mesh_.positions.emplace_back(v & 1 ? high.x() : low.x(), v & 2 ? high.y() : low.y(), v & 4 ? high.z() : low.z());
    const Index group = name.empty() ? kNoIndex : groups_.by_name(name);
    for (auto [a, b, c, d] : std::vector<std::array<Index, 4>>{
             {0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
      a += first, b += first, c += first, d += first;
      mesh_.triangles.push_back({a, b, has_other_diagonals ? d : c});
      mesh_.triangles.push_back({has_other_diagonals ? b : a, c, d});
      for (int i = 0; i < 2; ++i) of_face_.push_back(group);
    }
    return *this;
  }
  /// Adds a prism over a regular polygon, whose ends are fans of triangles.
  Boxes& add_prism(const std::string& name, const Vec3& center, double radius, double height, int sides) {
    const auto first = static_cast<Index>(mesh_.positions.size());
    for (const double z : {0.0, height})
      for (int k = 0; k < sides; ++k) {
        const double angle = 2 * std::numbers::pi * k / sides;
        mesh_.positions.push_back(center + Vec3(radius * std::cos(angle), radius * std::sin(angle), z));
      }
    const auto add_triangle = [&](Index a, Index b, Index c) {
      mesh_.triangles.push_back({first + a, first + b, first + c});
      of_face_.push_back(groups_.by_name(name));
    };
    for (Index k = 0; k < sides; ++k) {
      const Index next = (k + 1) % sides;
      add_triangle(k, next, sides + next), add_triangle(k, sides + next, sides + k);
      if (k > 0 && next > 0) add_triangle(0, next, k), add_triangle(sides, sides + k, sides + next);
    }
    return *this;
  }
  /// Adds a unit cube whose faces are squares, n x n of them at the bottom and the top, and 1 x n at the sides.
  Boxes& add_divided(const std::string& name, const Vec3& low, int n) {
    for (int axis = 0; axis < 3; ++axis)
      for (const int end : {0, 1}) {
        const int i = (axis + 1) % 3, j = (axis + 2) % 3, rows = i == 2 ? 1 : n, columns = j == 2 ? 1 : n;
        for (int k = 0; k < rows * columns; ++k) {
          const auto corner = [&](int of_row, int of_column) {
            Vec3 p = low;
            p[axis] += end;
            p[i] += static_cast<double>(k / columns + of_row) / rows;
            p[j] += static_cast<double>(k % columns + of_column) / columns;
            mesh_.positions.push_back(p);
            return static_cast<Index>(mesh_.positions.size() - 1);
          };
          std::array<Index, 4> square{corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)};
          if (end == 0) std::swap(square[1], square[3]);
          const auto [a, b, c, d] = square;
          mesh_.triangles.insert(mesh_.triangles.end(), {{a, b, c}, {a, c, d}});
          of_face_.insert(of_face_.end(), 2, groups_.by_name(name));
        }
      }
    return *this;
  }
  TriangleMesh surface() const {
    TriangleMesh mesh = mesh_;
    if (!groups_.groups().empty()) mesh.face_groups = {groups_.groups(), of_face_};
    return mesh;
  }

 private:
  TriangleMesh mesh_;
  GroupList groups_;
  std::vector<Index> of_face_;
};

/// A bolt on a plate, which has another name or none.
TriangleMesh bolt_on_plate(const std::string& plate = "plate", const std::string& bolt = "bolt") {
  return Boxes().add(plate, {0, 0, 0}, {4, 4, 1}).add(bolt, {1, 1, 1}, {2, 2.5, 2}, true).surface();
}

std::map<std::string, double> volumes_of(const RegionSurface& regions) {
  std::map<std::string, double> volumes;
  for (std::size_t r = 0; r < regions.regions.size(); ++r) volumes[regions.regions[r].name] = regions.volumes[r];
  CHECK(volumes.size() == regions.regions.size());
  return volumes;
}

}  // namespace

TEST_CASE("The slivers at the rim of a fine round contact are part of it", "[target][regions]") {
  const int sides = 256;
  const double radius = GENERATE(0.2, 0.3);
  Boxes boxes;
  boxes.add("plate", {0, 0, 0}, {4, 4, 1}).add_prism("bolt", {1.7, 1.7, 1}, radius, 1, sides);
  const std::optional<TouchingSolids> solids = touching_solids(boxes.surface());
  REQUIRE(solids);
  const auto volumes = volumes_of(solids->regions);
  const double angle = 2 * std::numbers::pi / sides;
  CHECK(volumes.at("plate") == Approx(16));
  CHECK(volumes.at("bolt") == Approx(sides * 0.5 * radius * radius * std::sin(angle)).epsilon(1e-3));
}

TEST_CASE("The cost of many contacts is not quadratic in their number", "[target][regions]") {
  Boxes boxes;
  const int pairs = 1200;
  for (int i = 0; i < pairs; ++i) {
    const std::string number = std::to_string(i);
    const Vec3 at(5.0 * i, 0, 0);
    boxes.add("p" + number, at, at + Vec3(2, 2, 1));
    boxes.add("q" + number, at + Vec3(0.5, 0.5, 1), at + Vec3(1.5, 1.5, 2), true);
  }
  const std::optional<TouchingSolids> solids = touching_solids(boxes.surface());
  REQUIRE(solids);
  CHECK(solids->regions.regions.size() == 2 * pairs);
}

TEST_CASE("A contact may have many crossings of edges", "[target][regions]") {
  const Boxes boxes = Boxes().add_divided("lower", {0, 0, 0}, 48).add_divided("upper", {0, 0, 1}, 49);
  const std::optional<TouchingSolids> solids = touching_solids(boxes.surface());
  REQUIRE(solids);
  const auto volumes = volumes_of(solids->regions);
  CHECK(volumes.at("lower") == Approx(1));
  CHECK(volumes.at("upper") == Approx(1));
}

TEST_CASE("A search for contacts can be cancelled in each of its steps", "[target][regions]") {
  const Boxes boxes = Boxes().add_divided("lower", {0, 0, 0}, 18).add_divided("upper", {0, 0, 1}, 19);
  const TriangleMesh surface = boxes.surface();
  int questions = 0;
  REQUIRE(imprinted_contacts(surface, [&] {
    ++questions;
    return false;
  }));
  REQUIRE(questions > 3);
  for (int last = 0; last < questions; ++last) {
    int asked = 0;
    CHECK_FALSE(imprinted_contacts(surface, [&] { return asked++ == last; }));
    CHECK(asked == last + 1);
  }
}

TEST_CASE("Named solids that touch become regions of their names", "[target][regions]") {
  const TriangleMesh surface = bolt_on_plate();
  const SurfaceRepair repair = repair_surface(surface);
  CHECK(repair.is_fillable);
  REQUIRE(repair.regions);
  const auto volumes = volumes_of(*repair.regions);
  CHECK(volumes.at("plate") == Approx(16));
  CHECK(volumes.at("bolt") == Approx(1.5));
  REQUIRE(repair.done.size() == 1);
  CHECK(repair.done[0] ==
        "target: 2 solids touch: they become the regions plate and bolt; "
        "--regions merge makes one of them");
  // A second repair finds the same regions.
  const auto again = find_regions(repair.surface);
  REQUIRE(again);
  CHECK(again->volumes == repair.regions->volumes);
  CHECK(again->regions == repair.regions->regions);
  // Solids without names are united, and so are those of one name.
  CHECK_FALSE(repair_surface(surface, {}, RegionRule::merge).regions);
  CHECK_FALSE(repair_surface(bolt_on_plate("", "")).regions);
  CHECK_FALSE(repair_surface(bolt_on_plate("plate", "")).regions);
  CHECK_FALSE(repair_surface(bolt_on_plate("plate", "plate")).regions);
}

TEST_CASE("Solids touch although their coordinates are rounded to six digits", "[target][regions]") {
  TriangleMesh surface = bolt_on_plate();
  const Eigen::AngleAxisd turn(0.7, Vec3(1, 2, 3).normalized());
  for (Vec3& p : surface.positions) {
    p = turn * p;
    for (double& x : p) x = std::round(x * 1e6) / 1e6;
  }
  const auto solids = touching_solids(surface);
  REQUIRE(solids);
  const auto volumes = volumes_of(solids->regions);
  CHECK(volumes.at("plate") == Approx(16).epsilon(1e-5));
  CHECK(volumes.at("bolt") == Approx(1.5).epsilon(1e-5));
  CHECK(volumes_of(*repair_surface(surface, {}, RegionRule::keep).regions) == volumes);
  surface.face_groups = {};  // RegionRule::keep needs no names
  const SurfaceRepair kept = repair_surface(surface, {}, RegionRule::keep);
  REQUIRE(kept.regions);
  CHECK(kept.regions->volumes.size() == 2);
}

TEST_CASE("Boxes of one name are one region, and a hollow between solids is a void", "[target][regions]") {
  // A tray of a bottom and four walls, under a lid.
  const TriangleMesh surface = Boxes()
                                   .add("tray", {0, 0, 0}, {4, 4, 1})
                                   .add("tray", {0, 0, 1}, {1, 4, 2}, true)
                                   .add("tray", {3, 0, 1}, {4, 4, 2})
                                   .add("tray", {1, 0, 1}, {3, 1, 2})
                                   .add("tray", {1, 3, 1}, {3, 4, 2}, true)
                                   .add("lid", {-0.5, -0.5, 2}, {4.5, 4.5, 3}, true)
                                   .surface();
  const auto solids = touching_solids(surface);
  REQUIRE(solids);
  const auto volumes = volumes_of(solids->regions);
  CHECK(volumes.at("tray") == Approx(16 + 12));
  CHECK(volumes.at("lid") == Approx(25));
  CHECK(region_pairs(solids->regions).size() == 3);
  CHECK(solids->regions.notes.empty());
}

TEST_CASE("Names of faces, solids that overlap and solids apart make no regions", "[target][regions]") {
  TriangleMesh cube = Boxes().add("x", {0, 0, 0}, {1, 1, 1}).surface();
  cube.face_groups.groups.push_back({"y", 2});
  cube.face_groups.of_face[3] = 1;
  CHECK(volumes_of_named_solids(cube).empty());
  CHECK_FALSE(touching_solids(cube));
  const Boxes first = Boxes().add("a", {0, 0, 0}, {1, 1, 1});
  CHECK_FALSE(touching_solids(Boxes(first).add("b", {0.5, 0, 0}, {1.5, 1, 1}).surface()));        // faces in one plane
  CHECK_FALSE(touching_solids(Boxes(first).add("b", {0.5, 0.1, 0.2}, {2, 0.9, 0.8}).surface()));  // faces that cross
  CHECK_FALSE(touching_solids(Boxes(first).add("b", {0.2, 0.2, 0.2}, {0.8, 0.8, 0.8}).surface()));
  CHECK_FALSE(touching_solids(Boxes(first).add("b", {1.001, 0, 0}, {2, 1, 1}).surface()));
  CHECK_FALSE(touching_solids(Boxes(first).add("b", {1, 1, 0}, {2, 2, 1}).surface()));  // along an edge
  const SurfaceRepair united = repair_surface(Boxes(first).add("b", {0.5, 0.1, 0.2}, {2, 0.9, 0.8}).surface());
  REQUIRE(united.done.size() == 1);
  CHECK_THAT(united.done[0], Catch::Contains("parts 0 (a) and 1 (b) meet") &&
                                 Catch::Contains("named solids are regions only if they touch and do not cross"));
}

TEST_CASE("A mesh has the regions of named solids that touch", "[target][regions]") {
  // Two hexes on each other.
  VolumeMesh mesh;
  for (const double z : {0.0, 1.0, 3.0})
    for (const auto& [x, y] : {std::pair(0.0, 0.0), {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}})
      mesh.positions.emplace_back(x, y, z);
  mesh.add_cell(CellKind::hex, std::array<Index, 8>{0, 1, 2, 3, 4, 5, 6, 7});
  mesh.add_cell(CellKind::hex, std::array<Index, 8>{4, 5, 6, 7, 8, 9, 10, 11});
  mesh.references = {7, 3};
  const TriangleMesh target =
      Boxes().add("lower", {0, 0, 0}, {1, 1, 1}).add("upper", {0, 0, 1}, {1, 1, 3}, true).surface();
  const MatchedTarget matched = matched_target(target, mesh);
  REQUIRE(matched.regions);
  const auto volumes = volumes_of(*matched.regions);
  CHECK(volumes.at("lower") == Approx(1));
  CHECK(volumes.at("upper") == Approx(2));
  CHECK(matched.regions->regions[0].number == 3);
  mesh.references.clear();
  const MatchedTarget outer = matched_target(target, mesh);
  REQUIRE(outer.outer);
  CHECK(signed_volume_of(*outer.outer) == Approx(3));
}

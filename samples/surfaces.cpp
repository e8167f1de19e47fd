// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces of quads, without templates.

#include "samples/shapes.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace subvol::samples {
namespace {

constexpr double kTau = 2 * std::numbers::pi;

using Lattice = std::array<int, 3>;

/// Adds quads with groups by name to a mesh.
class QuadBuilder {
 public:
  explicit QuadBuilder(std::vector<Group> groups) { mesh_.face_groups.groups = std::move(groups); }

  /// Returns the vertex at a position, which is added when it is first asked for.
  Index vertex(const Vec3& p) {
    const auto [entry, added] = numbers_.try_emplace({p.x(), p.y(), p.z()}, static_cast<Index>(mesh_.positions.size()));
    if (added) mesh_.positions.push_back(p);
    return entry->second;
  }
  void add(const char* group, std::array<Index, 4> corners) {
    mesh_.face_vertices.insert(mesh_.face_vertices.end(), corners.begin(), corners.end());
    mesh_.face_offsets.push_back(mesh_.face_vertices.size());
    const std::vector<Group>& groups = mesh_.face_groups.groups;
    const auto found = std::find_if(groups.begin(), groups.end(), [&](const Group& g) { return g.name == group; });
    mesh_.face_groups.of_face.push_back(static_cast<Index>(found - groups.begin()));
  }
  /// Adds the quad twice: as it is, and turned over at another place.
  void add_both(const char* lower, std::array<Index, 4> below, const char* upper, std::array<Index, 4> above) {
    std::reverse(below.begin(), below.end());
    add(lower, below);
    add(upper, above);
  }
  PolygonMesh take() { return std::move(mesh_); }

 private:
  PolygonMesh mesh_;
  std::map<std::array<double, 3>, Index> numbers_;
};

/// One end of the rod: a circle around a center, up to the line x = kMiddle.
struct RodEnd {
  double center, outer, bore;  ///< x of its center, radii
  const char* bore_name;
};

constexpr RodEnd kSmallEnd{0, 0.28, 0.14, "small_bore"}, kLargeEnd{2, 0.5, 0.28, "large_bore"};
constexpr double kMiddle = 0.8, kRodThickness = 0.3;

/// Returns the outline of an end, counterclockwise from the line x = kMiddle.
std::vector<Vec3> outline_of(const RodEnd& end, bool is_left) {
  constexpr int kRodSegmentsAcross = 6, kRodSegmentsAlong = 8, kRodArcSegments = 24;
  // Both circles touch the straight sides, whose normal makes this angle with the x-axis.
  const double angle = std::acos((kSmallEnd.outer - kLargeEnd.outer) / (kLargeEnd.center - kSmallEnd.center));
  const double half = (kSmallEnd.outer - kMiddle * std::cos(angle)) / std::sin(angle);  // the rod's width there
  std::vector<Vec3> outline;
  const auto add_line = [&](const Vec3& from, const Vec3& to, int steps) {
    for (int k = 0; k < steps; ++k) outline.push_back(from + (to - from) * (static_cast<double>(k) / steps));
  };
  const auto on_circle = [&](double at) {
    return Vec3(end.center + end.outer * std::cos(at), end.outer * std::sin(at), 0);
  };
  const double first = is_left ? angle : -angle, last = is_left ? kTau - angle : angle;
  const Vec3 low(kMiddle, -half, 0), high(kMiddle, half, 0);
  for (int k = 0; k < kRodSegmentsAcross; ++k) {  // the same points from either side
    const int at = is_left ? k : kRodSegmentsAcross - k;
    outline.emplace_back(kMiddle, half * (2.0 * at / kRodSegmentsAcross - 1), 0);
  }
  add_line(is_left ? high : low, on_circle(first), kRodSegmentsAlong);
  for (int k = 0; k < kRodArcSegments; ++k) outline.push_back(on_circle(first + (last - first) * k / kRodArcSegments));
  add_line(on_circle(last), is_left ? low : high, kRodSegmentsAlong);
  return outline;
}

}  // namespace

PolygonMesh rod_surface() {
  constexpr int kRodRings = 5, kRodLayers = 4;
  QuadBuilder rod({{"small_bore", 1}, {"large_bore", 2}, {"side", 3}, {"bottom", 4}, {"top", 5}});
  for (const RodEnd& end : {kSmallEnd, kLargeEnd}) {
    const bool is_left = end.center < kMiddle;
    const std::vector<Vec3> outline = outline_of(end, is_left);
    const Vec3 center(end.center, 0, 0);
    const auto vertex = [&](std::size_t side, int ring, int layer) {
      const Vec3& out = outline[side % outline.size()];
      const double share = static_cast<double>(ring) / kRodRings;
      const Vec3 at =
          ring == kRodRings ? out : Vec3((1 - share) * (center + end.bore * (out - center).normalized()) + share * out);
      return rod.vertex(at + Vec3(0, 0, kRodThickness * layer / kRodLayers));
    };
    for (std::size_t side = 0; side < outline.size(); ++side) {
      for (int ring = 0; ring < kRodRings; ++ring) {
        const auto quad = [&](int layer) {
          return std::array<Index, 4>{vertex(side, ring, layer), vertex(side, ring + 1, layer),
                                      vertex(side + 1, ring + 1, layer), vertex(side + 1, ring, layer)};
        };
        rod.add_both("bottom", quad(0), "top", quad(kRodLayers));
      }
      const auto wall = [&](std::size_t a, std::size_t b, int ring, int layer) {
        return std::array<Index, 4>{vertex(a, ring, layer), vertex(b, ring, layer), vertex(b, ring, layer + 1),
                                    vertex(a, ring, layer + 1)};
      };
      const bool is_inside = outline[side].x() == kMiddle && outline[(side + 1) % outline.size()].x() == kMiddle;
      for (int layer = 0; layer < kRodLayers; ++layer) {
        rod.add(end.bore_name, wall(side + 1, side, 0, layer));
        if (!is_inside) rod.add("side", wall(side, side + 1, kRodRings, layer));
      }
    }
  }
  return rod.take();
}

PolygonMesh mount_surface() {
  constexpr int kPinSides = 24;
  constexpr double kPinRadius = 8, kPinBottom = 50, kPinTop = 70;
  QuadBuilder mount({{"plate", 1}, {"cork", 2}, {"block", 3}, {"pin", 4}});
  const auto add_box = [&](const char* name, double half, double bottom, double top) {
    const auto corner = [&](int k, double z) {  // counterclockwise
      return mount.vertex({k % 4 == 1 || k % 4 == 2 ? half : -half, k % 4 >= 2 ? half : -half, z});
    };
    const auto across = [&](double z) {
      return std::array<Index, 4>{corner(0, z), corner(1, z), corner(2, z), corner(3, z)};
    };
    mount.add_both(name, across(bottom), name, across(top));
    for (int k = 0; k < 4; ++k)
      mount.add(name, {corner(k, bottom), corner(k + 1, bottom), corner(k + 1, top), corner(k, top)});
  };
  add_box("plate", 30, 0, 10);
  add_box("cork", 20, 10, 30);
  add_box("block", 20, 30, 50);
  const auto at = [&](int side, double z) {
    const double angle = kTau * (side % kPinSides) / kPinSides;
    return mount.vertex({kPinRadius * std::cos(angle), kPinRadius * std::sin(angle), z});
  };
  for (int k = 0; k < kPinSides; ++k) {
    mount.add("pin", {at(k, kPinBottom), at(k + 1, kPinBottom), at(k + 1, kPinTop), at(k, kPinTop)});
    if (k % 2 != 0) continue;
    const auto two_sectors = [&](double z) {
      return std::array<Index, 4>{mount.vertex({0, 0, z}), at(k, z), at(k + 1, z), at(k + 2, z)};
    };
    mount.add_both("pin", two_sectors(kPinBottom), "pin", two_sectors(kPinTop));
  }
  return mount.take();
}

PolygonMesh bowl_surface(int n) {
  // A cube's surface without its upper side, blown up to a ball.
  PolygonMesh mesh;
  std::map<Lattice, Index> numbers;
  const auto vertex = [&](const Lattice& at) {
    const auto [entry, added] = numbers.try_emplace(at, static_cast<Index>(mesh.positions.size()));
    if (added) {
      // Tangents space the quads of a side evenly over the ball.
      const auto coordinate = [&](int i) { return std::tan((2.0 * i / n - 1) * kTau / 8); };
      const Vec3 p = Vec3(coordinate(at[0]), coordinate(at[1]), coordinate(at[2])).normalized();
      const double ripple = 1 + 0.06 * (1 + p.z()) * std::cos(8 * std::atan2(p.y(), p.x()));
      mesh.positions.emplace_back(ripple * p.x(), ripple * p.y(), 0.8 * p.z());
    }
    return entry->second;
  };
  for (int side = 0; side < 6; ++side) {
    const int axis = side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (side == 5) continue;
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        std::array<Index, 4> quad{};
        for (int k = 0; k < 4; ++k) {
          Lattice at{};
          at[axis] = side % 2 * n;
          at[u] = i + (k == 1 || k == 2);
          at[v] = j + k / 2;
          quad[k] = vertex(at);
        }
        if (side % 2 == 0) std::swap(quad[1], quad[3]);
        mesh.face_vertices.insert(mesh.face_vertices.end(), quad.begin(), quad.end());
        mesh.face_offsets.push_back(mesh.face_vertices.size());
      }
  }
  return mesh;
}

PolygonMesh plate_surface() {
  constexpr double kPlateLength = 2, kPlateWidth = 1, kPlateThickness = 0.02, kPlateHoleRadius = 0.25;
  constexpr int kPlateSegmentsAcross = 16, kPlateSegmentsAlong = 32, kPlateRings = 8,
                kPlateSegments = kPlateSegmentsAcross + kPlateSegmentsAlong;
  const std::vector<Group> groups{{"symmetry_x", 1}, {"symmetry_y", 2}, {"symmetry_z", 3}, {"hole", 4},
                                  {"loaded", 5},     {"side", 6},       {"top", 7}};
  const auto group = [&](const char* name) {
    const auto found = std::find_if(groups.begin(), groups.end(), [&](const Group& g) { return g.name == name; });
    return static_cast<Index>(found - groups.begin());
  };
  PolygonMesh plate;
  plate.face_groups.groups = groups;
  // Points on rays from the hole to the outline, at the bottom and at the top.
  for (const double z : {0.0, kPlateThickness})
    for (int ring = 0; ring <= kPlateRings; ++ring)
      for (int side = 0; side <= kPlateSegments; ++side) {
        const Vec3 outline = side <= kPlateSegmentsAcross
                                 ? Vec3(kPlateLength, kPlateWidth * side / kPlateSegmentsAcross, 0)
                                 : Vec3(kPlateLength * (kPlateSegments - side) / kPlateSegmentsAlong, kPlateWidth, 0);
        const Vec3 rim = kPlateHoleRadius * outline.normalized();
        const double share = static_cast<double>(ring) / kPlateRings;
        plate.positions.push_back((1 - share) * rim + share * outline + z * Vec3::UnitZ());
      }
  const auto vertex = [](int layer, int ring, int side) {
    return (layer * (kPlateRings + 1) + ring) * (kPlateSegments + 1) + side;
  };
  const auto add = [&](const char* name, std::array<Index, 4> corners) {
    plate.face_vertices.insert(plate.face_vertices.end(), corners.begin(), corners.end());
    plate.face_offsets.push_back(plate.face_vertices.size());
    plate.face_groups.of_face.push_back(group(name));
  };
  for (int ring = 0; ring < kPlateRings; ++ring) {
    for (int side = 0; side < kPlateSegments; ++side)
      for (const int layer : {0, 1}) {
        std::array<Index, 4> corners{vertex(layer, ring, side), vertex(layer, ring + 1, side),
                                     vertex(layer, ring + 1, side + 1), vertex(layer, ring, side + 1)};
        if (layer == 0) std::reverse(corners.begin(), corners.end());
        add(layer == 0 ? "symmetry_z" : "top", corners);
      }
    add("symmetry_y", {vertex(0, ring, 0), vertex(0, ring + 1, 0), vertex(1, ring + 1, 0), vertex(1, ring, 0)});
    add("symmetry_x", {vertex(0, ring + 1, kPlateSegments), vertex(0, ring, kPlateSegments),
                       vertex(1, ring, kPlateSegments), vertex(1, ring + 1, kPlateSegments)});
  }
  for (int side = 0; side < kPlateSegments; ++side) {
    add(side < kPlateSegmentsAcross ? "loaded" : "side",
        {vertex(0, kPlateRings, side), vertex(0, kPlateRings, side + 1), vertex(1, kPlateRings, side + 1),
         vertex(1, kPlateRings, side)});
    add("hole", {vertex(0, 0, side + 1), vertex(0, 0, side), vertex(1, 0, side), vertex(1, 0, side + 1)});
  }
  return plate;
}

}  // namespace subvol::samples

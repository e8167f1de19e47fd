// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/surface_faults.h"

#include "subvol/base/sort_unique.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/geometry/triangle_meeting.h"
#include "subvol/fit/mending/visible_normals.h"
#include "subvol/fit/target/surface_diagnosis.h"

#include <algorithm>

namespace subvol {

using namespace internal;
namespace {

Index name_of(Index number, std::span<const Index> names) {
  return names.empty() ? number : names[static_cast<std::size_t>(number)];
}

/// Joins the texts of the first items; tells how many there are if some are left out.
template <class TextOf>
std::string list_of(std::size_t count, const TextOf& text_of) {
  std::string text;
  for (std::size_t i = 0; i < std::min(count, kMostNamedPlaces); ++i) text += (i ? ", " : "") + text_of(i);
  if (count > kMostNamedPlaces) text += ", ... (" + std::to_string(count) + " in all)";
  return text;
}

Vec3 center_of(const PolygonMesh& surface, Index face) {
  Vec3 sum = Vec3::Zero();
  const auto corners = surface.face(face);
  for (const Index v : corners) sum += surface.positions[v];
  return sum / static_cast<double>(corners.size());
}

/// Returns a place that two faces have in common; of quads, near both.
Vec3 meeting_place(const PolygonMesh& surface, const std::array<Index, 2>& faces) {
  const auto a = surface.face(faces[0]), b = surface.face(faces[1]);
  if (a.size() != 3 || b.size() != 3 || faces[0] == faces[1])
    return (center_of(surface, faces[0]) + center_of(surface, faces[1])) / 2;
  const auto triangle = [&](std::span<const Index> corners) {
    return std::array<Vec3, 3>{surface.positions[corners[0]], surface.positions[corners[1]],
                               surface.positions[corners[2]]};
  };
  return meeting_of(triangle(a), triangle(b)).place;
}

}  // namespace

SurfaceFaults find_faults(const PolygonMesh& surface, MendingGoal goal, const std::function<bool()>& cancelled) {
  SurfaceFaults faults;
  std::vector<Index> face;
  const SelfIntersections found = self_intersections(fan_triangles(surface, &face), cancelled);
  faults.is_complete = found.is_complete;
  for (const Index t : found.degenerate) faults.flat.push_back(face[t]);
  for (const auto& [t, s] : found.pairs)
    faults.meeting.push_back({std::min(face[t], face[s]), std::max(face[t], face[s])});
  sort_unique(faults.flat);
  sort_unique(faults.meeting);
  if (goal == MendingGoal::layers) faults.hidden = visible_normals(surface).hidden;
  return faults;
}

std::string to_text(const SurfaceFaults& faults, const PolygonMesh& surface, const SurfaceNames& names) {
  std::string text;
  const auto tell = [&](const std::string& what, const std::string& places) {
    text += (text.empty() ? "" : "; ") + what + ": " + places;
  };
  const auto counted = [](std::size_t count, const std::string& one, const std::string& many) {
    return std::to_string(count) + " " + (count == 1 ? one : many);
  };
  if (!faults.flat.empty())
    tell(counted(faults.flat.size(), "face has no area", "faces have no area"),
         list_of(faults.flat.size(), [&](std::size_t i) {
           return "face " + std::to_string(name_of(faults.flat[i], names.faces)) + " at " +
                  to_text(center_of(surface, faults.flat[i]));
         }));
  if (!faults.meeting.empty())
    tell("the surface meets itself at " + counted(faults.meeting.size(), "pair of faces", "pairs of faces"),
         list_of(faults.meeting.size(), [&](std::size_t i) {
           const auto& [f, g] = faults.meeting[i];
           return "faces " + std::to_string(name_of(f, names.faces)) + " and " +
                  std::to_string(name_of(g, names.faces)) + " at " + to_text(meeting_place(surface, {f, g}));
         }));
  if (!faults.hidden.empty())
    tell(
        "no direction sees all faces around from their front at " + counted(faults.hidden.size(), "vertex", "vertices"),
        text_of_vertices(faults.hidden, surface.positions, names.vertices));
  return text;
}

std::string text_of_vertices(std::span<const Index> vertices, std::span<const Vec3> positions,
                             std::span<const Index> names) {
  return list_of(vertices.size(), [&](std::size_t i) {
    return "vertex " + std::to_string(name_of(vertices[i], names)) + " at " + to_text(positions[vertices[i]]);
  });
}

}  // namespace subvol

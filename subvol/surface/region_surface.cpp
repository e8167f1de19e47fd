// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/region_surface.h"

#include "subvol/base/sort_unique.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/welded_surface.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cassert>
#include <utility>

namespace subvol {

using namespace internal;

namespace {

/// Returns the place of a region in the surface's list, which is sorted by number.
std::size_t place_of(const RegionSurface& surface, int region) {
  const auto at = std::ranges::lower_bound(surface.regions, region, {}, &Group::number);
  assert(at != surface.regions.end() && at->number == region);
  return static_cast<std::size_t>(at - surface.regions.begin());
}

/// Returns some triangles of a surface with their groups, and the vertices that they name.
TriangleMesh selected(const TriangleMesh& mesh, std::span<const Index> triangles) {
  TriangleMesh result;
  result.face_groups.groups = mesh.face_groups.groups;
  std::vector<Index> number(mesh.positions.size(), kNoIndex);
  for (const Index t : triangles) {
    std::array<Index, 3> corners = mesh.triangles[t];
    for (Index& v : corners) {
      if (number[v] == kNoIndex) {
        number[v] = static_cast<Index>(result.positions.size());
        result.positions.push_back(mesh.positions[v]);
      }
      v = number[v];
    }
    result.triangles.push_back(corners);
    if (!mesh.face_groups.empty()) result.face_groups.of_face.push_back(mesh.face_groups.of_face[t]);
  }
  return result;
}

/// Returns the boundary of a region, given its triangles.
TriangleMesh boundary_of(const RegionSurface& surface, int region, std::span<const Index> triangles) {
  std::vector<Index> used;
  for (const Index t : triangles)
    used.insert(used.end(), surface.mesh.triangles[t].begin(), surface.mesh.triangles[t].end());
  sort_unique(used);
  TriangleMesh boundary;
  for (const Index v : used) boundary.positions.push_back(surface.mesh.positions[v]);
  for (const Index t : triangles) {
    std::array<Index, 3> corners = surface.mesh.triangles[t];
    for (Index& v : corners) v = static_cast<Index>(std::ranges::lower_bound(used, v) - used.begin());
    if (surface.sides[t][1] == region) std::swap(corners[1], corners[2]);
    boundary.triangles.push_back(corners);
  }
  return boundary;
}

}  // namespace

const char* to_string(RegionRule rule) {
  switch (rule) {
    case RegionRule::automatic: return "auto";
    case RegionRule::keep: return "keep";
    case RegionRule::merge: return "merge";
  }
  return "unknown";
}

void orient_sheets(RegionSurface& surface) {
  surface.volumes.assign(surface.regions.size(), 0.0);
  // Each region has an origin of its own: seen from a distant one, its volume would be lost to rounding.
  std::vector<Index> origins(surface.regions.size(), kNoIndex);
  for (std::size_t t = 0; t < surface.sides.size(); ++t) {
    auto& [behind, front] = surface.sides[t];
    if (behind == kOutsideRegion || (front != kOutsideRegion && front < behind)) {
      std::swap(behind, front);
      std::swap(surface.mesh.triangles[t][1], surface.mesh.triangles[t][2]);
    }
    for (const int region : surface.sides[t]) {
      if (region == kOutsideRegion) continue;
      const std::size_t r = place_of(surface, region);
      if (origins[r] == kNoIndex) origins[r] = surface.mesh.triangles[t][0];
      const Vec3& origin = surface.mesh.positions[origins[r]];
      const double below = sixfold_volume(surface.mesh.positions, surface.mesh.triangles[t], origin) / 6;
      surface.volumes[r] += region == behind ? below : -below;
    }
  }
}

RegionSurface surface_of_regions(const VolumeMesh& mesh) {
  const MeshTopology topology(mesh);
  const std::vector<int> references = region_references(mesh);
  const bool keeps = references.front() > kOutsideRegion;
  const auto number_of = [&](int reference) {
    return keeps ? reference
                 : 1 + static_cast<int>(std::ranges::lower_bound(references, reference) - references.begin());
  };
  RegionSurface surface;
  for (const int reference : references) {
    Group region{"", number_of(reference), 3};
    for (const Group& named : mesh.regions)
      if (named.number == reference) region.name = named.name;
    surface.regions.push_back(std::move(region));
  }
  surface.mesh.positions = mesh.positions;
  const auto region_of = [&](Index cell) {
    if (cell == kNoIndex) return kOutsideRegion;
    return number_of(mesh.references.empty() ? 0 : mesh.references[cell]);
  };
  const auto add = [&](Index f) {
    const auto face = topology.face(f);
    const auto [first, second] = topology.face_cells(f);
    const auto center = static_cast<Index>(surface.mesh.positions.size());
    if (face.size() > 3) {
      Vec3 sum = Vec3::Zero();
      for (const Index v : face) sum += mesh.positions[v];
      surface.mesh.positions.push_back(sum / static_cast<double>(face.size()));
    }
    for (std::size_t i = 0; i < (face.size() > 3 ? face.size() : 1); ++i) {
      if (face.size() > 3)
        surface.mesh.triangles.push_back({center, face[i], face[(i + 1) % face.size()]});
      else
        surface.mesh.triangles.push_back({face[0], face[1], face[2]});
      surface.sides.push_back({region_of(first), region_of(second)});
    }
  };
  for (const Index f : topology.boundary_faces()) add(f);
  for (const Index f : find_interfaces(mesh, topology).faces) add(f);
  orient_sheets(surface);
  return surface;
}

TriangleMesh boundary_of_region(const RegionSurface& surface, int region) {
  std::vector<Index> triangles;
  for (std::size_t t = 0; t < surface.sides.size(); ++t)
    if (std::ranges::find(surface.sides[t], region) != surface.sides[t].end())
      triangles.push_back(static_cast<Index>(t));
  return boundary_of(surface, region, triangles);
}

std::vector<TriangleMesh> boundaries_of_regions(const RegionSurface& surface) {
  std::vector<std::vector<Index>> triangles(surface.regions.size());
  for (std::size_t t = 0; t < surface.sides.size(); ++t)
    for (const int side : surface.sides[t])
      if (side != kOutsideRegion) triangles[place_of(surface, side)].push_back(static_cast<Index>(t));
  std::vector<TriangleMesh> boundaries;
  for (std::size_t r = 0; r < triangles.size(); ++r)
    boundaries.push_back(boundary_of(surface, surface.regions[r].number, triangles[r]));
  return boundaries;
}

TriangleMesh outer_surface(const RegionSurface& surface) {
  std::vector<Index> outer;
  for (std::size_t t = 0; t < surface.sides.size(); ++t)
    if (!surface.is_inner(t)) outer.push_back(static_cast<Index>(t));
  return selected(surface.mesh, outer);
}

TriangleMesh inner_surface(const RegionSurface& surface, std::vector<Index>& triangles) {
  triangles.clear();
  for (std::size_t t = 0; t < surface.sides.size(); ++t)
    if (surface.is_inner(t)) triangles.push_back(static_cast<Index>(t));
  return selected(surface.mesh, triangles);
}

std::vector<std::array<int, 2>> region_pairs(const RegionSurface& surface) {
  std::vector<std::array<int, 2>> pairs;
  for (std::size_t t = 0; t < surface.sides.size(); ++t) pairs.push_back(surface.pair(t));
  sort_unique(pairs);
  return pairs;
}

std::vector<std::array<Index, 2>> curve_edges(const RegionSurface& surface) {
  std::vector<std::array<Index, 2>> edges;
  const std::vector<SurfaceHalfEdge> sides = sorted_half_edges(surface.mesh.triangles, surface.mesh.positions.size());
  for_each_edge(sides, [&](std::span<const SurfaceHalfEdge> edge) {
    const auto pair = surface.pair(edge[0].triangle);
    if (edge.size() != 2 || surface.pair(edge[1].triangle) != pair) edges.push_back({edge[0].low, edge[0].high});
  });
  return edges;
}

}  // namespace subvol

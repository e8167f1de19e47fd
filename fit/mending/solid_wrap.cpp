// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/solid_wrap.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/target/surface_wrap.h"
#include "subvol/surface/part_nesting.h"
#include "subvol/surface/solid_topology.h"
#include "subvol/surface/surface_parts.h"

#include <algorithm>
#include <string>
#include <utility>

namespace subvol::internal {

namespace {

bool bounds_solid(const TriangleMesh& surface) {
  try {
    return solid_boundary(surface).volume > 0;
  } catch (const InputError&) {
    return false;
  }
}

bool has_sheets(const SurfaceDiagnosis& diagnosis) {
  constexpr std::size_t kChaoticCrossingsPerEdge = 10;  // crossings for each edge of a sheet
  const SurfaceFinding* edges = diagnosis.find(SurfaceFault::interface);
  if (!edges) return false;
  const SurfaceFinding* crossings = diagnosis.find(SurfaceFault::crossing);
  if (crossings && crossings->count > kChaoticCrossingsPerEdge * edges->count) return false;
  double length = 0;
  for (const SurfacePlace& place : edges->places)
    if (place.to) length += (*place.to - place.at).norm();
  return edges->count > edges->places.size() || length > kPinholePercent / 100 * diagnosis.diagonal;
}

/// Returns the first finding that prevents filling, in words, or "".
std::string cause(const SurfaceDiagnosis& diagnosis) {
  for (const SurfaceFinding& finding : diagnosis.findings)
    if (prevents_filling(finding.fault)) return to_text(finding, diagnosis.diagonal) + "; ";
  return "";
}

/// Mean distance from a wrap to the surface above which it is of something else, in percent of the diagonal: half a
/// voxel. Wraps of solids with faults have at most a tenth of it.
constexpr double kMostMeanPercent = 0.25;

/// Returns how far a wrap is from the surface that was given, in words. InputError: it is of something else.
std::string how_far(const TriangleMesh& wrap, const TriangleMesh& given, double diagonal, const std::string& why) {
  const SurfaceDistance distance = surface_distance(wrap, given);
  const SurfaceDistance::Extreme& farthest = distance.max_a_to_b;
  const double mean = 100 * distance.mean_a_to_b / diagonal;
  if (mean > kMostMeanPercent)
    throw InputError(
        formatted("target: %sit bounds no solid: even a wrap of it is %.3g %% off on average", why.c_str(), mean));
  return formatted("the wrap is %.3g %% off the surface on average, and at most %.3g %%, at (%.6g, %.6g, %.6g)", mean,
                   100 * farthest.distance / diagonal, farthest.from.x(), farthest.from.y(), farthest.from.z());
}

}  // namespace

bool needs_wrap(const TriangleMesh* repaired, const SurfaceDiagnosis& diagnosis) {
  if (has_sheets(diagnosis)) return false;
  const bool crosses = diagnosis.find(SurfaceFault::crossing) || diagnosis.find(SurfaceFault::face_contact);
  return !repaired || (crosses && surface_parts(*repaired).num_parts() > 1) || !bounds_solid(*repaired);
}

std::optional<SurfaceRepair> wrapped_to_fill(const TriangleMesh& given, const SurfaceDiagnosis& diagnosis,
                                             const std::function<bool()>& cancelled) {
  TriangleMesh outward = given;
  if (signed_volume_of(given) < 0)
    for (auto& triangle : outward.triangles) std::swap(triangle[1], triangle[2]);
  const WrapOptions options;
  SurfaceRepair repair;
  try {
    repair.surface = wrap_surface(outward, options, cancelled);
  } catch (const InputError&) {
    return std::nullopt;
  }
  if (repair.surface.triangles.empty() || surface_parts(repair.surface).num_parts() > diagnosis.parts.size())
    return std::nullopt;
  const std::string why = cause(diagnosis);
  repair.done.push_back(
      "target: " + why +
      formatted("it bounds no solid, and is wrapped with voxels of %g %% of its diagonal; ", options.voxel_percent) +
      how_far(repair.surface, given, diagnosis.diagonal, why));
  repair.is_fillable = true;
  return repair;
}

}  // namespace subvol::internal

// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/target_surface.h"

#include "fit/enclosed_volume.h"
#include "fit/soup_topology.h"
#include "subvol/error.h"

#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

namespace subvol {

namespace {

constexpr double kClosedEnough = 0.95;  // share of paired half-edges above which the signed sum is trusted
constexpr double kFlatness = 1e-6;      // of the isoperimetric bound: below it, nothing is enclosed
constexpr int kFloodResolution = 96;
constexpr std::size_t kMaxSamples = std::size_t{1} << 27;

/// Volume of the sphere of the given area: no surface of that area encloses more.
double isoperimetric_bound(double area) { return area * std::sqrt(area / std::numbers::pi) / 6; }

double find_volume(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles, double area,
                   VolumeSource& source) {
  const double bound = isoperimetric_bound(area);
  source = VolumeSource::signed_sum;
  if (soup_topology(positions, triangles).closed_share >= kClosedEnough) {
    const double volume = signed_volume(positions, triangles);
    if (volume > kFlatness * bound) return volume;
  }
  source = VolumeSource::flood;
  const double volume = flooded_volume(positions, triangles, kFloodResolution);
  if (volume > kFlatness * bound) return volume;
  source = VolumeSource::isoperimetric;
  return bound / 2;
}

}  // namespace

TargetSurface::TargetSurface(const TriangleMesh& mesh, const TargetSurfaceOptions& options)
    : positions_(mesh.positions) {
  if (!(options.sample_spacing >= 0) || !std::isfinite(options.sample_spacing))
    throw InputError("TargetSurface: sample_spacing must be finite and >= 0");
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& corners = mesh.triangles[t];
    for (Index v : corners) {
      if (v < 0 || static_cast<std::size_t>(v) >= mesh.positions.size())
        throw InputError("target: triangle " + std::to_string(t) + " has a corner outside [0, number of positions)");
      if (!mesh.positions[v].allFinite()) throw InputError("target: position " + std::to_string(v) + " is not finite");
    }
    const Vec3 &a = positions_[corners[0]], &b = positions_[corners[1]], &c = positions_[corners[2]];
    const Vec3 normal = (b - a).cross(c - a);
    const double length = normal.norm();
    if (!(length > 0)) continue;
    triangles_.push_back(corners);
    normals_.push_back(normal / length);
    areas_.push_back(0.5 * length);
    area_ += 0.5 * length;
    for (const Vec3* p : {&a, &b, &c}) {
      low = low.cwiseMin(*p);
      high = high.cwiseMax(*p);
    }
    add_samples({a, b, c}, static_cast<Index>(triangles_.size() - 1), options.sample_spacing);
  }
  if (triangles_.empty()) throw InputError("target: no triangle has an area");
  // Positions of no triangle take no part, whatever they are.
  diagonal_ = (high - low).norm();
  centre_ = low + 0.5 * (high - low);
  volume_ = find_volume(positions_, triangles_, area_, volume_source_);
}

void TargetSurface::add_samples(const std::array<Vec3, 3>& corners, Index triangle, double spacing) {
  if (samples_.size() >= kMaxSamples) throw InputError("TargetSurface: sample_spacing is too small for this target");
  if (spacing > 0) {
    int longest = 0;
    double squared[3];
    for (int k = 0; k < 3; ++k) {
      squared[k] = (corners[(k + 1) % 3] - corners[k]).squaredNorm();
      if (squared[k] > squared[longest]) longest = k;
    }
    if (squared[longest] > spacing * spacing) {
      const Vec3 &a = corners[longest], &b = corners[(longest + 1) % 3], &c = corners[(longest + 2) % 3];
      const Vec3 middle = 0.5 * (a + b);
      add_samples({a, middle, c}, triangle, spacing);
      add_samples({middle, b, c}, triangle, spacing);
      return;
    }
  }
  samples_.push_back((corners[0] + corners[1] + corners[2]) / 3);
  sample_triangles_.push_back(triangle);
}

}  // namespace subvol

// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/target_surface.h"

#include "subvol/base/error.h"
#include "subvol/base/length_range.h"
#include "subvol/fit/geometry/grouped_closest_point.h"
#include "subvol/fit/target/cloud_geometry.h"
#include "subvol/fit/target/enclosed_volume.h"
#include "subvol/fit/target/soup_topology.h"
#include "subvol/surface/part_nesting.h"
#include "subvol/surface/solid_topology.h"
#include "subvol/surface/surface_parts.h"
#include "subvol/surface/triangle_geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string>

namespace subvol {

using namespace internal;

namespace {

constexpr double kClosedEnough = 0.95;  // share of paired half-edges above which the signed sum is trusted
constexpr double kFlatness = 1e-6;      // share of the isoperimetric bound below which nothing is enclosed
constexpr int kFloodResolution = 96;    // cells along the longest axis, with which the space outside is flooded
constexpr std::size_t kMaxSamples = std::size_t{1} << 27;
/// Samples up to which triangles are sampled along their whole length, however thin they are.
constexpr std::size_t kManySamples = 2'000'000;
/// Samples in a square of the spacing that triangles of a usual shape do not exceed: halving longest edges makes 4
/// to 20.
constexpr double kMostInSquare = 32;
constexpr double kRimBarycentricTolerance = 1e-9;  // barycentric coordinates up to this count as 0

/// Sizes of the cells of a cloud's grid, in units of its points' spacing: first cells with about ten points each if the
/// surface passes straight through them, then larger ones.
constexpr double kCloudCells[] = {3, 4.5, 6.5};

/// Returns the volume of the sphere of the given area: no surface of that area encloses more.
double isoperimetric_bound(double area) { return area * std::sqrt(area / std::numbers::pi) / 6; }

struct Volume {
  double value;
  VolumeSource source;
};

/// Returns the volume of the solid that the mended surface bounds; 0 if it cannot be mended.
double mended_volume(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles) {
  try {
    return solid_boundary({{positions.begin(), positions.end()}, {triangles.begin(), triangles.end()}}).volume;
  } catch (const InputError&) {
    return 0;
  }
}

/// Returns true if all closed parts with more than a given volume face the way that their nesting asks for. The volumes
/// of parts that do not would be taken off the sum instead of added, or the other way around.
bool parts_agree(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles, double least) {
  const SurfaceParts parts =
      surface_parts({{positions.begin(), positions.end()}, {triangles.begin(), triangles.end()}});
  if (parts.num_parts() <= 1) return true;
  const PartNesting nesting = part_nesting(parts.surface.mesh, parts.part, static_cast<int>(parts.num_parts()));
  for (std::size_t p = 0; p < parts.num_parts(); ++p)
    if (parts.is_closed[p] && std::abs(nesting.volumes[p]) > least && !nesting.faces_out(p)) return false;
  return true;
}

Volume find_volume(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles, double area,
                   double closed_share) {
  const double bound = isoperimetric_bound(area);
  double sum = closed_share >= kClosedEnough ? signed_volume(positions, triangles) : 0;
  if (closed_share == 1 && sum > kFlatness * bound) {
    if (parts_agree(positions, triangles, kFlatness * bound)) return {sum, VolumeSource::signed_sum};
    sum = 0;
  }
  if (const double mended = mended_volume(positions, triangles); mended > kFlatness * bound && mended <= bound)
    return {mended, VolumeSource::mended};
  if (sum > kFlatness * bound) return {sum, VolumeSource::signed_sum};
  const double flooded = flooded_volume(positions, triangles, kFloodResolution);
  if (flooded > kFlatness * bound) return {flooded, VolumeSource::flood};
  return {bound / 2, VolumeSource::isoperimetric};
}

Volume find_volume(std::span<const Vec3> points, const CloudGeometry& geometry, const Vec3& extent) {
  for (double cells : kCloudCells) {
    const double resolution = std::clamp(extent.maxCoeff() / (cells * geometry.spacing), 1.0, 2.0 * kFloodResolution);
    const double flooded = flooded_volume(points, static_cast<int>(resolution));
    if (flooded > kFlatness * isoperimetric_bound(geometry.area)) return {flooded, VolumeSource::flood};
  }
  return {isoperimetric_bound(geometry.area) / 2, VolumeSource::isoperimetric};
}

}  // namespace

const char* to_string(PointWeights weights) { return weights == PointWeights::equal ? "equal" : "area"; }

const char* to_string(VolumeSource source) {
  switch (source) {
    case VolumeSource::signed_sum: return "signed sum";
    case VolumeSource::mended: return "mended surface";
    case VolumeSource::flood: return "flooded grid";
    case VolumeSource::isoperimetric: return "area alone";
    case VolumeSource::given: return "template";
  }
  return "unknown";
}

void TargetSurface::take_triangles(const TriangleMesh& mesh) {
  positions_ = mesh.positions;
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& corners = mesh.triangles[t];
    for (Index v : corners) {
      if (v < 0 || static_cast<std::size_t>(v) >= mesh.positions.size())
        throw InputError("target: triangle " + std::to_string(t) + " has a corner outside [0, number of positions)");
      if (!mesh.positions[v].allFinite()) throw InputError("target: position " + std::to_string(v) + " is not finite");
    }
    const Vec3 normal = doubled_area_vector(mesh, corners);
    const double length = normal.norm();
    if (!std::isfinite(length)) throw InputError("target: triangle " + std::to_string(t) + " is too large");
    if (!(length > 0)) continue;
    triangles_.push_back(corners);
    normals_.push_back(normal / length);
    areas_.push_back(0.5 * length);
    area_ += 0.5 * length;
    for (const Index v : corners) {
      low = low.cwiseMin(positions_[v]);
      high = high.cwiseMax(positions_[v]);
    }
  }
  if (triangles_.empty()) throw InputError("target: no triangle has an area");
  set_box(low, high);  // positions that no triangle uses are ignored
}

Vec3 TargetSurface::center_of(const TriangleMesh& mesh) {
  TargetSurface surface;
  surface.take_triangles(mesh);
  return surface.center();
}

TargetSurface::TargetSurface(const TriangleMesh& mesh, const TargetSurfaceOptions& options) {
  take_triangles(mesh);
  edges_ = soup_topology(positions_, triangles_, &rim_parts_);
  if (options.volume != 0) {
    set_volume(options.volume);
  } else {
    const Volume volume = find_volume(positions_, triangles_, area_, edges_.closed_share);
    volume_ = volume.value;
    volume_source_ = volume.source;
  }
  resample(options.sample_spacing);
}

TargetSurface::TargetSurface(const PointCloud& cloud, PointWeights weights) {
  CloudGeometry geometry = cloud_geometry(cloud.points);
  samples_ = cloud.points;
  sample_normals_ = std::move(geometry.normals);
  area_ = geometry.area;
  sample_areas_ = weights == PointWeights::by_area
                      ? std::move(geometry.areas)
                      : std::vector<double>(samples_.size(), area_ / static_cast<double>(samples_.size()));
  Vec3 low = samples_[0], high = low;
  for (const Vec3& p : samples_) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  set_box(low, high);
  const Volume volume = find_volume(samples_, geometry, high - low);
  volume_ = volume.value;
  volume_source_ = volume.source;
}

void TargetSurface::set_box(const Vec3& low, const Vec3& high) {
  require_length((high - low).maxCoeff(), "target");
  diagonal_ = (high - low).norm();
  center_ = low + 0.5 * (high - low);
}

void TargetSurface::set_volume(double volume) {
  if (!(volume > 0) || !std::isfinite(volume)) throw InputError("TargetSurface: a volume must be positive and finite");
  volume_ = volume;
  volume_source_ = VolumeSource::given;
}

bool TargetSurface::on_rim(Index triangle, const std::array<double, 3>& barycentric) const {
  const unsigned parts = rim_parts_[triangle];
  for (int k = 0; k < 3; ++k) {
    if (barycentric[(k + 2) % 3] <= kRimBarycentricTolerance && parts >> k & 1) return true;
    if (barycentric[k] >= 1 - kRimBarycentricTolerance && parts >> (3 + k) & 1) return true;
  }
  return false;
}

std::shared_ptr<const GroupedClosestPoint> TargetSurface::tree() const {
  if (!tree_ && !is_cloud()) tree_ = std::make_shared<const GroupedClosestPoint>(TriangleMesh{positions_, triangles_});
  return tree_;
}

std::shared_ptr<const GroupedClosestPoint> TargetSurface::tree(std::span<const Index> groups) const {
  if (!tree_by_group_ || !std::ranges::equal(groups_of_tree_, groups)) {
    tree_by_group_ = std::make_shared<const GroupedClosestPoint>(TriangleMesh{positions_, triangles_}, groups);
    groups_of_tree_.assign(groups.begin(), groups.end());
  }
  return tree_by_group_;
}

void TargetSurface::resample(double spacing) {
  if (!(spacing >= 0) || !std::isfinite(spacing))
    throw InputError("TargetSurface: sample_spacing must be finite and >= 0");
  if (is_cloud()) return;
  const double squares = spacing > 0 ? area_ / spacing / spacing : 0;
  // Halving ends with parts of at most half a square.
  if (!(2 * squares < static_cast<double>(kMaxSamples)))
    throw InputError("TargetSurface: sample_spacing is too small for this target");
  const std::size_t usual = triangles_.size() + static_cast<std::size_t>(kMostInSquare * squares);
  if (!take_samples(spacing, std::max(kManySamples, usual), false)) take_samples(spacing, kMaxSamples, true);
  sample_normals_.resize(samples_.size());
  for (std::size_t j = 0; j < samples_.size(); ++j) sample_normals_[j] = normals_[sample_triangles_[j]];
}

bool TargetSurface::take_samples(double spacing, std::size_t most, bool thins_needles) {
  samples_.clear();
  sample_triangles_.clear();
  sample_areas_.clear();
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const auto& [a, b, c] = triangles_[t];
    const std::array<Vec3, 3> corners{positions_[a], positions_[b], positions_[c]};
    const std::size_t first = samples_.size();
    if (first >= kMaxSamples) throw InputError("TargetSurface: sample_spacing is too small for this target");
    const std::size_t limit =
        thins_needles
            ? std::max<std::size_t>(1, static_cast<std::size_t>(kMostInSquare * areas_[t] / spacing / spacing))
            : most - first;
    add_samples(corners, spacing, first + limit);
    if (samples_.size() > first + limit) {
      if (!thins_needles) return false;
      samples_.resize(first);
      add_along_needle(corners, t, limit);
    }
    sample_triangles_.resize(samples_.size(), static_cast<Index>(t));
    sample_areas_.resize(samples_.size(), areas_[t] / static_cast<double>(samples_.size() - first));
  }
  return true;
}

void TargetSurface::thin(std::size_t most) {
  if (most == 0) throw InputError("TargetSurface::thin: expected at least one sample");
  if (is_cloud() || samples_.size() <= most) return;
  std::vector<std::size_t> first(triangles_.size() + 1, 0);  // samples are ordered by their triangles
  for (const Index t : sample_triangles_) ++first[t + 1];
  for (std::size_t t = 0; t < triangles_.size(); ++t) first[t + 1] += first[t];
  const double part = area_ / static_cast<double>(most);
  const auto middles_before = [part](double area) { return std::floor(area / part + 0.5); };
  std::vector<double> weights(samples_.size(), 0);
  double before = 0;
  for (const Index t : tree()->order())
    for (std::size_t j = first[t]; j < first[t + 1]; ++j) {
      const double after = before + sample_areas_[j];
      weights[j] = part * (middles_before(after) - middles_before(before));
      before = after;
    }
  std::size_t kept = 0;
  for (std::size_t j = 0; j < weights.size(); ++j) {
    if (!(weights[j] > 0)) continue;
    samples_[kept] = samples_[j];
    sample_triangles_[kept] = sample_triangles_[j];
    sample_normals_[kept] = sample_normals_[j];
    sample_areas_[kept] = weights[j];
    ++kept;
  }
  samples_.resize(kept);
  sample_triangles_.resize(kept);
  sample_normals_.resize(kept);
  sample_areas_.resize(kept);
}

void TargetSurface::add_samples(const std::array<Vec3, 3>& corners, double spacing, std::size_t most) {
  if (samples_.size() > most) return;
  if (spacing > 0) {
    int longest = 0;
    double squared[3];
    for (int k = 0; k < 3; ++k) {
      squared[k] = (corners[(k + 1) % 3] - corners[k]).squaredNorm();
      if (squared[k] > squared[longest]) longest = k;
    }
    const Vec3 &a = corners[longest], &b = corners[(longest + 1) % 3], &c = corners[(longest + 2) % 3];
    const Vec3 middle = 0.5 * (a + b);
    if (squared[longest] > spacing * spacing && middle != a && middle != b) {
      add_samples({a, middle, c}, spacing, most);
      add_samples({middle, b, c}, spacing, most);
      return;
    }
  }
  samples_.push_back((corners[0] + corners[1] + corners[2]) / 3);
}

void TargetSurface::add_along_needle(const std::array<Vec3, 3>& corners, std::size_t triangle, std::size_t count) {
  int longest = 0;
  for (int k = 1; k < 3; ++k)
    if ((corners[(k + 1) % 3] - corners[k]).norm() > (corners[(longest + 1) % 3] - corners[longest]).norm())
      longest = k;
  const Vec3 &a = corners[longest], &b = corners[(longest + 1) % 3], &c = corners[(longest + 2) % 3];
  const Vec3 along = b - a;
  const double apex = std::clamp((c - a).dot(along) / along.squaredNorm(), 0.0, 1.0);  // place of c along the edge
  // Multiples of the golden ratio spread the samples of a row of needles over their length.
  const double offset = std::fmod(static_cast<double>(triangle + 1) * std::numbers::phi, 1);
  for (std::size_t i = 0; i < count; ++i) {
    const double share = (static_cast<double>(i) + offset) / static_cast<double>(count);  // of the area, seen from a
    const bool is_before = share < apex;
    const double to_apex = is_before ? std::sqrt(share / apex) : std::sqrt((1 - share) / (1 - apex));
    const Vec3 on_side = is_before ? Vec3(a + to_apex * (c - a)) : Vec3(b + to_apex * (c - b));
    const double place = is_before ? to_apex * apex : 1 - to_apex * (1 - apex);
    samples_.push_back(0.5 * (a + place * along + on_side));
  }
}

}  // namespace subvol

// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/high_order_patches.h"

#include "subvol/base/error.h"
#include "subvol/mesh/feature_tags.h"
#include "subvol/subdivision/surface_refinement.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace subvol {

using namespace internal;
namespace {

constexpr double kVanishingModeShare = 1e-13;  // relative to the largest coefficient

/// A point of a patch in the face's cell: the corners of the patch are one corner of the face, two midpoints of edges,
/// and the center.
Vec3 patch_point(const std::vector<Vec3>& corners, std::size_t corner, double u, double v) {
  const std::size_t n = corners.size();
  const Vec3 &here = corners[corner], &next = corners[(corner + 1) % n], &before = corners[(corner + n - 1) % n];
  Vec3 center = Vec3::Zero();
  for (const Vec3& c : corners) center += c / static_cast<double>(n);
  const Vec3 ahead = (here + next) / 2, behind = (here + before) / 2;
  return (1 - u) * (1 - v) * here + u * (1 - v) * ahead + u * v * center + (1 - u) * v * behind;
}

}  // namespace

HighOrderPatches::HighOrderPatches(const HighOrderMesh& mesh, double crease_angle_degrees)
    : basis_(mesh.space.basis()), max_order_(mesh.space.max_order()) {
  if (!(crease_angle_degrees >= 0 && crease_angle_degrees <= 180))
    throw InputError("crease_angle_degrees: expected an angle from 0 to 180");
  BoundarySurface boundary = tagged_boundary(mesh.straight_sided(), mesh.space.topology());
  SurfaceTopology& coarse = boundary.topology;
  for (const Index f : boundary.faces) faces_.push_back(make_face(mesh, f));
  const double least_cosine = std::cos(crease_angle_degrees * std::numbers::pi / 180);
  const auto num_edges = static_cast<Index>(coarse.num_edges());
#pragma omp parallel for schedule(static)
  for (Index e = 0; e < num_edges; ++e) {
    const Index h = coarse.edge_corners[e], twin = coarse.twins[h];
    const Index f = coarse.corner_faces[h], g = coarse.corner_faces[twin];
    if (crease_angle_degrees < 180 &&
        is_sharp(faces_[f], h - coarse.face_offsets[f], faces_[g], twin - coarse.face_offsets[g], least_cosine))
      coarse.edge_sharpness[e] = static_cast<float>(kInfiniteSharpness);
  }
  layout_ = patch_layout(coarse);
  quads_ = refined_topology(coarse);
}

HighOrderPatches::Face HighOrderPatches::make_face(const HighOrderMesh& mesh, Index f) const {
  const ElementSpace& space = mesh.space;
  const std::size_t c = space.topology().face_cells(f)[0];
  Face face{space.kind(c), {}, {}, {}};
  const auto vertices = space.vertices(c);
  for (const Index v : space.topology().face(f))
    face.corners.push_back(
        canonical_vertices(face.kind)[std::find(vertices.begin(), vertices.end(), v) - vertices.begin()]);
  // Functions vanish, up to rounding, on the faces that they do not belong to, and others do not vanish at a point so
  // irregular.
  ShapeFunctions at = shapes(face);
  at.set_point(patch_point(face.corners, 0, 1 / std::numbers::pi, 1 / std::numbers::e));
  const auto modes = space.modes(c);
  const auto nodes = space.nodes(c);
  const auto signs = space.signs(c);
  for (std::size_t a = 0; a < modes.size(); ++a) {
    if (std::abs(at.value(modes[a])) < kVanishingModeShare) continue;
    face.modes.push_back(modes[a]);
    face.coefficients.push_back(signs[a] * mesh.coefficients[nodes[a]]);
  }
  return face;
}

HighOrderPatches::Frame HighOrderPatches::evaluate(const Face& face, ShapeFunctions& shapes, const Vec3& point,
                                                   bool with_normal) const {
  shapes.set_point(point);
  Frame frame{Vec3::Zero(), Vec3::Zero()};
  if (!with_normal) {
    for (std::size_t a = 0; a < face.modes.size(); ++a)
      frame.position += shapes.value(face.modes[a]) * face.coefficients[a];
    return frame;
  }
  const Vec3 along = face.corners[1] - face.corners[0], across = face.corners.back() - face.corners[0];
  Vec3 du = Vec3::Zero(), dv = Vec3::Zero(), gradient;
  for (std::size_t a = 0; a < face.modes.size(); ++a) {
    frame.position += shapes.value(face.modes[a], gradient) * face.coefficients[a];
    du += gradient.dot(along) * face.coefficients[a];
    dv += gradient.dot(across) * face.coefficients[a];
  }
  frame.normal = unit_normal(du, dv);
  return frame;
}

bool HighOrderPatches::is_sharp(const Face& face, int corner, const Face& other, int other_corner,
                                double least_cosine) const {
  ShapeFunctions at_face = shapes(face), at_other = shapes(other);
  const auto on_edge = [](const Face& on, int k, double t) {
    return Vec3((1 - t) * on.corners[k] + t * on.corners[(k + 1) % on.corners.size()]);
  };
  for (const double t : {0.0625, 0.25, 0.5, 0.75, 0.9375}) {
    const Vec3 n = evaluate(face, at_face, on_edge(face, corner, t), true).normal;
    const Vec3 m = evaluate(other, at_other, on_edge(other, other_corner, 1 - t), true).normal;
    if (n.dot(m) < least_cosine) return true;
  }
  return false;
}

void HighOrderPatches::evaluate(Index patch, std::span<const int> u, std::span<const int> v, Vec3* positions,
                                Vec3* normals) const {
  const auto& [f, corner] = layout_.face_corners[patch];
  const Face& face = faces_[f];
  ShapeFunctions at = shapes(face);
  std::size_t i = 0;
  for (const int b : v)
    for (const int a : u) {
      const Vec3 point =
          patch_point(face.corners, static_cast<std::size_t>(corner), static_cast<double>(a) / kPatchSideUnits,
                      static_cast<double>(b) / kPatchSideUnits);
      const Frame frame = evaluate(face, at, point, normals != nullptr);
      positions[i] = frame.position;
      if (normals) normals[i] = frame.normal;
      ++i;
    }
}

double HighOrderPatches::bounding_box_diagonal() const {
  const std::array<int, 5> t{0, kPatchSideUnits / 4, kPatchSideUnits / 2, 3 * kPatchSideUnits / 4, kPatchSideUnits};
  std::array<Vec3, 25> points;
  Eigen::AlignedBox3d box;
  for (std::size_t p = 0; p < num_patches(); ++p) {
    evaluate(static_cast<Index>(p), t, t, points.data());
    for (const Vec3& x : points) box.extend(x);
  }
  return box.isEmpty() ? 0 : box.diagonal().norm();
}

}  // namespace subvol

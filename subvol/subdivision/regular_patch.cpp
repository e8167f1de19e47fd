// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/subdivision/regular_patch.h"

#include "subvol/mesh/feature_tags.h"

namespace subvol::internal {

namespace {

bool is_infinite(float sharpness) { return sharpness >= static_cast<float>(kInfiniteSharpness); }

bool is_regular_corner(const SurfaceTopology& surface, Index corner) {
  const float own = surface.vertex_sharpness[surface.corner_vertices[corner]];
  if (own > 0 && !is_infinite(own)) return false;
  int valence = 0, num_sharp = 0;
  Index h = corner;
  do {
    const float s = surface.edge_sharpness[surface.corner_edges[h]];
    if (s > 0 && !is_infinite(s)) return false;
    ++valence;
    num_sharp += s > 0;
    h = surface.rotate(h);
  } while (h != corner);
  if (own <= 0 && num_sharp == 0) return valence == 4;

  const auto is_sharp = [&](Index g) { return surface.edge_sharpness[surface.corner_edges[g]] > 0; };
  const bool out = is_sharp(corner), in = is_sharp(surface.prev(corner));
  const bool stays = own > 0 || num_sharp > 2;
  if (stays) return out && in;
  if (num_sharp != 2 || out == in) return false;
  // Exactly one more face must lie between the creases: counter-clockwise from this one if the edge out is sharp,
  // otherwise clockwise.
  return out ? is_sharp(surface.prev(surface.rotate(corner))) : is_sharp(surface.next(surface.twins[corner]));
}

}  // namespace

bool is_regular(const SurfaceTopology& surface, Index face) {
  for (Index h = surface.face_offsets[face]; h < surface.face_offsets[face + 1]; ++h)
    if (!is_regular_corner(surface, h)) return false;
  return true;
}

ControlNet control_net(const SurfaceTopology& surface, std::span<const Vec3> points, Index face, int turn) {
  const auto point = [&](Index h) -> const Vec3& { return points[surface.corner_vertices[h]]; };
  std::array<Index, 4> corners;
  std::array<bool, 4> crease;
  for (int k = 0; k < 4; ++k) {
    corners[k] = surface.face_offsets[face] + (turn + k) % 4;
    crease[k] = surface.edge_sharpness[surface.corner_edges[corners[k]]] > 0;
  }
  // beyond[k]: the points across side k, next to its first and to its second corner.
  std::array<std::array<Vec3, 2>, 4> beyond;
  for (int k = 0; k < 4; ++k) {
    const Vec3 &a = point(corners[k]), &b = point(corners[(k + 1) % 4]);
    if (crease[k]) {
      beyond[k] = {2 * a - point(corners[(k + 3) % 4]), 2 * b - point(corners[(k + 2) % 4])};
    } else {
      const Index across = surface.next(surface.next(surface.twins[corners[k]]));
      beyond[k] = {point(across), point(surface.next(across))};
    }
  }
  std::array<Vec3, 4> diagonal;
  for (int k = 0; k < 4; ++k) {
    const int before = (k + 3) % 4;
    if (crease[before])
      diagonal[k] = 2 * beyond[k][0] - beyond[k][1];
    else if (crease[k])
      diagonal[k] = 2 * beyond[before][1] - beyond[before][0];
    else
      diagonal[k] = point(surface.prev(surface.twins[surface.next(surface.twins[corners[k]])]));
  }
  ControlNet net;
  net[0] = {diagonal[0], beyond[0][0], beyond[0][1], diagonal[1]};
  net[1] = {beyond[3][1], point(corners[0]), point(corners[1]), beyond[1][0]};
  net[2] = {beyond[3][0], point(corners[3]), point(corners[2]), beyond[1][1]};
  net[3] = {diagonal[3], beyond[2][1], beyond[2][0], diagonal[2]};
  return net;
}

CubicWeights cubic_weights(double t) {
  const double s = 1 - t;
  return {{s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6},
          {-s * s / 2, (3 * t - 4) * t / 2, (4 - 3 * s) * s / 2, t * t / 2}};
}

}  // namespace subvol::internal

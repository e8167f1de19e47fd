// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <functional>
#include <initializer_list>
#include <vector>

namespace subvol::test {

inline void add_face(PolygonMesh& mesh, std::initializer_list<Index> corners) {
  mesh.face_vertices.insert(mesh.face_vertices.end(), corners);
  mesh.face_offsets.push_back(mesh.face_vertices.size());
}

enum class Faces { triangles, quads, mixed };

/// A grid of nu x nv squares, placed by a function of its lattice points; `closed`: its last column is the first.
inline PolygonMesh grid(int nu, int nv, Faces faces, const std::function<Vec3(double, double)>& place,
                        bool closed = false) {
  PolygonMesh mesh;
  const int columns = closed ? nu : nu + 1;
  for (int j = 0; j <= nv; ++j)
    for (int i = 0; i < columns; ++i) mesh.positions.push_back(place(i, j));
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      const auto at = [&](int di, int dj) { return static_cast<Index>((i + di) % columns + (j + dj) * columns); };
      const Index a = at(0, 0), b = at(1, 0), c = at(1, 1), d = at(0, 1);
      if (faces == Faces::quads || (faces == Faces::mixed && (i + j) % 2)) {
        add_face(mesh, {a, b, c, d});
      } else {
        add_face(mesh, {a, b, c});
        add_face(mesh, {a, c, d});
      }
    }
  return mesh;
}

inline PolygonMesh plane(Faces faces) {
  return grid(6, 4, faces, [](double i, double j) { return Vec3(i / 6, j / 4, 0); });
}

/// Corners of a polyline with `cuts` steps between any two.
inline std::vector<Vec3> profile(const std::vector<Vec3>& corners, int cuts) {
  std::vector<Vec3> points;
  for (std::size_t k = 0; k + 1 < corners.size(); ++k)
    for (int i = 0; i < cuts; ++i) points.push_back(corners[k] + (corners[k + 1] - corners[k]) * (double(i) / cuts));
  points.push_back(corners.back());
  return points;
}

/// A profile drawn out to a length of 1 against z; outward is what it has on its right.
inline PolygonMesh drawn_profile(const std::vector<Vec3>& points, Faces faces) {
  return grid(static_cast<int>(points.size()) - 1, 4, faces,
              [&](double i, double j) { return Vec3(points[static_cast<std::size_t>(i)] + Vec3(0, 0, -j / 4)); });
}

}  // namespace subvol::test

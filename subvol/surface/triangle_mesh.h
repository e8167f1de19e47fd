// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/mesh/face_groups.h"

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// Triangles in space: no connectivity, orientation or closedness is promised (a soup is welcome).
struct TriangleMesh {
  std::vector<Vec3> positions;
  std::vector<std::array<Index, 3>> triangles;
  FaceGroups face_groups{};
};

/// Polygons in space (triangles, quads and more), for surfaces whose faces matter: boundaries, shells, exports.
struct PolygonMesh {
  std::vector<Vec3> positions;
  std::vector<std::size_t> face_offsets{0};
  std::vector<Index> face_vertices;
  FaceGroups face_groups{};

  std::size_t num_faces() const { return face_offsets.size() - 1; }
  std::span<const Index> face(std::size_t f) const {
    return std::span(face_vertices).subspan(face_offsets[f], face_offsets[f + 1] - face_offsets[f]);
  }
};

}  // namespace subvol

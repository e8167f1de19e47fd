// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/cell_orientation.h"

#include "subvol/io/nodal_formats.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

/// Corners of a face in ascending order, and its place in the cell.
struct SeenFace {
  std::array<Index, 4> corners;  ///< the last one of a triangle is kNoIndex
  Index cell;
  bool is_odd;  ///< the sense in which the cell sees them
};

/// A cell on the other side of a face. agrees: both see the face from opposite sides.
struct Neighbor {
  Index cell;
  bool agrees;
};

SeenFace seen_face(const NodalMesh& mesh, std::size_t c, int f) {
  const CellTopology& topology = cell_topology(mesh.kinds[c]);
  const auto size = static_cast<std::size_t>(topology.face_sizes[f]);
  SeenFace face{{kNoIndex, kNoIndex, kNoIndex, kNoIndex}, static_cast<Index>(c), false};
  for (std::size_t i = 0; i < size; ++i) face.corners[i] = mesh.cell(c)[topology.faces[f][i]];
  const auto end = face.corners.begin() + static_cast<std::ptrdiff_t>(size);
  // From the smallest corner on, the sense is that of the corner behind it and the one before it.
  const auto first = std::min_element(face.corners.begin(), end);
  const Index next = first + 1 == end ? face.corners[0] : first[1];
  const Index before = first == face.corners.begin() ? end[-1] : first[-1];
  face.is_odd = next > before;
  std::sort(face.corners.begin(), end);
  return face;
}

std::vector<std::vector<Neighbor>> neighbors_of_cells(const NodalMesh& mesh) {
  std::vector<SeenFace> faces;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (int f = 0; f < cell_topology(mesh.kinds[c]).num_faces; ++f) faces.push_back(seen_face(mesh, c, f));
  std::sort(faces.begin(), faces.end(), [](const SeenFace& a, const SeenFace& b) {
    return std::tie(a.corners, a.cell) < std::tie(b.corners, b.cell);
  });
  std::vector<std::vector<Neighbor>> neighbors(mesh.num_cells());
  for (std::size_t i = 1; i < faces.size(); ++i) {
    const SeenFace &a = faces[i - 1], &b = faces[i];
    if (a.corners != b.corners) continue;
    neighbors[static_cast<std::size_t>(a.cell)].push_back({b.cell, a.is_odd != b.is_odd});
    neighbors[static_cast<std::size_t>(b.cell)].push_back({a.cell, a.is_odd != b.is_odd});
  }
  return neighbors;
}

/// Signed volume of a cell times six, of its faces cut at one corner and seen from its first corner.
double six_volumes(const NodalMesh& mesh, std::size_t c) {
  const CellTopology& topology = cell_topology(mesh.kinds[c]);
  const auto corner = [&](int i) { return mesh.positions[static_cast<std::size_t>(mesh.cell(c)[i])]; };
  const Vec3 apex = corner(0);
  double sum = 0;
  for (int f = 0; f < topology.num_faces; ++f)
    for (int i = 2; i < topology.face_sizes[f]; ++i) {
      const Vec3 a = corner(topology.faces[f][0]) - apex, b = corner(topology.faces[f][i - 1]) - apex,
                 d = corner(topology.faces[f][i]) - apex;
      sum += a.dot(b.cross(d));
    }
  return sum;
}

void mirror_cell(NodalMesh& mesh, std::size_t c) {
  const std::vector<Index> old(mesh.cell(c).begin(), mesh.cell(c).end());
  const std::vector<int> places = mirrored_places(mesh.kinds[c], mesh.orders[c]);
  for (std::size_t i = 0; i < old.size(); ++i)
    mesh.nodes[mesh.offsets[c] + i] = old[static_cast<std::size_t>(places[i])];
}

}  // namespace

std::size_t turn_cells_alike(NodalMesh& mesh) {
  std::vector<double> volumes;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) volumes.push_back(six_volumes(mesh, c));
  if (std::all_of(volumes.begin(), volumes.end(), [](double volume) { return volume >= 0; })) return 0;
  const auto neighbors = neighbors_of_cells(mesh);
  std::vector<int> sign(mesh.num_cells(), 0);  // -1: to be turned; 0: not visited
  std::size_t num_turned = 0;
  for (std::size_t start = 0; start < sign.size(); ++start) {
    if (sign[start] != 0) continue;
    std::vector<std::size_t> part{start};
    sign[start] = 1;
    double volume = 0;
    bool is_possible = true;
    for (std::size_t i = 0; i < part.size(); ++i) {
      const std::size_t c = part[i];
      volume += sign[c] * volumes[c];
      for (const Neighbor& neighbor : neighbors[c]) {
        const auto other = static_cast<std::size_t>(neighbor.cell);
        const int wanted = neighbor.agrees ? sign[c] : -sign[c];
        if (sign[other] == 0) {
          sign[other] = wanted;
          part.push_back(other);
        }
        is_possible = is_possible && sign[other] == wanted;
      }
    }
    if (!is_possible) continue;
    for (const std::size_t c : part)
      if ((sign[c] < 0) != (volume < 0)) mirror_cell(mesh, c), ++num_turned;
  }
  return num_turned;
}

}  // namespace subvol::internal

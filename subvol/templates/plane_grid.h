// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"
#include "subvol/templates/edge_levels.h"

#include <array>
#include <vector>

namespace subvol::internal {

/// Layers of cells on each side of a grid: the outer one stays empty, the inner one leaves room for handles.
inline constexpr int kSpareLayers = 2;

/// A plane that holds triangles of a surface and is perpendicular to an axis of a frame.
struct AxisPlane {
  double position = 0;           ///< along the axis, length
  std::array<double, 2> area{};  ///< of its triangles that face down, and up, along the axis
  std::vector<Index> triangles;  ///< their numbers

  double whole_area() const { return area[0] + area[1]; }
};

/// The planar parts of a surface along the axes of a frame, and the surface's extent there.
struct AxisPlanes {
  Mat3 frame = Mat3::Identity();                 ///< columns: unit axes, right-handed
  std::array<std::vector<AxisPlane>, 3> planes;  ///< for each axis, by increasing position
  std::array<std::vector<EdgeLevel>, 3> levels;  ///< (`edge_levels`); none: edges get no lines of their own
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  ///< corners of the bounding box, in the frame's coordinates
  double area = 0;                               ///< of the whole surface
  double tolerance = 0;                          ///< length; triangles whose positions differ by less are coplanar
};

/// Returns the frame for a grid through the surface's planes: of those that `template_frames` returns, and of the same
/// ones turned onto the planes closest to them, the frame with the most area whose normal is along an axis. Area counts
/// less the farther its normal is from the axis, so that planes win over the facets of curved parts.
///
///   area(frame) = sum over triangles of A max(0, 1 - s / s0),  s = sine of the normal's angle to the closest axis,
///                                                             s0 = sqrt(1 - kAlongAxis^2)
///
/// surface  at least one triangle has an area. Cost: as `template_frames`.
Mat3 frame_along_planes(const TriangleMesh& surface);

/// Collects the planes along the axes of a frame.
///
/// Triangles count as one plane if their centers' positions along the axis differ by less than 1e-5 of the bounding
/// box's diagonal; the position of the plane is their median by area.
/// frame  columns: unit axes. Cost: a sort of the triangles.
AxisPlanes axis_planes(const TriangleMesh& surface, const Mat3& frame);

/// Chooses the lines of a grid with cells of about a given size that pass through the planes.
///
/// Planes with an area of more than size^2 / 2 are taken along each axis, the largest first, if they are at least
/// 0.4 size from those already taken. Two planes may be closer if they bound a thin wall or a thin gap: they look away
/// from each other, or at each other, and at least size^2 / 2 of the one faces the other. Planes that bound a stack of
/// such walls and gaps are taken together if all fit. Ends of the bounding box are taken likewise, after the planes.
///
/// Levels of edges are taken last (`add_lines_at_levels`).
///
/// Then each space between two lines is cut into equal parts, round(width / size) of them, at least one.
///
/// size     length, > 0; at least about sqrt(area / cells) / 2 if so many cells are wanted: cost and memory grow with
///          area / size^2.
/// most     largest number of cells, with the spare layers; below 10^8.
/// returns  for each axis the positions of at least two lines along it, increasing; empty for all axes if there would
///          be more cells.
std::array<std::vector<double>, 3> lines_through_planes(const TriangleMesh& surface, const AxisPlanes& planes,
                                                        double size, double most);

/// Adds the spare layers around the lines of a grid, `size` wide.
std::array<std::vector<double>, 3> with_spare_layers(std::array<std::vector<double>, 3> lines, double size);

/// Returns the share of the surface's area that lies on planes through the lines, in [0, 1].
double share_on_lines(const AxisPlanes& planes, const std::array<std::vector<double>, 3>& lines);

}  // namespace subvol::internal

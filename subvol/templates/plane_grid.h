// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"
#include "subvol/templates/voxel_grid.h"

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

/// Sharp edges of a surface at one position along an axis of a frame, perpendicular to it, and points at which curves
/// of sharp edges come no farther along the axis, such as those of a hole's rim that are closest to a wall.
struct EdgeLevel {
  double position = 0;                        ///< along the axis, length
  double length = 0;                          ///< of all segments
  std::vector<std::array<Vec3, 2>> segments;  ///< in the frame's coordinates
  std::vector<Vec3> turns;                    ///< likewise
};

/// The planar parts of a surface along the axes of a frame, and the surface's extent there.
struct AxisPlanes {
  Mat3 frame = Mat3::Identity();                 ///< columns: unit axes, right-handed
  std::array<std::vector<AxisPlane>, 3> planes;  ///< for each axis, by increasing position
  std::array<std::vector<EdgeLevel>, 3> levels;  ///< likewise; none: edges get no lines of their own
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  ///< corners of the bounding box, in the frame's coordinates
  double area = 0;                               ///< of the whole surface
  double tolerance = 0;                          ///< length; triangles whose positions differ by less are coplanar
};

/// Cosine between an axis and a triangle's normal above which the triangle counts as perpendicular to the axis: 1.1
/// degrees.
inline constexpr double kAlongAxis = 0.9998;

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

/// Adds the levels of sharp edges, at which the surface bends by more than 40 degrees, to planes of the same surface.
/// Edges and turns count as one level if their middles differ by less than the planes' tolerance along the axis.
void add_edge_levels(const TriangleMesh& surface, AxisPlanes& planes);

/// Chooses the lines of a grid with cells of about a given size that pass through the planes.
///
/// Planes with an area of more than size^2 / 2 are taken along each axis, the largest first, if they are at least
/// 0.4 size from those already taken. Two planes may be closer if they bound a thin wall or a thin gap: they look away
/// from each other, or at each other, and at least size^2 / 2 of the one faces the other. Planes that bound a stack of
/// such walls and gaps are taken together if all fit. Ends of the bounding box are taken likewise, after the planes.
///
/// Levels of edges are taken last, the longest first, if they are closer than that to one of these lines, but by at
/// least 1/12 size: a chamfer, a ledge or a thin wall, which a cell cannot hold, then lies between two lines. Their
/// edges must run along others on that line, closer than 0.6 size, for a quarter of the bounding box's diagonal and for
/// 4 size at least; or a curve must turn that close to edges on that line that are so long in all.
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

/// Empties the cells of a grid that are thinner than lines usually are along two axes and neither nearly full nor
/// nearly empty: a chamfer cuts them along their diagonals. Whether half a cell is filled would differ from one to the
/// next. grid  with spare layers (`with_spare_layers`).  fractions  share of each cell that lies in the solid.
void empty_cells_at_chamfers(const VoxelGrid& grid, std::vector<double>& fractions);

/// Returns the share of the surface's area that lies on planes through the lines, in [0, 1].
double share_on_lines(const AxisPlanes& planes, const std::array<std::vector<double>, 3>& lines);

}  // namespace subvol::internal

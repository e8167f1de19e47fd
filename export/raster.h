// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/export/color_map.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace subvol {

/// Rows from the top, four bytes per pixel: sRGB and coverage (0 if nothing is seen); colors are not multiplied by
/// coverage.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
};

/// A parallel projection that shows a ball.
struct RasterView {
  Vec3 towards_viewer = Vec3(0, 0, 1);  ///< any length but zero
  Vec3 up = Vec3(0, 1, 0);              ///< not parallel to towards_viewer
  Vec3 center = Vec3::Zero();
  double radius = 1;  ///< > 0, of the ball that fits into the picture's shorter side
};

/// Returns a view that shows a mesh well: perpendicular to its bounding box's longest sides, from slightly above and
/// beside.
/// A mesh without extent is shown with radius 1.
RasterView view_of(std::span<const Vec3> positions);

/// The surface to draw. Both sides of triangles are visible and lit from the viewer's side.
struct RasterSurface {
  TriangleMesh mesh;
  std::vector<LinearColor> colors;          ///< one per vertex, or empty: gray
  std::vector<std::array<Index, 2>> wires;  ///< edges to draw as dark lines where they are visible
};

/// Draws a surface with a depth buffer and 2 x 2 samples per pixel.
///
/// width, height  1 .. 8192. The same bits for any number of threads. Triangles that have no area or are not finite are
///                skipped.
/// InputError: sizes out of range, a view without direction, a number of colors other than that of the vertices.
/// Cost: linear in the triangles, plus a few nanoseconds for every sample that they cover.
Image rasterize(const RasterSurface& surface, const RasterView& view, int width, int height);

}  // namespace subvol

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/color_map.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace subvol {

/// Rows from the top, four bytes a pixel: sRGB and coverage (0 where nothing is seen), colours not multiplied by it.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
};

/// A parallel projection that shows a ball.
struct RasterView {
  Vec3 towards_viewer = Vec3(0, 0, 1);  ///< any length but zero
  Vec3 up = Vec3(0, 1, 0);              ///< not parallel to it
  Vec3 centre = Vec3::Zero();
  double radius = 1;                    ///< > 0, of the ball that fits into the picture's shorter side
};

/// A view that shows a mesh well: across its bounding box's longest sides, from a little above and beside.
/// A mesh without extent is shown with radius 1.
RasterView view_of(std::span<const Vec3> positions);

/// What is drawn. Both sides of triangles are shown, lit from the viewer's side.
struct RasterSurface {
  TriangleMesh mesh;
  std::vector<LinearColor> colors;               ///< one per vertex, or empty: grey
  std::vector<std::array<Index, 2>> wires;       ///< edges to draw as dark lines where they are in sight
};

/// Draws a surface with a depth buffer, 2 x 2 samples a pixel.
///
/// width, height  1 .. 8192. Same bits for any number of threads. Triangles without area or not finite are left out.
/// InputError: sizes out of range, a view without direction, colours of another number than the vertices.
/// Cost: triangles, plus a few nanoseconds for every sample they cover.
Image rasterize(const RasterSurface& surface, const RasterView& view, int width, int height);

}  // namespace subvol

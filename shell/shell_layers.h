// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/elements/cell_reference.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/surface_topology.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// How the layers of a shell are numbered.
///
/// A *column* is a surface vertex with its copies, a *strand* the part of a column on one side of the surface, a
/// *sheet* a copy of the whole surface. Sheets are numbered from the innermost outward; sheet `inside` is the surface
/// itself.
///
///        sheet 3  ---o-----o---   outermost        inside = 1, outside = 2
///                    | cell|                       vertex = sheet * num_columns + surface vertex
///        sheet 2  ---o-----o---                    cell   = layer * num_faces + face, layer k between sheets k, k + 1
///                    |     |                       a triangle makes prisms, a quad hexes
///        sheet 1  ===o=====o===   the surface
///                    |     |
///        sheet 0  ---o-----o---   innermost
///                   column
///
/// Thicknesses are arrays of one number per strand: [inside, by column][outside, by column].
struct ShellLayers {
  PolygonMesh surface;             ///< triangles and quads, each vertex used
  SurfaceTopology topology;        ///< of the surface
  int inside = 0, outside = 0;     ///< layers on either side of the surface; at least one in all
  /// Share of a side's thickness that lies within its first k layers, counted from the surface: 0 .. 1.
  std::vector<double> inside_shares, outside_shares;

  std::size_t num_columns() const { return surface.positions.size(); }
  int num_sheets() const { return inside + outside + 1; }
  Index vertex(int sheet, Index column) const { return static_cast<Index>(sheet * num_columns() + column); }
  std::size_t num_strands() const { return 2 * num_columns(); }
  /// Strand of a vertex, or kNoIndex for one of the surface itself.
  Index strand(Index vertex) const {
    const int sheet = static_cast<int>(vertex / num_columns());
    const auto column = static_cast<Index>(vertex % num_columns());
    if (sheet == inside) return kNoIndex;
    return sheet < inside ? column : static_cast<Index>(num_columns() + column);
  }
  /// Signed height of a sheet for a thickness of 1: -1 innermost, 0 the surface, 1 outermost.
  double height(int sheet) const {
    return sheet >= inside ? outside_shares[sheet - inside] : -inside_shares[inside - sheet];
  }
};

/// Shares of layers that grow away from the surface: layer k is `growth` times as thick as layer k - 1.
/// num_layers >= 0, growth > 0, a sum that is finite, else InputError. Returns num_layers + 1 numbers from 0 to 1.
std::vector<double> layer_shares(int num_layers, double growth);

/// Pairs the surface's edges and checks what a shell needs of it.
///
/// InputError: no faces; more cells than can be numbered; vertices out of range, not finite, named twice by a face or
/// by none; a face of more than four corners; an edge of more than two faces, or of two that run the same way along it;
/// a vertex whose faces form more than one fan; a face without area.
ShellLayers make_layers(PolygonMesh surface, int inside, int outside, double growth);

/// The cells with all sheets in the place of the surface. References number the layers from the innermost, from 1.
VolumeMesh stack_cells(const ShellLayers& layers);

/// Creases and corners of a surface by one angle, as `features_by_angle` finds them; its border has none.
FeatureTags surface_features(const PolygonMesh& surface, double angle_degrees);

/// Tags of the shell's boundary: those of the surface on both outer sheets, and the border's edges as creases there.
/// tags  creases along edges of the surface and corners at its vertices, else InputError.
FeatureTags shell_tags(const ShellLayers& layers, const FeatureTags& tags);

/// Positions of straight columns: surface vertex plus height of the sheet times thickness of its side along
/// `directions`.
/// thickness  per strand, in the surface's unit. Returns one position per vertex.
std::vector<Vec3> straight_columns(const ShellLayers& layers, std::span<const Vec3> directions,
                                   std::span<const double> thickness);

/// What cells should look like: the face they stand on, as thick as their layer (paper: section 4.4).
///
///   A(u, v) = [X_u, X_v, (s_k+1 - s_k) t(u, v) N/|N|],  N = X_u x X_v
///
/// X: the triangle or bilinear quad; t: thickness of the side, interpolated from the face's corners; s_k: height of
/// sheet k. The layers must outlive the result. thickness: per strand, > 0 where there are layers.
CellReference shell_reference(const ShellLayers& layers, std::vector<double> thickness);

/// One sheet of the cells as a surface like the one they stand on.
PolygonMesh sheet_surface(const ShellLayers& layers, const VolumeMesh& cells, int sheet);

/// Polygons of the given sheets and of the walls along the surface's border, over the shell's vertices.
/// Sheet by sheet in the surface's order, then the walls, layer by layer for each border edge. Positions are left
/// empty.
PolygonMesh sheet_polygons(const ShellLayers& layers, std::span<const int> sheets);

}  // namespace subvol

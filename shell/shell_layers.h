// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/cell_reference.h"
#include "subvol/fit/mending/surface_faults.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/shell/border_planes.h"
#include "subvol/surface/surface_topology.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// The numbering of a shell's layers.
///
/// A *column* is a surface vertex with its copies, a *strand* is the part of a column on one side of the surface, and a
/// *sheet* is a copy of the whole surface. Sheets are numbered from the innermost outward; sheet `inside` is the
/// surface itself.
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
  PolygonMesh surface;          ///< triangles and quads; every vertex is used
  SurfaceTopology topology;     ///< of the surface
  int inside = 0, outside = 0;  ///< number of layers on each side of the surface; at least one in total
  /// Share of a side's thickness that its first k layers occupy, counted from the surface: 0 .. 1.
  std::vector<double> inside_shares, outside_shares;
  ColumnPlanes planes;  ///< those in which columns on the border stay; none unless they are set

  std::size_t num_columns() const { return surface.positions.size(); }
  int num_sheets() const { return inside + outside + 1; }
  Index vertex(int sheet, Index column) const { return static_cast<Index>(sheet * num_columns() + column); }
  std::size_t num_strands() const { return 2 * num_columns(); }
  /// Returns the strand of a vertex, or kNoIndex for a vertex of the surface itself.
  Index strand(Index vertex) const {
    const int sheet = static_cast<int>(vertex / num_columns());
    const auto column = static_cast<Index>(vertex % num_columns());
    if (sheet == inside) return kNoIndex;
    return sheet < inside ? column : static_cast<Index>(num_columns() + column);
  }
  /// Returns the signed height of a sheet for thickness 1: -1 for the innermost, 0 for the surface, 1 for the
  /// outermost.
  double height(int sheet) const {
    return sheet >= inside ? outside_shares[sheet - inside] : -inside_shares[inside - sheet];
  }
};

/// Returns the shares of layers that grow away from the surface: layer k is `growth` times as thick as layer k - 1.
/// num_layers  >= 0, and growth > 0 with a finite sum, else InputError.
/// returns     num_layers + 1 numbers from 0 to 1.
std::vector<double> layer_shares(int num_layers, double growth);

/// Returns the growth for which layers of a given first height have a given thickness together:
///
///   thickness = first_height (1 + g + ... + g^(num_layers - 1))
///
/// InputError: lengths that are not positive, num_layers < 1, or no such growth from 1/100 to 100.
double growth_of_layers(double thickness, double first_height, int num_layers);

/// Returns the number of layers, from 1, whose thickness comes closest to the given one if each is `growth` times as
/// thick as the one before. InputError: as above, or growth < 1 and a thickness that no number of layers reaches.
int number_of_layers(double thickness, double first_height, double growth);

/// Refuses layers that vanish beside the surface: the thinnest must have at least 1e-13 of the surface's largest
/// coordinate, since coordinates are rounded to 2e-16 of it.
/// owner      name of the function that makes the layers, for the message.
/// thickness  of all layers together, > 0.
/// InputError: a thinner layer, or as `layer_shares`.
void require_visible_layers(const char* owner, const PolygonMesh& surface, double thickness, int num_layers,
                            double growth);

/// Pairs the surface's edges and checks the requirements of a shell.
///
/// names  numbers for messages; those of faces and vertices are followed by coordinates.
/// InputError: no faces; more cells than can be numbered; vertices that are out of range, not finite, repeated in a
/// face or in no face; a face that is neither a triangle nor a quad; an edge with more than two faces, or with two that
/// run along it in the same direction; a vertex whose faces form more than one fan; a face without area.
ShellLayers make_layers(PolygonMesh surface, int inside, int outside, double growth, const SurfaceNames& names = {});

/// Returns the cells, with all sheets at the position of the surface. References number the layers, from 1 for the
/// innermost.
VolumeMesh stack_cells(const ShellLayers& layers);

/// Returns the creases and corners of a surface that `features_by_angle` finds with this angle; its border has none.
FeatureTags surface_features(const PolygonMesh& surface, double angle_degrees);

/// Returns the tags of the shell's boundary: those of the surface on both outer sheets, and creases along the border
/// there.
///
/// tags  creases along edges of the surface and corners at its vertices, else InputError.
FeatureTags shell_tags(const ShellLayers& layers, const FeatureTags& tags);

/// Returns the positions of straight columns: surface vertex + height of the sheet * thickness of its side * direction.
///
/// thickness  per strand, in the surface's unit.
/// returns    one position per vertex.
std::vector<Vec3> straight_columns(const ShellLayers& layers, std::span<const Vec3> directions,
                                   std::span<const double> thickness);

/// Returns the ideal shape of the cells: the face that a cell stands on, as thick as its layer (paper: section 4.4).
///
///   A(u, v) = [X_u, X_v, (s_k+1 - s_k) t(u, v) N/|N|],  N = X_u x X_v
///
/// X is the triangle or bilinear quad, t the thickness of the side, interpolated from the face's corners, and s_k the
/// height of sheet k.
///
/// layers     must outlive the result.
/// thickness  per strand, > 0 on sides with layers.
CellReference shell_reference(const ShellLayers& layers, std::vector<double> thickness);

/// Returns the groups of the shell's faces: those of the surface's faces on its own sheet; "wall" for its faces without
/// one; "inner" and "outer" for the innermost and the outermost sheet, if they are not the surface; "rim" for the faces
/// along its border. If the surface uses one of these names, "shell " stands before it, and a number behind it if that
/// is in use, too.
///
/// The surface's own sheet is inside the mesh if there are layers on both sides.
VolumeFaceGroups shell_groups(const ShellLayers& layers);

/// Returns one sheet of the cells as a surface with the original surface's faces.
PolygonMesh sheet_surface(const ShellLayers& layers, const VolumeMesh& cells, int sheet);

/// Returns the polygons of the given sheets and of the walls along the surface's border, over the shell's vertices:
/// sheet by sheet in the surface's order, then the walls, layer by layer for each border edge. Positions are left
/// empty.
PolygonMesh sheet_polygons(const ShellLayers& layers, std::span<const int> sheets);

}  // namespace subvol

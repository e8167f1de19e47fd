// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/high_order_patches.h"
#include "export/scene.h"
#include "export/tessellate.h"
#include "fit/geometry/curved_boundary.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// What a scene of a surface says of itself, and how fine it is.
struct SurfaceSceneOptions {
  std::string name = "subvol";          ///< of the root node
  /// Chord error of a curved surface, per cent of its bounding box's diagonal, > 0.
  double max_chord_percent = 0.005;
  double crease_angle_degrees = 30;     ///< faces that meet at more are not shaded smoothly, [0, 180]
  bool wireframe = true;                ///< a second node with the cells' edges as lines
  bool quantize = false;                ///< a smaller file: `Scene::quantize`
  double metres_per_unit = 1;           ///< > 0
  UpAxis up_axis = UpAxis::y;
  std::string source{};                 ///< file the result was made from; goes into the extras
  SceneValues options{};                ///< options in force; go into the extras
};

/// The limit surface of a control cage, coloured by the quality of the cells below it.
///
/// Nodes: "surface" (normals, COLOR_0 by `quality_color`, _SCALED_JACOBIAN, quads as consecutive pairs of triangles)
/// and "wireframe" (the cage's boundary edges as curves). A vertex has the least quality of the patches around it.
///
/// finest   the cage refined k >= 0 times (so cells follow by parent, then corner), whose cells give the quality: a
///          patch has the minimum over the descendants of its child cell. Null: the cage's own cells.
/// InputError: a finest mesh whose number of cells fits no k; options out of range; what `tessellate` refuses.
Scene surface_scene(const VolumeMesh& cage, const VolumeMesh* finest = nullptr,
                    const SurfaceSceneOptions& options = {});

/// The same from parts made before. patch_quality: one scaled Jacobian per patch, or empty (no colours then).
Scene surface_scene(const TessellatedSurface& surface, std::span<const double> patch_quality,
                    const SurfaceSceneOptions& options);

/// Least scaled Jacobian below every patch of a tessellated cage, from those of the cells of `finest`.
std::vector<double> patch_quality(const VolumeMesh& cage, const TessellatedSurface& surface,
                                  std::span<const double> finest_cell_minima);

/// `max_chord_percent` of the diagonal of the limit surface's bounding box (of its vertices), as a length.
double chord_length(const VolumeMesh& cage, const SurfaceSceneOptions& options);
double chord_length(const HighOrderPatches& patches, const SurfaceSceneOptions& options);

/// The curved boundary of a high-order mesh, coloured by the quality of its cells, each boundary edge as a curve.
///
/// Nodes, colours and attributes as for a limit surface. Normals are those of the map, and part where faces meet at
/// more than `crease_angle_degrees`; elsewhere they are means.
/// cell_minima  one scaled Jacobian per cell, or empty (no colours then).
/// InputError: options out of range, minima of another number, what `HighOrderPatches` refuses.
Scene surface_scene(const HighOrderMesh& mesh, std::span<const double> cell_minima,
                    const SurfaceSceneOptions& options = {});

/// The curved boundary as triangles within `max_chord_percent` of its box's diagonal, for measurements. InputError: as
/// above.
CurvedBoundary curved_boundary(const HighOrderMesh& mesh, double max_chord_percent);

/// The boundary of a volume mesh as it stands, flat faces, coloured by the quality of the boundary cells.
Scene boundary_scene(const VolumeMesh& mesh, const SurfaceSceneOptions& options = {});

/// A surface that is drawn as a node of its own.
struct SceneSheet {
  std::string name;
  PolygonMesh mesh;
  SceneAttribute attribute{};     ///< one value per vertex; without a name: none
  std::vector<double> shades{};   ///< per vertex, coloured as `quality_color` colours 0 .. 1; empty: no colours
  std::vector<std::array<Index, 2>> wires{};  ///< edges to draw, by vertex; empty: those of all polygons
};

/// Several sheets as they stand, flat faces, and one "wireframe" with the edges of all. `colour_map` names what the
/// shades show. InputError: no sheets, arrays of another length than the vertices.
Scene sheet_scene(std::span<const SceneSheet> sheets, const std::string& colour_map,
                  const SurfaceSceneOptions& options = {});

/// Polygons as they stand. face_quality: one scaled Jacobian per face, or empty (no colours then).
Scene polygon_scene(const PolygonMesh& mesh, std::span<const double> face_quality = {},
                    const SurfaceSceneOptions& options = {});

}  // namespace subvol

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/export/high_order_patches.h"
#include "subvol/export/scene.h"
#include "subvol/export/tessellate.h"
#include "subvol/fit/geometry/curved_boundary.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// Metadata, appearance and resolution of the scene of a surface.
struct SurfaceSceneOptions {
  std::string name = "subvol";  ///< name of the root node
  /// Chord error of a curved surface, in percent of its bounding box's diagonal, > 0.
  double max_chord_percent = 0.005;
  double crease_angle_degrees = 30;  ///< faces that meet at a larger angle are not shaded smoothly, in [0, 180]
  bool wireframe = true;             ///< adds a node with the cells' edges as lines
  bool quantize = false;             ///< writes a smaller file: `Scene::quantize`
  double meters_per_unit = 1;        ///< > 0
  UpAxis up_axis = UpAxis::y;
  std::string source{};   ///< file that the result was made from; stored in the extras
  SceneValues options{};  ///< options in force; stored in the extras
  /// Groups of the boundary faces, in the order of `MeshTopology::boundary_faces()`: each becomes a part of the
  /// surface. Scenes of polygons take those of the polygons in place of these.
  FaceGroups face_groups{};
};

/// Returns a scene of the limit surface of a control cage, colored by the quality of the cells below it.
///
/// Nodes: "surface" (normals, COLOR_0 by `quality_color`, _SCALED_JACOBIAN, quads as consecutive pairs of triangles)
/// and "wireframe" (the cage's boundary edges as curves). A vertex has the least quality of the patches around it.
///
/// finest   the cage refined k >= 0 times (so that cells are ordered by parent, then corner), whose cells give the
///          quality: a patch has the minimum over the descendants of its child cell. Null: the cage's own cells.
/// InputError: a finest mesh whose number of cells fits no k; options out of range; a cage that `tessellate` refuses.
Scene surface_scene(const VolumeMesh& cage, const VolumeMesh* finest = nullptr,
                    const SurfaceSceneOptions& options = {});

/// Makes the same scene from an existing tessellation. patch_quality: one scaled Jacobian per patch, or empty (no
/// colors then).
Scene surface_scene(const TessellatedSurface& surface, std::span<const double> patch_quality,
                    const SurfaceSceneOptions& options);

/// Returns the least scaled Jacobian below every patch of a tessellated cage, given those of the cells of `finest`.
std::vector<double> patch_quality(const VolumeMesh& cage, const TessellatedSurface& surface,
                                  std::span<const double> finest_cell_minima);

/// Returns `max_chord_percent` of the diagonal of the limit surface's bounding box, as a length. For a cage the box is
/// that of its vertices' limit points.
double chord_length(const VolumeMesh& cage, const SurfaceSceneOptions& options);
double chord_length(const HighOrderPatches& patches, const SurfaceSceneOptions& options);

/// Returns a scene of the curved boundary of a high-order mesh, colored by the quality of its cells, with each boundary
/// edge as a curve.
///
/// Nodes, colors and attributes are as for a limit surface. Normals are those of the map, averaged at each vertex
/// except where faces meet at more than `crease_angle_degrees`.
/// cell_minima  one scaled Jacobian per cell, or empty (no colors then).
/// InputError: options out of range, a wrong number of minima, a mesh that `HighOrderPatches` refuses.
Scene surface_scene(const HighOrderMesh& mesh, std::span<const double> cell_minima,
                    const SurfaceSceneOptions& options = {});

/// Returns the curved boundary as triangles within `max_chord_percent` of its box's diagonal, for measurements.
/// InputError: as above.
CurvedBoundary curved_boundary(const HighOrderMesh& mesh, double max_chord_percent);

/// Returns a scene of the boundary of a volume mesh with its flat faces, colored by the quality of the boundary cells.
/// InputError: no cells; options out of range.
Scene boundary_scene(const VolumeMesh& mesh, const SurfaceSceneOptions& options = {});

/// A surface that is drawn as a separate node.
struct SceneSheet {
  std::string name;
  PolygonMesh mesh;
  SceneAttribute attribute{};    ///< one value per vertex; without a name: none
  std::vector<double> shades{};  ///< one per vertex, colored as `quality_color` colors 0 .. 1; empty: no colors
  std::vector<std::array<Index, 2>> wires{};  ///< edges to draw, by vertex; empty: the edges of all polygons
};

/// Returns a scene of several sheets with their flat faces, and one "wireframe" with the edges of all. `color_map`
/// names what the shades show. InputError: no sheets, arrays whose length is not the number of vertices.
Scene sheet_scene(std::span<const SceneSheet> sheets, const std::string& color_map,
                  const SurfaceSceneOptions& options = {});

/// Returns a scene of polygons as they are.
///
/// face_quality  one scaled Jacobian per face, or empty (no colors then). InputError: another number of them.
Scene polygon_scene(const PolygonMesh& mesh, std::span<const double> face_quality = {},
                    const SurfaceSceneOptions& options = {});

}  // namespace subvol

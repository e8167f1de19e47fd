// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/feature_tags.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <optional>

namespace subvol {

/// Options of `extrude`.
struct ExtrudeOptions {
  double thickness = 0;  ///< length of the columns, in the surface's unit, > 0
  int layers = 1;        ///< >= 1
  double growth = 1;     ///< ratio of each layer's thickness to that of the layer below, > 0
  /// Direction of all columns, of any length; empty: along the surface's normals (`visible_normals`).
  std::optional<Vec3> direction;
  FeatureTags tags;  ///< tags of the surface, repeated on both ends
};

/// Stacks layers of cells on a surface in straight columns: hexes on quads, prisms on triangles. This is for templates;
/// `make_shell` grows layers that avoid each other and consist of good cells.
///
/// returns  the cells layer by layer; references number the layers from 1. The boundary consists of the surface with
///          reversed orientation, the top, and walls along the surface's border, whose edges become creases. If the
///          surface has groups, its faces keep them, and the top and the walls get groups as a shell's
///          (`shell_groups`).
/// InputError: options out of range; layers that vanish beside the surface; whatever `make_layers` rejects; without a
/// direction, a vertex from which no direction sees the front of all adjacent faces; an inverted cell in the result,
/// for example because faces look away from the direction.
VolumeMesh extrude(const PolygonMesh& surface, const ExtrudeOptions& options);

}  // namespace subvol

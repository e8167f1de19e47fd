// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/feature_tags.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <optional>

namespace subvol {

struct ExtrudeOptions {
  double thickness = 0;            ///< length of the columns, in the surface's unit, > 0
  int layers = 1;                  ///< >= 1
  double growth = 1;               ///< thickness of a layer against that of the one below it, > 0
  std::optional<Vec3>
      direction;  ///< of all columns, any length; empty: along the surface's normals (`visible_normals`)
  FeatureTags tags;                ///< of the surface; repeated on both ends
};

/// Stacks layers of cells on a surface: hexes on quads, prisms on triangles, in straight columns. For templates; layers
/// that avoid each other and make good cells are grown by `make_shell`.
///
/// returns  layer by layer, references numbering them from 1. Its boundary is the surface turned over, the top, and
///          walls along the border, whose edges become creases.
/// InputError: options out of range; what `make_layers` refuses; a vertex from which no direction sees all faces around
/// from their front; a result with an inverted cell, as where faces look away from the direction.
VolumeMesh extrude(const PolygonMesh& surface, const ExtrudeOptions& options);

}  // namespace subvol

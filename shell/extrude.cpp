// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/shell/extrude.h"

#include "subvol/base/error.h"
#include "subvol/fit/mending/visible_normals.h"
#include "subvol/mesh/validate.h"
#include "subvol/shell/shell_layers.h"

#include <cmath>
#include <string>
#include <vector>

namespace subvol {

using namespace internal;

VolumeMesh extrude(const PolygonMesh& surface, const ExtrudeOptions& options) {
  if (!(options.thickness > 0) || !std::isfinite(options.thickness))
    throw InputError("extrude: the thickness must be finite and above 0");
  if (options.layers < 1) throw InputError("extrude: there must be at least one layer");
  const ShellLayers layers = make_layers(surface, 0, options.layers, options.growth);
  require_visible_layers("extrude", surface, options.thickness, options.layers, options.growth);
  std::vector<Vec3> directions;
  if (options.direction) {
    const double length = options.direction->norm();
    if (!(length > 0) || !std::isfinite(length)) throw InputError("extrude: the direction must be finite and not 0");
    directions.assign(layers.num_columns(), *options.direction / length);
  } else {
    VisibleNormals normals = visible_normals(layers.surface);
    if (!normals.hidden.empty())
      throw InputError("extrude: from vertex " + std::to_string(normals.hidden.front()) +
                       " no direction sees all faces around from their front");
    directions = std::move(normals.directions);
  }
  VolumeMesh mesh = stack_cells(layers);
  mesh.tags = shell_tags(layers, options.tags);
  mesh.positions = straight_columns(layers, directions, std::vector<double>(layers.num_strands(), options.thickness));
  if (!surface.face_groups.empty()) mesh.face_groups = shell_groups(layers);
  require_valid(mesh, "extrude");
  return mesh;
}

}  // namespace subvol

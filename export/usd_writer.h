// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene.h"
#include "subvol/mesh/feature_tags.h"
#include "subvol/surface/triangle_mesh.h"

#include <filesystem>
#include <string>

namespace subvol {

/// What stands in the head of a .usda file.
struct UsdOptions {
  std::string name = "cage";   ///< of the prim: letters, digits, underscore; no digit first
  double metres_per_unit = 1;  ///< > 0
  UpAxis up_axis = UpAxis::y;  ///< declared, not applied: coordinates are written as they are
};

/// A control cage as USD text: one Mesh with subdivisionScheme "catmullClark", whose limit surface is the fitted one.
///
/// tags     creases and corners by the vertex numbers of `cage`; a chain of edges of one sharpness becomes one entry
///          of creaseLengths, ended at every vertex where other than two such edges meet. Sharpnesses at or above
///          kInfiniteSharpness are written as 10, which USD takes as infinite too.
/// returns  points, faceVertexCounts, faceVertexIndices, crease* and corner* arrays, interpolateBoundary
///          "edgeAndCorner", triangleSubdivisionRule "catmullClark", orientation "rightHanded", extent; metersPerUnit,
///          upAxis and defaultPrim for the stage. Points are single precision in USD's schema; the digits of the double
///          are written all the same. Of a cage that is far from the origin they are relative to its middle, where an
///          xformOp:translate puts them.
///
/// InputError: a mesh without faces or with indices out of range or coordinates that are not finite, or such as are
/// written not in the range of float32; a tag that names no vertex or no edge of the cage, or has a sharpness that is not
/// positive; a name that is no USD identifier; metres_per_unit not positive.
std::string usd_text(const PolygonMesh& cage, const FeatureTags& tags, const UsdOptions& options = {});

/// Writes `usd_text` to a .usda file, all of it or nothing. InputError: another extension. IoError: the file cannot be
/// written.
void write_usd(const std::filesystem::path& path, const PolygonMesh& cage, const FeatureTags& tags,
               const UsdOptions& options = {});

}  // namespace subvol

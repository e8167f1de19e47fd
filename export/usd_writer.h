// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/export/scene.h"
#include "subvol/mesh/feature_tags.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <filesystem>
#include <string>

namespace subvol {

/// Entries for the head of a .usda file.
struct UsdOptions {
  std::string name = "cage";         ///< name of the prim: letters, digits, underscores; no digit first
  double meters_per_unit = 1;        ///< > 0
  UpAxis up_axis = UpAxis::y;        ///< declared, not applied: coordinates are written unchanged
  const VolumeMesh* tets = nullptr;  ///< cells, all tets, to write as a TetMesh "cells" beside the cage; null: none
};

/// Returns true if all cells are tets, and there are some.
bool consists_of_tets(const VolumeMesh& mesh);

/// Returns a control cage as USD text: one Mesh with subdivisionScheme "catmullClark", whose limit surface is the
/// fitted one.
///
/// tags     creases and corners by the vertex numbers of `cage`; a chain of edges with one sharpness becomes one entry
///          of creaseLengths and ends at every vertex at which the number of such edges is not two. Sharpnesses at or
///          above kInfiniteSharpness are written as 10, which is infinite in USD too.
/// returns  points, faceVertexCounts, faceVertexIndices, crease* and corner* arrays, interpolateBoundary
///          "edgeAndCorner", triangleSubdivisionRule "catmullClark", orientation "rightHanded", extent; metersPerUnit,
///          upAxis and defaultPrim for the stage. USD's schema has points in single precision; the digits of the double
///          are written all the same. The points of a cage that is far from the origin are relative to its center, and
///          an xformOp:translate moves them there.
///
/// tets     the TetMesh has points, tetVertexIndices and surfaceFaceVertexIndices, orientation "rightHanded".
///
/// InputError: cells other than tets; a mesh without faces, with indices out of range or with coordinates that are not
/// finite; coordinates that, as written, exceed the range of float32; a tag that names no vertex or no edge of the
/// cage, or has a sharpness that is not positive; a name that is not a USD identifier; meters_per_unit not positive.
std::string usd_text(const PolygonMesh& cage, const FeatureTags& tags, const UsdOptions& options = {});

/// Writes `usd_text` to a .usda file, the whole text or nothing. InputError: another extension. IoError: the file
/// cannot be written.
void write_usd(const std::filesystem::path& path, const PolygonMesh& cage, const FeatureTags& tags,
               const UsdOptions& options = {});

}  // namespace subvol

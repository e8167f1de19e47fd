// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/target/surface_diagnosis.h"
#include "subvol/surface/triangle_mesh.h"

#include <optional>
#include <string>
#include <vector>

namespace subvol::internal {

/// A surface after repairs that change neither its shape nor the places of its vertices.
struct TidySurface {
  TriangleMesh surface;
  std::vector<std::string> done;  ///< a sentence for each repair, at least one
};

/// Makes the repairs that a diagnosis asks for and that change no shape:
///
/// - Of triangles with the same corners in the same cyclic order, one is left.
/// - Triangles that lie against the majority of their part are turned, if the part can be oriented at all. Nothing is
///   turned if sheets divide the inside: the sides of those mean something.
/// - Vertices on the open edge of a triangle, up to a millionth of the diagonal, cut the triangle there, if that closes
///   a piece of the edge (T-junctions: exporters of CAD programs write them where a long edge meets several short
///   ones).
///   In a soup of which this would take more than a second, only some edges are looked at.
///
/// surface  finite, with valid vertex numbers.  diagnosis: of this surface.
/// returns  nothing if there is nothing of this to do. Triangles keep their groups.
/// Cost: some sorts of the edges; T-junctions: open edges times the open vertices that lie in the same slab.
std::optional<TidySurface> tidy_surface(const TriangleMesh& surface, const SurfaceDiagnosis& diagnosis);

}  // namespace subvol::internal

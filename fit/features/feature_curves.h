// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <span>
#include <vector>

namespace subvol {

/// Default angle in degrees: sharper edges are features.
inline constexpr double kUsualCreaseAngle = 40;
/// Angle in degrees that no edge exceeds: with it, no edge is sharp by its angle.
inline constexpr double kNoCreaseAngle = 180;

/// A polyline along sharp edges of a surface. It is closed if the first vertex is repeated at the end.
struct FeatureCurve {
  std::vector<Index> vertices;  ///< vertices of the surface, at least 2
  std::vector<Vec3> points;     ///< their positions
  bool closed() const { return vertices.front() == vertices.back(); }
  double length() const;
};

/// Returns the points of a curve from one place to another, given by arc length: 0 <= from <= to <= length. On a closed
/// curve, `to` may be up to from + length.
std::vector<Vec3> points_between(const FeatureCurve& curve, double from, double to);

/// The sharp edges of a surface, as curves between the places where they meet, bend or end.
struct FeatureCurves {
  std::vector<FeatureCurve> curves;
  /// Vertices where one sharp edge ends, two meet whose directions differ by more than the angle, or three or more
  /// meet; ascending. Curves end at them; closed ones may have none.
  std::vector<Index> corners;
  std::vector<int> corner_edges;  ///< number of sharp edges at each corner
  bool empty() const { return curves.empty(); }
  bool is_corner(Index vertex) const;
};

/// A straight piece of a fitted crease between two points, and the curve it follows: an index into
/// `FeatureCurves::curves`, or kNoIndex.
struct CreaseSegment {
  std::array<Index, 2> ends;
  Index curve;
};

/// Returns the edges between exactly two triangles that are in different groups, or one of them in none, ascending; the
/// lower vertex of each comes first.
///
/// mesh    connected by common vertices.
/// grouped the same vertices, with groups; it may have more triangles. A triangle of the mesh has the group of the one
///         with the same three vertices. Without groups, the result is empty. Cost: sorts of triangles and edges.
std::vector<std::array<Index, 2>> group_borders(const TriangleMesh& mesh, const TriangleMesh& grouped);

/// Finds the edges between exactly two triangles whose normals differ by more than an angle, and joins them to curves.
///
/// mesh           connected by common vertices; triangles may be oriented inconsistently. Triangles without area make
///                no edge sharp.
/// angle_degrees  deviation from flat, in [0, 180].
/// tagged         edges between different vertices of the mesh that are sharp whatever their angle.
/// InputError: an angle out of range or NaN; a vertex number out of range; a tagged edge from a vertex to itself.
/// Each sharp edge is in exactly one curve. Cost: linear except for one sort of the edges.
FeatureCurves feature_curves(const TriangleMesh& mesh, double angle_degrees,
                             std::span<const std::array<Index, 2>> tagged = {});

}  // namespace subvol

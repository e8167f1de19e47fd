// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace subvol {

/// A kind of fault that may prevent a surface from being filled, or that the user should know of before.
enum class SurfaceFault {
  crossing,           ///< pairs of triangles that cross
  face_contact,       ///< pairs of triangles that overlap in one plane
  edge_contact,       ///< edges along which the surface touches itself
  vertex_contact,     ///< points at which the surface touches itself
  open_rim,           ///< loops of edges of one triangle, longer than those of pinholes
  pinhole,            ///< short loops of edges of one triangle
  fin,                ///< edges of three triangles or more, at a sheet with a rim or where no solid can be told
  interface,          ///< edges of three triangles or more where sheets divide the inside into regions
  disagreement,       ///< edges whose two triangles disagree about the outside
  wall_outward,       ///< parts inside a part that face the way that part faces: walls of voids that point outward
  part_inward,        ///< parts whose normals point into the solid
  part_in_void,       ///< solid parts inside a void
  repeated_triangle,  ///< triangles that are there more than once
  flat_triangle,      ///< triangles without area
  thin_wall,          ///< the thinnest wall
  thin_gap,           ///< the thinnest gap
  sharp_angle         ///< edges at which the solid, or the space outside, has an angle below `kSharpDegrees`
};
inline constexpr std::size_t kNumSurfaceFaults = 17;

inline constexpr double kSharpDegrees = 30;     ///< below it no hex at an edge is good: one has 90 degrees when ideal
inline constexpr double kPinholePercent = 5;    ///< longest rim of a pinhole, in percent of the diagonal: closed unseen
inline constexpr std::size_t kMostPlaces = 10;  ///< places that are listed of each fault

/// One place of a fault.
struct SurfacePlace {
  Vec3 at = Vec3::Zero();
  std::optional<Vec3> to;  ///< the other end of an edge, or the point across a wall or gap
  double measure = 0;      ///< length of a rim, width of a wall or gap, angle in degrees, volume of a part; else 0
  std::array<Index, 2> triangles{kNoIndex, kNoIndex};  ///< numbers in the surface that was given
  std::array<Index, 2> parts{kNoIndex, kNoIndex};      ///< parts of these triangles
};

/// All places of one fault.
struct SurfaceFinding {
  SurfaceFault fault;
  std::size_t count = 0;
  bool is_complete = true;           ///< false: there are more than `count`
  std::vector<SurfacePlace> places;  ///< the first `kMostPlaces`; of sharp angles the sharpest
};

/// A part of a surface: triangles connected through edges.
struct SurfacePart {
  std::size_t triangles = 0;
  Index first_triangle = kNoIndex;  ///< number in the surface that was given
  bool is_closed = false;           ///< it has no rim and no edge that it shares with other sheets
  double volume = 0;                ///< signed: negative if its normals point inward; of a closed part
  int depth = 0;                    ///< number of other parts that a closed part lies in
};

/// The state of a surface that is to be filled.
struct SurfaceDiagnosis {
  std::size_t num_triangles = 0;
  std::size_t num_vertices = 0;          ///< vertices of equal position counted once
  double diagonal = 0;                   ///< of the bounding box
  double volume = 0;                     ///< of the solid; an estimate if the surface is not closed
  std::vector<SurfacePart> parts;        ///< in the order of their first triangles
  std::vector<SurfaceFinding> findings;  ///< in the order of `SurfaceFault`; no fault twice
  bool is_cancelled = false;             ///< some findings are missing

  /// Returns the finding of a fault, or null if there is none.
  const SurfaceFinding* find(SurfaceFault fault) const;
  /// Returns true if the surface bounds a solid as it stands: no fault that `prevents_filling`.
  bool is_fillable() const;
};

/// Returns true if a fault must be repaired before a surface bounds a solid. Contacts along edges and at vertices do
/// not: the parts stay separate. Neither does a surface that faces inward as a whole.
bool prevents_filling(SurfaceFault fault);

/// Returns a word for programs, such as "face_contact".
std::string to_string(SurfaceFault fault);

/// Returns a finding in words, with its count and its first place: "2 pairs of triangles cross, the first (0 and 5) at
/// (1, 2, 0.5)". diagonal: that of the diagnosis, for percentages.
std::string to_text(const SurfaceFinding& finding, double diagonal);

/// Returns a place as "(1, 2, 0.5)".
std::string to_text(const Vec3& point);

/// Finds out what is in the way of filling a surface with cells.
///
/// surface    triangles in any state; vertices of equal position are one vertex.
/// cancelled  asked now and then, from the calling thread; returns true to end early. Empty: never.
/// InputError: a vertex number out of range, a position that is not finite, no triangles.
/// Deterministic and parallel. Cost: about 10 s per million triangles on one core, most of it the search for crossings
/// (`self_intersections`).
SurfaceDiagnosis diagnose(const TriangleMesh& surface, const std::function<bool()>& cancelled = {});

/// Returns what is known to keep grids of cells from having the topology of a surface's solid, in words; empty if
/// nothing is known. cell: edge length of the smallest cells that were tried.
std::string obstacles_for_cells(const SurfaceDiagnosis& diagnosis, double cell);

}  // namespace subvol

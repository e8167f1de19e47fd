// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/disjoint_sets.h"
#include "subvol/surface/part_nesting.h"
#include "subvol/surface/surface_parts.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace subvol::internal {

/// The parts of a surface, some of which are to be united.
class PartUnion {
 public:
  /// cancelled  must outlive the object; asked now and then, from the calling thread. Empty: never.
  PartUnion(SurfaceParts parts, const std::function<bool()>& cancelled);
  /// Finds out which parts cross or overlap. Returns false if cancelled.
  bool group();
  /// Returns the surface of the union, without groups of faces, and adds a sentence for each group of parts to `done`;
  /// nothing if cancelled. InputError: parts cannot be united, with their place.
  std::optional<TriangleMesh> made(std::vector<std::string>& done);

 private:
  struct Meeting {
    std::size_t a, b;  ///< parts
    Vec3 place;
    bool crosses;  ///< else the parts touch
  };
  const TriangleMesh& mesh() const { return parts_.surface.mesh; }
  std::size_t root(std::size_t p) { return static_cast<std::size_t>(groups_.of(static_cast<Index>(p))); }
  bool is_cancelled() const { return cancelled_ && cancelled_(); }
  TriangleMesh part(std::size_t p) const;
  /// members  parts, ascending.  meetings: those among them.
  std::optional<TriangleMesh> united_group(std::span<const std::size_t> members,
                                           std::span<const Meeting> meetings) const;
  /// Finds the names of the groups that the parts' triangles are in.
  void find_names();
  std::string text_of(const Meeting& meeting) const;
  std::string text_of(std::span<const Meeting> meetings, std::size_t num_parts) const;

  SurfaceParts parts_;
  PartNesting nesting_;
  const std::function<bool()>& cancelled_;
  DisjointSets groups_;                           ///< of parts that are to be united
  std::vector<Meeting> meetings_;                 ///< those that joined groups
  std::vector<std::vector<Index>> triangles_of_;  ///< of each part, ascending
  std::vector<std::string> names_;                ///< of each part; empty if it has none, or is in several groups
};

}  // namespace subvol::internal

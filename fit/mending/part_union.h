// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/part_nesting.h"
#include "subvol/surface/surface_parts.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <functional>
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
  /// Returns the surface of the union, without groups of faces, and adds a sentence for each group of parts to `done`.
  /// InputError: parts cannot be united, with their place.
  TriangleMesh made(std::vector<std::string>& done) const;

 private:
  struct Meeting {
    std::size_t a, b;  ///< parts
    Vec3 place;
  };
  const TriangleMesh& mesh() const { return parts_.surface.mesh; }
  std::size_t root(std::size_t p) const {
    while (group_[p] != p) p = group_[p];
    return p;
  }
  TriangleMesh part(std::size_t p) const;
  TriangleMesh united_group(std::size_t group) const;
  std::string text_of(const Meeting& meeting) const;

  SurfaceParts parts_;
  PartNesting nesting_;
  const std::function<bool()>& cancelled_;
  std::vector<std::size_t> group_;  ///< another part of the same group, or the part itself
  std::vector<Meeting> meetings_;   ///< those that joined groups
};

}  // namespace subvol::internal

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <cstddef>
#include <string>

namespace subvol::internal {

/// Collects places of one fault for a message: all are counted, the first ten are listed.
class PlaceList {
 public:
  void add(const std::string& place);
  bool empty() const { return count_ == 0; }
  std::size_t count() const { return count_; }
  /// Returns "2 WHAT: PLACE; PLACE" and a note on the numbering of vertices; one, many: WHAT for one place and for
  /// more.
  std::string text(const std::string& one, const std::string& many) const;

 private:
  std::size_t count_ = 0;
  std::string list_;
};

/// Collects non-manifold edges (of more than two faces) for a message: all are counted, the first ten are listed.
class CrowdedEdges {
 public:
  /// from, to  the ends of the edge, as `vertex_text` writes them.
  void add(const std::string& from, const std::string& to, std::size_t num_faces);
  bool empty() const { return places_.empty(); }
  /// Returns "1 edge has more than two faces: from vertex 4 (0 0 1) to 6 (0 1 1) has 3" and a note on the numbering.
  std::string text() const;

 private:
  PlaceList places_;
};

/// Returns "4 (0 0 1)": the number of a vertex and, unless null, its position.
std::string vertex_text(Index number, const Vec3* position);

}  // namespace subvol::internal

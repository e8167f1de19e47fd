// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <cstddef>
#include <string>

namespace subvol {

/// Edges of more than two faces, for a message: all are counted, the first ten are listed.
class CrowdedEdges {
 public:
  /// The ends by `vertex_text`.
  void add(const std::string& from, const std::string& to, std::size_t num_faces);
  bool empty() const { return count_ == 0; }
  /// "1 edge has more than two faces: from vertex 4 (0 0 1) to 6 (0 1 1) has 3".
  std::string text() const;

 private:
  std::size_t count_ = 0;
  std::string list_;
};

/// "4 (0 0 1)": a vertex's number and, where it is given, its position.
std::string vertex_text(Index number, const Vec3* position);

}  // namespace subvol

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/validate.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace subvol::internal {

/// Collects the defects that the checks of a mesh find.
class DefectList {
 public:
  /// entity  number of the first vertex or cell concerned, or kNoIndex.
  void add(MeshDefect::Kind kind, std::size_t entity, std::string message) {
    defects_.push_back({kind, static_cast<Index>(entity), std::move(message)});
  }
  std::size_t size() const { return defects_.size(); }
  /// Returns the defects in the order of their kinds, those of one kind as they were added. The list is empty
  /// afterwards.
  std::vector<MeshDefect> take_by_kind() {
    std::stable_sort(defects_.begin(), defects_.end(), [](auto& a, auto& b) { return a.kind < b.kind; });
    return std::exchange(defects_, {});
  }

 private:
  std::vector<MeshDefect> defects_;
};

/// Returns "vertex 4", as messages name it.
inline std::string vertex_name(Index v) { return "vertex " + std::to_string(v); }

/// Returns the kind and the number of a cell: "hex 4".
inline std::string cell_name(const VolumeMesh& mesh, std::size_t c) {
  return cell_topology(mesh.kinds[c]).name + std::string(" ") + std::to_string(c);
}

/// Returns the numbers of vertices or cells, separated by blanks.
template <class Range>
std::string number_list(const Range& numbers) {
  std::string text;
  for (const Index i : numbers) {
    if (!text.empty()) text += ' ';
    text += std::to_string(i);
  }
  return text;
}

}  // namespace subvol::internal

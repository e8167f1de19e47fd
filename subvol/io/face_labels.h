// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/io/left_out.h"
#include "subvol/mesh/face_groups.h"

#include <string>
#include <unordered_map>
#include <vector>

namespace subvol::internal {

/// The materials and objects of the faces of a scene, of which groups are made.
class FaceLabels {
 public:
  /// Adds the labels of the next face; empty: none.
  void add(const std::string& material, const std::string& object);
  /// Returns the groups: materials if they tell faces apart; else objects; none if these do not either. Objects that
  /// tell faces apart and do not become groups count as left out.
  FaceGroups groups(LeftOut& left_out) const;

 private:
  struct List {
    std::vector<std::string> names;
    std::unordered_map<std::string, int> places;  ///< of the names
    std::vector<int> of_face;                     ///< a place in `names`; -1: none
    void add(const std::string& name);
    bool tells_apart() const;
  };
  List materials_, objects_;
};

}  // namespace subvol::internal

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/io/left_out.h"
#include "subvol/mesh/face_groups.h"

#include <array>
#include <string>
#include <vector>

namespace subvol {

/// Returns a name such as "#ff8000" for red, green and blue from 0 to 255; values outside are clamped.
std::string color_name(const std::array<double, 3>& color);

/// Makes groups of the colors of faces: one for each color.
///
/// One color on all faces tells nothing apart, and hundreds of colors are a picture: neither becomes groups.
class ColorGroups {
 public:
  /// color  name of the next face's color; empty: it has none.
  void add_face(const std::string& color);
  /// Returns the groups, or none. Colors that do not become groups are added to `left_out` under the name `what`.
  FaceGroups take(LeftOut& left_out, const char* what);
  /// Returns the number of faces that have a color.
  std::size_t num_colored() const { return num_colored_; }

 private:
  GroupList groups_;
  std::vector<Index> of_face_;
  std::size_t num_colored_ = 0;
};

}  // namespace subvol

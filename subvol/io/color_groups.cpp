// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/color_groups.h"

#include "subvol/base/format.h"

#include <algorithm>
#include <cmath>

namespace subvol {

using namespace internal;

namespace {

/// Largest number of colors that become groups. CAD programs color some dozens of faces; a scan has thousands of
/// colors.
constexpr std::size_t kMostColors = 256;

}  // namespace

std::string color_name(const std::array<double, 3>& color) {
  std::array<int, 3> levels{};
  for (std::size_t i = 0; i < 3; ++i)
    levels[i] = std::isfinite(color[i]) ? static_cast<int>(std::lround(std::clamp(color[i], 0.0, 255.0))) : 0;
  return formatted("#%02x%02x%02x", levels[0], levels[1], levels[2]);
}

void ColorGroups::add_face(const std::string& color) {
  const bool is_named = !color.empty() && groups_.groups().size() <= kMostColors;
  of_face_.push_back(is_named ? groups_.by_name(color) : kNoIndex);
  num_colored_ += !color.empty();
}

FaceGroups ColorGroups::take(LeftOut& left_out, const char* what) {
  const std::size_t num_colors = groups_.groups().size();
  const bool all_one = num_colors == 1 && num_colored_ == of_face_.size();
  if (num_colors > 0 && num_colors <= kMostColors && !all_one) return {groups_.take(), std::move(of_face_)};
  left_out.add(what, num_colored_);
  return {};
}

}  // namespace subvol

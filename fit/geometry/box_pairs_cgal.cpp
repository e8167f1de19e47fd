// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/box_pairs.h"

#include <CGAL/box_intersection_d.h>

#include <cstddef>
#include <vector>

namespace subvol::internal {

void for_each_box_pair(std::span<const Eigen::AlignedBox3d> boxes, const std::function<void(Index, Index)>& visit) {
  using NumberedBox =
      CGAL::Box_intersection_d::Box_with_info_d<double, 3, Index, CGAL::Box_intersection_d::ID_FROM_BOX_ADDRESS>;
  std::vector<NumberedBox> numbered;
  numbered.reserve(boxes.size());
  for (const Eigen::AlignedBox3d& box : boxes) {
    const Vec3 &low = box.min(), &high = box.max();
    numbered.push_back(
        {CGAL::Bbox_3(low.x(), low.y(), low.z(), high.x(), high.y(), high.z()), static_cast<Index>(numbered.size())});
  }
  std::vector<const NumberedBox*> pointers;
  for (const NumberedBox& box : numbered) pointers.push_back(&box);
  constexpr std::ptrdiff_t kAllPairs = 200;  // boxes up to which all pairs are tested
  CGAL::box_self_intersection_d(
      pointers.begin(), pointers.end(),
      [&](const NumberedBox* a, const NumberedBox* b) { visit(a->info(), b->info()); }, kAllPairs);
}

}  // namespace subvol::internal

// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/face_labels.h"

#include <algorithm>

namespace subvol::internal {

void FaceLabels::List::add(const std::string& name) {
  if (name.empty()) return of_face.push_back(-1);
  // The faces of an object come one after the other.
  if (!of_face.empty() && of_face.back() >= 0 && names[static_cast<std::size_t>(of_face.back())] == name)
    return of_face.push_back(of_face.back());
  const auto [known, is_new] = places.try_emplace(name, static_cast<int>(names.size()));
  if (is_new) names.push_back(name);
  of_face.push_back(known->second);
}

bool FaceLabels::List::tells_apart() const {
  return std::ranges::any_of(of_face, [&](int entry) { return entry != of_face.front(); });
}

void FaceLabels::add(const std::string& material, const std::string& object) {
  materials_.add(material);
  objects_.add(object);
}

FaceGroups FaceLabels::groups(LeftOut& left_out) const {
  const bool by_material = materials_.tells_apart(), by_object = objects_.tells_apart();
  if (!by_material && !by_object) return {};
  if (by_material && by_object) left_out.add("names of objects", objects_.names.size());
  const List& list = by_material ? materials_ : objects_;
  GroupList groups;
  FaceGroups result;
  for (const int place : list.of_face)
    result.of_face.push_back(place < 0 ? kNoIndex : groups.by_name(list.names[static_cast<std::size_t>(place)]));
  result.groups = groups.take();
  return result;
}

}  // namespace subvol::internal

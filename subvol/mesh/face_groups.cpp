// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/face_groups.h"

#include "subvol/base/sort_unique.h"
#include "subvol/mesh/mesh_topology.h"

#include <algorithm>
#include <limits>
#include <string_view>

namespace subvol {

namespace {

/// Returns the number of bytes of the character that a text begins with, or 0 if it is not UTF-8.
std::size_t utf8_size(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  const std::size_t size = first < 0x80                    ? 1
                           : first >= 0xC2 && first < 0xE0 ? 2
                           : (first & 0xF0) == 0xE0        ? 3
                           : first >= 0xF0 && first < 0xF5 ? 4
                                                           : 0;
  if (size == 0 || size > text.size()) return 0;
  for (std::size_t i = 1; i < size; ++i)
    if ((byte(i) & 0xC0) != 0x80) return 0;
  const bool is_overlong = (first == 0xE0 && byte(1) < 0xA0) || (first == 0xF0 && byte(1) < 0x90);
  const bool is_beyond = (first == 0xED && byte(1) > 0x9F) || (first == 0xF4 && byte(1) > 0x8F);
  return is_overlong || is_beyond ? 0 : size;
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t size = utf8_size(text);
    if (size == 0) return false;
    text.remove_prefix(size);
  }
  return true;
}

}  // namespace

FaceKey face_key(std::span<const Index> corners) {
  FaceKey key;
  key.fill(std::numeric_limits<Index>::max());
  std::copy_n(corners.begin(), std::min(corners.size(), key.size()), key.begin());
  std::sort(key.begin(), key.end());
  if (corners.size() < key.size()) key.back() = kNoIndex;
  return key;
}

void make_names_utf8(std::vector<Group>& groups) {
  for (Group& group : groups) {
    if (is_utf8(group.name)) continue;
    std::string name;
    for (const char c : group.name) {
      const auto code = static_cast<unsigned char>(c);
      if (code < 0x80) {
        name += c;
      } else {
        name += static_cast<char>(0xC0 | (code >> 6));
        name += static_cast<char>(0x80 | (code & 0x3F));
      }
    }
    group.name = std::move(name);
  }
}

void normalize(VolumeFaceGroups& groups) { internal::sort_unique(groups.faces); }

Index group_of(const VolumeFaceGroups& groups, std::span<const Index> corners) {
  const FaceKey key = face_key(corners);
  const auto before = [](const GroupedFace& entry, const FaceKey& face) { return entry.face < face; };
  const auto found = std::lower_bound(groups.faces.begin(), groups.faces.end(), key, before);
  return found != groups.faces.end() && found->face == key ? found->group : kNoIndex;
}

std::vector<Index> groups_of_boundary(const VolumeFaceGroups& groups, const MeshTopology& topology) {
  std::vector<Index> of_face;
  if (groups.empty()) return of_face;
  of_face.reserve(topology.boundary_faces().size());
  for (const Index f : topology.boundary_faces()) of_face.push_back(group_of(groups, topology.face(f)));
  return of_face;
}

VolumeFaceGroups groups_from_boundary(std::vector<Group> groups, const MeshTopology& topology,
                                      std::span<const Index> of_boundary_face) {
  VolumeFaceGroups result{std::move(groups), {}};
  const auto faces = topology.boundary_faces();
  for (std::size_t i = 0; i < of_boundary_face.size(); ++i)
    if (of_boundary_face[i] != kNoIndex)
      result.faces.push_back({face_key(topology.face(faces[i])), of_boundary_face[i]});
  normalize(result);
  return result;
}

VolumeFaceGroups renumbered(const VolumeFaceGroups& groups, std::span<const Index> number) {
  VolumeFaceGroups result{groups.groups, {}};
  for (const GroupedFace& entry : groups.faces) {
    std::array<Index, 4> corners;
    const std::size_t size = entry.face.back() == kNoIndex ? 3 : 4;
    bool kept = true;
    for (std::size_t i = 0; i < size; ++i) {
      corners[i] = number[entry.face[i]];
      kept = kept && corners[i] != kNoIndex &&
             std::find(corners.begin(), corners.begin() + i, corners[i]) == corners.begin() + i;
    }
    if (kept) result.faces.push_back({face_key({corners.data(), size}), entry.group});
  }
  normalize(result);
  return result;
}

VolumeFaceGroups groups_of_faces(const VolumeFaceGroups& groups, const MeshTopology& topology) {
  VolumeFaceGroups result{groups.groups, {}};
  if (groups.empty()) return result;
  std::vector<FaceKey> keys;
  for (std::size_t f = 0; f < topology.num_faces(); ++f) keys.push_back(face_key(topology.face(static_cast<Index>(f))));
  std::sort(keys.begin(), keys.end());
  for (const GroupedFace& entry : groups.faces)
    if (std::binary_search(keys.begin(), keys.end(), entry.face)) result.faces.push_back(entry);
  return result;
}

void append_groups(VolumeFaceGroups& groups, const VolumeFaceGroups& others, Index first_vertex) {
  std::vector<Index> place;
  for (const Group& other : others.groups) {
    const auto same = std::find(groups.groups.begin(), groups.groups.end(), other);
    place.push_back(static_cast<Index>(same - groups.groups.begin()));
    if (same != groups.groups.end()) continue;
    const bool taken = std::any_of(groups.groups.begin(), groups.groups.end(),
                                   [&](const Group& group) { return group.number == other.number; });
    groups.groups.push_back({other.name, taken ? free_number(groups.groups) : other.number, other.dimension});
  }
  for (GroupedFace entry : others.faces) {
    for (Index& v : entry.face) v += v == kNoIndex ? 0 : first_vertex;
    groups.faces.push_back({entry.face, place[entry.group]});
  }
  normalize(groups);
}

int free_number(std::span<const Group> groups) {
  std::vector<int> taken;
  for (const Group& group : groups) taken.push_back(group.number);
  std::sort(taken.begin(), taken.end());
  int number = 1;
  for (const int t : taken) number += t == number;
  return number;
}

// Names in files may be in any encoding; JSON, for one, must be UTF-8.
std::string label_of(const Group& group) {
  if (group.name.empty()) return "group " + std::to_string(group.number);
  std::string label;
  for (std::size_t i = 0; i < group.name.size();) {
    const std::size_t size = utf8_size(std::string_view(group.name).substr(i));
    label.append(size > 0 ? group.name.substr(i, size) : "?");
    i += std::max(size, std::size_t{1});
  }
  return label;
}

Index GroupList::add(Group group) {
  const auto place = static_cast<Index>(groups_.size());
  numbers_.emplace(group.number, place);
  groups_.push_back(std::move(group));
  return place;
}

Index GroupList::by_name(const std::string& name, int dimension) {
  const auto known = names_.find(name);
  if (known != names_.end()) return known->second;
  while (numbers_.contains(next_number_)) ++next_number_;
  const Index place = add({name, next_number_, dimension});
  names_.emplace(name, place);
  return place;
}

Index GroupList::by_number(int number, int dimension) {
  const auto known = numbers_.find(number);
  return known != numbers_.end() ? known->second : add({"", number, dimension});
}

}  // namespace subvol

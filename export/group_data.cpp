// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/group_data.h"

#include "subvol/export/vtu_arrays.h"

#include <algorithm>
#include <cstdint>

namespace subvol::internal {

namespace {

constexpr const char* kGroupNumbersField = "subvol_group_numbers";
constexpr const char* kGroupDimensionsField = "subvol_group_dimensions";
constexpr const char* kGroupNamesField = "subvol_group_names";
constexpr const char* kGroupFacesField = "subvol_group_faces";
constexpr const char* kGroupOfFacesField = "subvol_group_of_faces";

template <class T>
void append_field(std::string& text, const char* name, const std::vector<T>& values, std::size_t components = 1) {
  append_data_array<T>(text,
                       std::string("Name=\"") + name + "\" NumberOfComponents=\"" + std::to_string(components) +
                           "\" NumberOfTuples=\"" + std::to_string(values.size() / components) + '"',
                       values);
}

void append_name(std::vector<std::uint8_t>& bytes, std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  bytes.insert(bytes.end(), name.begin(), name.end());
  bytes.push_back('\n');
}

std::vector<std::string> split_names(const std::vector<std::uint8_t>& bytes) {
  std::vector<std::string> names;
  for (auto begin = bytes.begin(); begin != bytes.end();) {
    const auto end = std::find(begin, bytes.end(), '\n');
    names.emplace_back(begin, end);
    begin = end == bytes.end() ? end : end + 1;
  }
  return names;
}

void read_faces(const VtuArrays& file, std::size_t num_points, std::size_t num_groups, VolumeFaceGroups& groups) {
  const auto points = file.get<std::int32_t>(kGroupFacesField), of_faces = file.get<std::int32_t>(kGroupOfFacesField);
  if (points.size() != 4 * of_faces.size())
    file.fail(std::string(kGroupFacesField) + ": expected four numbers for each face");
  for (std::size_t f = 0; f < of_faces.size(); ++f) {
    const std::size_t size = points[4 * f + 3] == kNoIndex ? 3 : 4;
    for (std::size_t k = 0; k < size; ++k)
      if (points[4 * f + k] < 0 || static_cast<std::size_t>(points[4 * f + k]) >= num_points)
        file.fail(std::string(kGroupFacesField) + ": face " + std::to_string(f) + ": expected numbers of points");
    if (of_faces[f] < 0 || static_cast<std::size_t>(of_faces[f]) >= num_groups)
      file.fail(std::string(kGroupOfFacesField) + ": face " + std::to_string(f) +
                ": expected the place of a group of faces");
    groups.faces.push_back({face_key({&points[4 * f], size}), of_faces[f]});
  }
  normalize(groups);
}

}  // namespace

std::string group_data(const VolumeFaceGroups& groups, std::span<const Group> regions) {
  if (groups.empty() && regions.empty()) return {};
  std::vector<std::int32_t> numbers, points, of_faces;
  std::vector<std::uint8_t> dimensions, names;
  const auto add = [&](const Group& group, int dimension) {
    numbers.push_back(group.number);
    dimensions.push_back(static_cast<std::uint8_t>(dimension));
    append_name(names, group.name);
  };
  for (const Group& group : groups.groups) add(group, 2);
  for (const Group& region : regions) add(region, 3);
  for (const GroupedFace& entry : groups.faces) {
    points.insert(points.end(), entry.face.begin(), entry.face.end());
    of_faces.push_back(entry.group);
  }
  std::string text;
  append_field(text, kGroupNumbersField, numbers);
  append_field(text, kGroupDimensionsField, dimensions);
  append_field(text, kGroupNamesField, names);
  append_field(text, kGroupFacesField, points, 4);
  append_field(text, kGroupOfFacesField, of_faces);
  return text;
}

FileGroups read_groups(const VtuArrays& file, std::size_t num_points) {
  FileGroups groups;
  if (!file.has(kGroupNumbersField)) return groups;
  const auto numbers = file.get<std::int32_t>(kGroupNumbersField);
  const auto dimensions = file.get<std::uint8_t>(kGroupDimensionsField);
  const std::vector<std::string> names = split_names(file.get<std::uint8_t>(kGroupNamesField));
  if (dimensions.size() != numbers.size() || names.size() != numbers.size())
    file.fail(std::string(kGroupNumbersField) + ": expected as many numbers, dimensions and names");
  for (std::size_t g = 0; g < numbers.size(); ++g) {
    if ((dimensions[g] != 2 && dimensions[g] != 3) || (dimensions[g] == 2 && !groups.regions.empty()))
      file.fail(std::string(kGroupDimensionsField) + ": expected 2 for groups of faces, then 3 for references");
    (dimensions[g] == 2 ? groups.faces.groups : groups.regions).push_back({names[g], numbers[g], dimensions[g]});
  }
  read_faces(file, num_points, groups.faces.groups.size(), groups.faces);
  return groups;
}

}  // namespace subvol::internal

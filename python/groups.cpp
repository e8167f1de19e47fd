// SPDX-License-Identifier: GPL-3.0-or-later
#include "python/groups.h"

#include "cli/runs/run_options.h"
#include "python/arrays.h"
#include "subvol/base/error.h"

#include <set>
#include <string>
#include <utility>

namespace subvol::python {
namespace {

/// Takes group_names and group_numbers; without numbers, groups are numbered from 1.
std::vector<Group> take_groups(Keywords& keywords) {
  const py::object names = keywords.object("group_names"), numbers = keywords.object("group_numbers");
  std::vector<Group> groups;
  if (!names.is_none()) {
    if (!py::isinstance<py::sequence>(names) || py::isinstance<py::str>(names))
      throw py::type_error("group_names must be a list of str");
    for (const py::handle name : py::sequence(names)) {
      if (!py::isinstance<py::str>(name)) throw py::type_error("group_names must be a list of str");
      groups.push_back({name.cast<std::string>(), static_cast<int>(groups.size()) + 1, 2});
    }
  }
  if (numbers.is_none()) return groups;
  if (names.is_none()) groups.resize(py::len(numbers));
  const std::vector<int> given = integers_from(numbers, "group_numbers", groups.size());
  std::set<int> taken;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    groups[g].number = given[g];
    if (!taken.insert(given[g]).second)
      throw InputError("group_numbers: " + std::to_string(given[g]) + " is there twice");
  }
  return groups;
}

/// Reads one place in the groups, or -1 if that is allowed, for each face.
std::vector<Index> places_from(const py::object& object, std::size_t size, std::size_t num_groups, bool may_be_none) {
  std::vector<Index> places;
  for (const int place : integers_from(object, "face_groups", size)) {
    if (place < (may_be_none ? -1 : 0) || place >= static_cast<int>(num_groups))
      throw InputError("face_groups: " + std::to_string(place) + " is no place in the list of " +
                       std::to_string(num_groups) + " groups");
    places.push_back(place);
  }
  return places;
}

}  // namespace

FaceGroups take_face_groups(Keywords& keywords, std::size_t num_faces) {
  const py::object places = keywords.object("face_groups");
  FaceGroups groups{take_groups(keywords), {}};
  if (groups.empty() != places.is_none())
    throw InputError("face_groups goes together with group_names or group_numbers");
  if (!groups.empty()) groups.of_face = places_from(places, num_faces, groups.groups.size(), true);
  return groups;
}

VolumeFaceGroups take_volume_groups(Keywords& keywords, std::size_t num_points) {
  const py::object faces = keywords.object("grouped_faces"), places = keywords.object("face_groups");
  VolumeFaceGroups groups{take_groups(keywords), {}};
  if (faces.is_none() != places.is_none() || groups.empty() != places.is_none())
    throw InputError("grouped_faces and face_groups go together with group_names or group_numbers");
  if (groups.empty()) return groups;
  const std::size_t size = py::len(places);
  const std::vector<Index> of_face = places_from(places, size, groups.groups.size(), false);
  // -1 stands for the fourth corner of a triangle: all numbers are shifted by one while they are checked.
  const py::object shifted = py::module_::import("numpy").attr("asarray")(faces).attr("__add__")(1);
  const std::vector<Index> corners = indices_from(shifted, "grouped_faces", 4, num_points + 1);
  if (corners.size() != 4 * size) throw InputError("grouped_faces must have as many rows as face_groups has entries");
  for (std::size_t f = 0; f < size; ++f) {
    std::vector<Index> face;
    for (std::size_t k = 0; k < 4; ++k)
      if (corners[4 * f + k] > 0) face.push_back(corners[4 * f + k] - 1);
    if (face.size() < 3) throw InputError("grouped_faces: row " + std::to_string(f) + " has fewer than three points");
    groups.faces.push_back({face_key(face), of_face[f]});
  }
  normalize(groups);
  return groups;
}

py::list names_of(const std::vector<Group>& groups) {
  py::list names;
  for (const Group& group : groups) names.append(py::str(cli::as_utf8(group.name)));
  return names;
}

py::array numbers_of(const std::vector<Group>& groups, const py::object& owner) {
  return shown(groups.empty() ? nullptr : &groups[0].number, {static_cast<py::ssize_t>(groups.size())}, owner, false,
               {sizeof(Group)});
}

py::array faces_shown(const VolumeFaceGroups& groups, const py::object& owner) {
  return shown(groups.faces.empty() ? nullptr : groups.faces[0].face.data(),
               {static_cast<py::ssize_t>(groups.faces.size()), 4}, owner, false, {sizeof(GroupedFace), sizeof(Index)});
}

py::array places_shown(const VolumeFaceGroups& groups, const py::object& owner) {
  return shown(groups.faces.empty() ? nullptr : &groups.faces[0].group, {static_cast<py::ssize_t>(groups.faces.size())},
               owner, false, {sizeof(GroupedFace)});
}

py::dict region_names(const std::vector<Group>& regions) {
  py::dict names;
  for (const Group& region : regions) names[py::int_(region.number)] = py::str(cli::as_utf8(region.name));
  return names;
}

}  // namespace subvol::python

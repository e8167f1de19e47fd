// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "python/keywords.h"
#include "subvol/mesh/face_groups.h"

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstddef>
#include <vector>

namespace subvol::python {

namespace py = pybind11;

/// Takes face_groups, group_names and group_numbers of a surface of so many faces. InputError: arrays that do not fit
/// together, a number twice.
FaceGroups take_face_groups(Keywords& keywords, std::size_t num_faces);

/// Takes the same and grouped_faces, of a volume mesh of so many points.
VolumeFaceGroups take_volume_groups(Keywords& keywords, std::size_t num_points);

/// The names and the numbers of groups.
py::list names_of(const std::vector<Group>& groups);
py::array numbers_of(const std::vector<Group>& groups, const py::object& owner);

/// The faces of groups as (n, 4) point numbers, and the place of the group of each as (n,): views of the records.
py::array faces_shown(const VolumeFaceGroups& groups, const py::object& owner);
py::array places_shown(const VolumeFaceGroups& groups, const py::object& owner);

/// The names of references: number -> name.
py::dict region_names(const std::vector<Group>& regions);

/// Help of the properties.
inline constexpr const char* kNamesHelp = "Names of the groups of faces: list of str; empty where a group has none.";
inline constexpr const char* kNumbersHelp = "Numbers of the groups of faces: (n,) int32. A view.";
inline constexpr const char* kFacesHelp =
    "Points of the faces in groups, ascending; -1 in place of the fourth of a triangle: (n, 4) int32. A view.";
inline constexpr const char* kPlacesHelp =
    "Place in group_names of the group of each of these faces: (n,) int32. A view.";

/// Adds these properties to the class of a mesh with the member `face_groups`.
template <class Mesh, class... Extra>
void add_groups(py::class_<Mesh, Extra...>& type) {
  type.def_property_readonly(
      "group_names", [](const Mesh& mesh) { return names_of(mesh.face_groups.groups); }, kNamesHelp);
  type.def_property_readonly(
      "group_numbers",
      [](const py::object& self) { return numbers_of(self.cast<const Mesh&>().face_groups.groups, self); },
      kNumbersHelp);
  type.def_property_readonly(
      "grouped_faces", [](const py::object& self) { return faces_shown(self.cast<const Mesh&>().face_groups, self); },
      kFacesHelp);
  type.def_property_readonly(
      "face_groups", [](const py::object& self) { return places_shown(self.cast<const Mesh&>().face_groups, self); },
      kPlacesHelp);
}

}  // namespace subvol::python

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/loading.h"
#include "export/high_order_file.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <pybind11/pybind11.h>

#include <memory>
#include <string>
#include <vector>

namespace subvol::python {

namespace py = pybind11;

using SurfaceMesh = cli::TaggedPolygons;
using CurvedMesh = HighOrderFile;

/// Whether something names a file: text, bytes or os.PathLike.
bool is_path(const py::object& object);
/// The path itself. TypeError: `is_path` is false.
std::string path_from(const py::object& object);

/// Arguments that are meshes, or paths of files that are read as the program reads them; `name` is for messages.
/// TypeError: something else. InputError: what the readers refuse. Warnings are told.
std::shared_ptr<const VolumeMesh> volume_from(const py::object& object, const char* name, bool check = true);
/// The same for functions that rely on a mesh that is sound but for inverted cells and unused points, else InputError.
std::shared_ptr<const VolumeMesh> sound_volume_from(const py::object& object, const char* name);
/// A surface, or the boundary of a volume mesh: as triangles; as polygons with tags. InputError: points not finite.
TriangleMesh triangles_from(const py::object& object, const char* name);
SurfaceMesh surface_from(const py::object& object, const char* name);
/// The same, or points: an (n, 3) array, or the path of a file of them. InputError also as `sound_points`.
cli::Target target_from(const py::object& object, const char* name);

}  // namespace subvol::python

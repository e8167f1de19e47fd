// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/loading.h"
#include "subvol/export/high_order_file.h"
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

/// True if the object names a file: text, bytes or os.PathLike.
bool is_path(const py::object& object);
/// Returns the path. TypeError if `is_path` is false.
std::string path_from(const py::object& object);

/// Reads a file as the program does; warnings go to Python. InputError: a file that the readers refuse.
cli::LoadedMesh mesh_from_file(const std::string& path, bool check);

/// Converts an argument that is a mesh, or the path of a file, which is read as the program reads it; `name` is for
/// messages. TypeError: something else. InputError: a file that the readers refuse. Warnings go to Python.
std::shared_ptr<const VolumeMesh> volume_from(const py::object& object, const char* name, bool check = true);
/// Linear or curved cells; one of the two is there.
struct Cells {
  std::shared_ptr<const VolumeMesh> linear;
  std::shared_ptr<const CurvedMesh> curved;
};
/// Converts an argument that is a VolumeMesh, a HighOrderMesh, or the path of either in the same way.
Cells cells_from(const py::object& object, const char* name, bool check = true);
/// Does the same as `volume_from` for functions that rely on a mesh that is valid except for inverted cells and unused
/// points, else InputError.
std::shared_ptr<const VolumeMesh> valid_volume_from(const py::object& object, const char* name);
/// A surface, or the boundary of a volume mesh: as triangles, or as polygons with tags. InputError: points not finite.
TriangleMesh triangles_from(const py::object& object, const char* name);
SurfaceMesh surface_from(const py::object& object, const char* name);
/// Returns the surface on which a shell grows. Of cells, that is the boundary of a region, which is given by its name
/// or number; `region` is empty afterwards. ValueError: there is no such region.
SurfaceMesh shell_surface_from(const py::object& object, const char* name, std::string& region);
/// A surface as above, or points: an (n, 3) array, or the path of a file of them. InputError also as `sound_points`.
cli::Target target_from(const py::object& object, const char* name);
/// Converts the target of a fit in the same way; of a volume mesh, also the interfaces between its regions.
cli::Target target_with_regions_from(const py::object& object, const char* name);

}  // namespace subvol::python

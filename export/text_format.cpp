// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/text_format.h"

#include "subvol/base/error.h"

namespace subvol::internal {

void append_vector(std::string& text, const Vec3& vector, const char* separator) {
  for (int k = 0; k < 3; ++k) {
    if (k > 0) text += separator;
    append_number(text, vector[k]);
  }
}

std::string lower_case_extension(const std::filesystem::path& path) { return lower_case(path.extension().string()); }

void require_polygons(const PolygonMesh& mesh, const std::string& what) {
  if (mesh.face_offsets.size() < 2) throw InputError(what + ": expected at least one face");
  if (mesh.face_offsets.front() != 0 || mesh.face_offsets.back() != mesh.face_vertices.size())
    throw InputError(what + ": expected face offsets from 0 to the number of face vertices");
  for (std::size_t f = 0; f < mesh.num_faces(); ++f)
    if (mesh.face_offsets[f] > mesh.face_offsets[f + 1] || mesh.face_offsets[f + 1] - mesh.face_offsets[f] < 3)
      throw InputError(what + ": face " + std::to_string(f) + ": expected at least three corners");
  for (const Index v : mesh.face_vertices)
    if (v < 0 || static_cast<std::size_t>(v) >= mesh.positions.size())
      throw InputError(what + ": vertex number " + std::to_string(v) + " is out of range");
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    if (!mesh.positions[v].allFinite())
      throw InputError(what + ": vertex " + std::to_string(v) + ": expected finite coordinates");
  const FaceGroups& groups = mesh.face_groups;
  if (!groups.empty() && groups.of_face.size() != mesh.num_faces())
    throw InputError(what + ": expected one group, or none, for each face");
  for (const Index group : groups.of_face)
    if (group < kNoIndex || group >= static_cast<Index>(groups.groups.size()))
      throw InputError(what + ": group " + std::to_string(group) + " is out of range");
}

}  // namespace subvol::internal

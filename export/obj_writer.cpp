// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/obj_writer.h"

#include "subvol/base/atomic_file.h"
#include "subvol/base/version.h"
#include "subvol/export/text_format.h"
#include "subvol/export/written_names.h"

#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace subvol {

using namespace internal;

namespace {

/// Returns the names of groups as one word each, since blanks would separate the names of several groups; no two are
/// the same.
std::vector<std::string> group_names(std::span<const Group> groups) {
  std::vector<std::string> names;
  std::set<std::string> taken;
  for (const Group& group : groups) {
    const std::string word = name_in_file(".obj", label_of(group));
    std::string name = word;
    for (int n = 2; !taken.insert(name).second; ++n) name = word + '_' + std::to_string(n);
    names.push_back(std::move(name));
  }
  return names;
}

}  // namespace

std::string obj_text(const PolygonMesh& mesh, const std::string& name) {
  require_polygons(mesh, "obj");
  std::string text = std::string("# subvol ") + version() + "\no " + name + "\n";
  for (const Vec3& position : mesh.positions) {
    text += "v ";
    append_vector(text, position, " ");
    text += '\n';
  }
  const std::vector<std::string> names = group_names(mesh.face_groups.groups);
  Index group = kNoIndex;
  for (std::size_t f = 0; f < mesh.num_faces(); ++f) {
    if (const Index next = mesh.face_groups.empty() ? kNoIndex : mesh.face_groups.of_face[f]; next != group) {
      text += next == kNoIndex ? "g\n" : "g " + names[static_cast<std::size_t>(next)] + '\n';
      group = next;
    }
    text += 'f';
    for (std::size_t k = mesh.face_offsets[f]; k < mesh.face_offsets[f + 1]; ++k) {
      text += ' ';
      append_number(text, mesh.face_vertices[k] + std::int64_t{1});
    }
    text += '\n';
  }
  return text;
}

void write_obj(const std::filesystem::path& path, const PolygonMesh& mesh) {
  write_file_atomically(path, obj_text(mesh));
}

}  // namespace subvol

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/losses.h"

#include "subvol/io/left_out.h"
#include "subvol/mesh/mesh_topology.h"

#include <algorithm>
#include <optional>

namespace subvol::cli {

namespace {

bool holds_references(const Output& output) {
  return output.part != Part::boundary && output.part != Part::region && output.format().regions_written != Held::none;
}
bool holds_groups(const Output& output) {
  return output.part == Part::boundary ||
         (output.part != Part::cutaway && output.format().groups_written != Held::none);
}
bool holds_tags(const Output& output) { return output.format().holds_features; }

std::size_t num_set(std::span<const int> references) {
  return static_cast<std::size_t>(
      std::count_if(references.begin(), references.end(), [](int reference) { return reference != 0; }));
}

bool has_face_of_several_groups(const VolumeFaceGroups& groups) {
  const auto same = [](const GroupedFace& a, const GroupedFace& b) { return a.face == b.face; };
  return std::adjacent_find(groups.faces.begin(), groups.faces.end(), same) != groups.faces.end();
}

/// Returns a name in quotes: on one line, and cut if it is long.
std::string quoted_label(std::string label) {
  constexpr std::size_t kLongest = 60;
  std::replace_if(
      label.begin(), label.end(), [](unsigned char c) { return c < ' ' || c == 127; }, ' ');
  if (label.size() <= kLongest) return '"' + label + '"';
  std::size_t end = kLongest;
  while (end > 0 && (static_cast<unsigned char>(label[end]) & 0xC0) == 0x80) --end;  // not within a character
  return '"' + label.substr(0, end) + "...\"";
}

/// Counts the faces of each group that a group before it has, too. topology: called only if there are such faces.
template <class Topology>
std::vector<SharedGroup> shared_groups(const VolumeFaceGroups& groups, const Topology& topology_of) {
  if (!has_face_of_several_groups(groups)) return {};
  std::vector<SharedGroup> all;
  for (const Group& group : groups.groups) all.push_back({label_of(group)});
  const MeshTopology& topology = topology_of();
  const auto before = [](const GroupedFace& entry, const FaceKey& key) { return entry.face < key; };
  for (std::size_t f = 0; f < topology.num_faces(); ++f) {
    const auto face = static_cast<Index>(f);
    const FaceKey key = face_key(topology.face(face));
    const bool is_boundary = topology.face_cells(face)[1] == kNoIndex;
    bool is_first = true;
    for (auto entry = std::lower_bound(groups.faces.begin(), groups.faces.end(), key, before);
         entry != groups.faces.end() && entry->face == key; ++entry, is_first = false) {
      SharedGroup& group = all[static_cast<std::size_t>(entry->group)];
      ++group.faces;
      group.lost += !is_first;
      group.boundary_faces += is_boundary;
      group.boundary_lost += is_boundary && !is_first;
    }
  }
  std::erase_if(all, [](const SharedGroup& group) { return group.lost == 0; });
  return all;
}

/// Returns what an output loses of groups that share faces, in words; empty if nothing.
std::string shared_faces_lost(const Output& output, std::span<const SharedGroup> shared) {
  const bool of_boundary = output.part == Part::boundary || !output.is_volume();
  const bool holds_one = output.part == Part::boundary ||
                         (output.format().groups_written != Held::none && !output.format().holds_all_groups_of_faces());
  if (!holds_one || output.part == Part::cutaway || output.is_page()) return {};
  constexpr std::size_t kMostListed = 5;
  std::size_t num_groups = 0;
  std::string list;
  for (const SharedGroup& group : shared) {
    const std::size_t faces = of_boundary ? group.boundary_faces : group.faces,
                      lost = of_boundary ? group.boundary_lost : group.lost;
    if (lost == 0 || ++num_groups > kMostListed) continue;
    list += (list.empty() ? "" : ", ") + quoted_label(group.label) + " loses " +
            (lost == faces ? "all" : std::to_string(lost)) + " of its " + std::to_string(faces) + " faces";
  }
  if (list.empty()) return {};
  if (num_groups > kMostListed) list += ", and " + std::to_string(num_groups - kMostListed) + " more groups lose faces";
  return output.path.string() + ": this format holds one group for each face, and faces are in several: the group " +
         list + "; take .msh, .vtu, .inp or .e";
}

}  // namespace

Marks marks_of(const VolumeMesh& mesh) {
  std::optional<MeshTopology> topology;
  const auto shared = shared_groups(mesh.face_groups, [&]() -> const MeshTopology& { return topology.emplace(mesh); });
  return {num_set(mesh.references), mesh.tags.creases.size(), mesh.tags.corners.size(), mesh.face_groups.groups.size(),
          shared};
}

Marks marks_of(const HighOrderFile& file) {
  return {
      .references = num_set(file.references),
      .groups = file.face_groups.groups.size(),
      .shared = shared_groups(file.face_groups, [&]() -> const MeshTopology& { return file.mesh.space.topology(); })};
}

void warn_of_losses(const Marks& read, const Marks& result, std::span<const Output> outputs,
                    std::vector<std::string>& warnings, bool curved) {
  if (outputs.empty()) return;
  const bool keeps_references = std::any_of(outputs.begin(), outputs.end(), holds_references);
  const bool keeps_tags = !curved && std::any_of(outputs.begin(), outputs.end(), holds_tags);
  const bool keeps_groups = std::any_of(outputs.begin(), outputs.end(), holds_groups);
  LeftOut lost;
  if (!keeps_references || result.references == 0) lost.add("references of cells", read.references);
  if (!keeps_tags || result.creases == 0) lost.add("creases", read.creases);
  if (!keeps_tags || result.corners == 0) lost.add("corners", read.corners);
  if (!keeps_groups || result.groups == 0) lost.add("groups of faces", read.groups);
  if (!lost.empty()) warnings.push_back("read, but in none of the outputs: " + lost.text());
  for (const Output& output : outputs)
    if (const std::string told = shared_faces_lost(output, result.shared); !told.empty()) warnings.push_back(told);
}

}  // namespace subvol::cli

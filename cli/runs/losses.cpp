// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/losses.h"

#include "subvol/export/written_names.h"
#include "subvol/io/left_out.h"
#include "subvol/mesh/mesh_topology.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <set>

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
  constexpr std::size_t kLongestQuotedLabel = 60;
  std::replace_if(
      label.begin(), label.end(), [](unsigned char c) { return c < ' ' || c == 127; }, ' ');
  if (label.size() <= kLongestQuotedLabel) return '"' + label + '"';
  std::size_t end = kLongestQuotedLabel;
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
  constexpr std::size_t kMostListedGroups = 5;
  std::size_t num_groups = 0;
  std::string list;
  for (const SharedGroup& group : shared) {
    const std::size_t faces = of_boundary ? group.boundary_faces : group.faces,
                      lost = of_boundary ? group.boundary_lost : group.lost;
    if (lost == 0 || ++num_groups > kMostListedGroups) continue;
    list +=
        (list.empty() ? "" : ", ") + quoted_label(group.label) + " loses " +
        (faces == 1 ? "its only face"
                    : (lost == faces ? "all" : std::to_string(lost)) + " of its " + std::to_string(faces) + " faces");
  }
  if (list.empty()) return {};
  if (num_groups > kMostListedGroups)
    list += ", and " + std::to_string(num_groups - kMostListedGroups) + " more groups lose faces";
  return output.path.string() + ": this format holds one group for each face, and faces are in several: the group " +
         list + "; take .msh, .vtu, .inp or .e";
}

/// Returns true if a file has a name, but for blanks and marks in it: "left side" may be left_side.
bool is_spelled_alike(const std::string& name, const std::string& in_file) {
  return std::equal(name.begin(), name.end(), in_file.begin(), in_file.end(),
                    [](unsigned char c, unsigned char d) { return c == d || (c < 128 && std::isalnum(c) == 0); });
}

/// Returns what an output loses of names, in words; empty if nothing.
std::string names_lost(const Output& output, std::span<const Group> named) {
  if (output.part == Part::boundary || output.part == Part::cutaway || output.part == Part::region || output.is_page())
    return {};
  const FileFormat& format = output.format();
  std::size_t num_lost = 0, num_altered = 0;
  std::string first_lost, first_altered;
  for (const Group& group : named) {
    const Held held = group.dimension == 2 ? format.groups_written : format.regions_written;
    if (held == Held::numbers && ++num_lost == 1) first_lost = quoted_label(label_of(group));
    if (held != Held::names) continue;
    const std::string name = internal::name_in_file(output.extension, group.name);
    if (!is_spelled_alike(group.name, name) && ++num_altered == 1)
      first_altered = quoted_label(label_of(group)) + (name.empty() ? " to its number" : " to " + quoted_label(name));
  }
  const auto names = [](std::size_t n) { return n == 1 ? std::string("1 name") : std::to_string(n) + " names"; };
  std::string told;
  if (num_lost > 0)
    told = "this format holds numbers of groups and regions, not names: " + names(num_lost) + " left out, the first " +
           first_lost;
  if (num_altered > 0)
    told += (told.empty() ? "" : "; ") + names(num_altered) +
            " altered, since this format does not hold all names: " + "the first, " + first_altered;
  return told.empty() ? told : output.path.string() + ": " + told;
}

/// Returns the groups and regions that have names; regions only if there are references to them.
std::vector<Group> named_groups(std::span<const Group> face_groups, std::span<const Group> regions,
                                std::span<const int> references) {
  std::vector<Group> named;
  const auto add = [&](const Group& group, int dimension) {
    if (!group.name.empty()) named.push_back({group.name, group.number, dimension});
  };
  for (const Group& group : face_groups) add(group, 2);
  const std::set<int> used(references.begin(), references.end());
  for (const Group& region : regions)
    if (used.contains(region.number)) add(region, 3);
  return named;
}

}  // namespace

Marks marks_of(const VolumeMesh& mesh) {
  std::optional<MeshTopology> topology;
  const auto shared = shared_groups(mesh.face_groups, [&]() -> const MeshTopology& { return topology.emplace(mesh); });
  return {num_set(mesh.references),
          mesh.tags.creases.size(),
          mesh.tags.corners.size(),
          mesh.face_groups.groups.size(),
          shared,
          named_groups(mesh.face_groups.groups, mesh.regions, mesh.references)};
}

Marks marks_of(const HighOrderFile& file) {
  const auto topology = [&]() -> const MeshTopology& { return file.mesh.space.topology(); };
  return {.references = num_set(file.references),
          .groups = file.face_groups.groups.size(),
          .shared = shared_groups(file.face_groups, topology),
          .named = named_groups(file.face_groups.groups, file.regions, file.references)};
}

Marks marks_of(const PolygonMesh& surface) {
  return {.groups = surface.face_groups.groups.size(), .named = named_groups(surface.face_groups.groups, {}, {})};
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
}

void warn_of_names(const Marks& result, std::span<const Output> outputs, std::vector<std::string>& warnings) {
  for (const Output& output : outputs)
    for (const std::string& told : {shared_faces_lost(output, result.shared), names_lost(output, result.named)})
      if (!told.empty()) warnings.push_back(told);
}

}  // namespace subvol::cli

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/losses.h"

#include "subvol/io/left_out.h"

#include <algorithm>

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

}  // namespace

Marks marks_of(const VolumeMesh& mesh) {
  const auto is_set = [](int reference) { return reference != 0; };
  return {static_cast<std::size_t>(std::count_if(mesh.references.begin(), mesh.references.end(), is_set)),
          mesh.tags.creases.size(), mesh.tags.corners.size(), mesh.face_groups.groups.size()};
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

}  // namespace subvol::cli

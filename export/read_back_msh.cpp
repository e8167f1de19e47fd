// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/text_scanner.h"
#include "subvol/export/written_file.h"
#include "subvol/io/nodal_mesh.h"

#include <algorithm>
#include <tuple>

namespace subvol::internal {
namespace {

/// Goes behind the line that begins a section; names of groups, which may be the same words, stand within lines.
void skip_to(TextScanner& scan, const char* section) {
  while (const auto line = scan.line())
    if (*line == section) return;
  scan.word(section);  // the file ends: this says what was expected
}

/// The order of cells in a .msh.
std::vector<std::size_t> msh_order(const CellView& mesh) {
  return sorted_cells(mesh.num_cells(), [&](std::size_t c) {
    return std::tuple(reference_of(mesh.references, c), mesh.order(c), mesh.kinds[c]);
  });
}

/// Compares the text of version 4.1.
void compare_new_msh(const WrittenFile& file, const CellView& wanted) {
  const std::string bytes = read_file(file.path());
  TextScanner scan(file.path().string(), bytes, TextScanner::Comments::none);
  const auto whole = [&](const char* what) { return static_cast<std::size_t>(scan.integer(what)); };
  const auto skip = [&](int num_words) {
    for (int i = 0; i < num_words; ++i) scan.word("a number");
  };
  const std::size_t num_nodes = wanted.positions.size(), num_cells = wanted.num_cells();
  skip_to(scan, "$Nodes");
  skip(1);
  file.same_count("nodes", whole("the number of nodes"), num_nodes);
  skip(5);
  file.same_count("nodes of the block", whole("the number of nodes"), num_nodes);
  for (std::size_t v = 0; v < num_nodes; ++v) file.same(whole("a node's number") == v + 1, "the number of node", v + 1);
  for (std::size_t v = 0; v < num_nodes; ++v)
    for (const double x : wanted.positions[v]) file.same(scan.number("a coordinate") == x, "node", v + 1);
  skip_to(scan, "$Elements");
  const std::size_t num_blocks = whole("the number of blocks");
  const std::size_t num_faces = wanted.faces ? wanted.faces->num_faces() : 0;
  file.same_count("elements", whole("the number of elements"), num_cells + num_faces);
  skip(2);
  const std::vector<std::size_t> order = msh_order(wanted);
  std::size_t element = 0, num_grouped = 0;
  for (std::size_t block = 0; block < num_blocks; ++block) {
    const std::size_t dimension = whole("a dimension");
    skip(1);
    const std::size_t type = whole("a type"), size = whole("a number of elements");
    if (dimension == 2) {
      num_grouped += size;
      for (std::size_t k = 0; k <= size; ++k) scan.line();  // the first call ends the line of the block
      continue;
    }
    for (std::size_t k = 0; k < size; ++k, ++element) {
      file.same(element < num_cells && whole("an element's number") == element + 1, "the number of element",
                element + 1);
      const std::size_t c = order[element];
      file.same(type == static_cast<std::size_t>(gmsh_type(wanted.kinds[c], wanted.order(c))), "the type of element",
                element + 1);
      for (const Index v : wanted.cell(c))
        file.same(whole("a node") == static_cast<std::size_t>(v) + 1, "the nodes of element", element + 1);
    }
  }
  file.same_count("elements of all blocks", element, num_cells);
  file.same_count("faces in groups", num_grouped, num_faces);
}

/// Compares version 2.2 as the reader sees it.
void compare_old_msh(const WrittenFile& file, const CellView& wanted) {
  const NodalMesh found = read_nodal_mesh(file.path());
  file.same_count("nodes", found.positions.size(), wanted.positions.size());
  file.same_count("elements", found.num_cells(), wanted.num_cells());
  for (std::size_t v = 0; v < wanted.positions.size(); ++v)
    file.same(found.positions[v] == wanted.positions[v], "node", v + 1);
  const auto sorted = [](std::span<const Index> nodes) {
    std::vector<Index> result(nodes.begin(), nodes.end());
    std::sort(result.begin(), result.end());
    return result;
  };
  const std::vector<std::size_t> order = msh_order(wanted);
  for (std::size_t e = 0; e < order.size(); ++e) {
    const std::size_t c = order[e];
    file.same(found.kinds[e] == wanted.kinds[c] && found.orders[e] == wanted.order(c), "the type of element", e + 1);
    file.same(sorted(found.cell(e)) == sorted(wanted.cell(c)), "the nodes of element", e + 1);
  }
  std::size_t num_faces = 0;
  for (std::size_t f = 0; wanted.faces && f < wanted.faces->num_faces(); ++f)
    num_faces += wanted.faces->of_face[f].size();
  file.same_count("faces in groups", found.face_groups.faces.size(), num_faces);
}

}  // namespace

void compare_msh(const WrittenFile& file, const CellView& wanted, MshVersion version) {
  version == MshVersion::v2_2 ? compare_old_msh(file, wanted) : compare_new_msh(file, wanted);
}

}  // namespace subvol::internal

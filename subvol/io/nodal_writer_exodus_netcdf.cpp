// SPDX-License-Identifier: GPL-3.0-or-later
// Writes Exodus II, the netCDF files of finite elements. Without netCDF, this is refused.

#include "subvol/base/error.h"
#include "subvol/io/exodus_blocks.h"
#include "subvol/io/nodal_writers.h"

#ifdef SUBVOL_NETCDF
#include "subvol/io/mesh_formats.h"
#include "subvol/io/nodal_sides.h"
#include "subvol/io/positive_numbers.h"

#include <netcdf.h>
#include <netcdf_mem.h>

#include <algorithm>
#include <cstdlib>
#include <mutex>
#endif

namespace subvol::internal {

#ifndef SUBVOL_NETCDF

std::string exodus_bytes(const NodalMesh&) {
  throw InputError(kNoNetcdf);
}

#else

namespace {

/// A file in memory, of which first all dimensions and variables are declared.
class ExodusWriter {
 public:
  ExodusWriter() {
    // The classic format has no times and the like in it, and bytes between variables are filled: equal meshes give
    // equal bytes.
    constexpr std::size_t kFirstSize = 16;  // less than any file: the rest of it would be in the file
    require(nc_create_mem("mesh", NC_64BIT_OFFSET, kFirstSize, &id_));
  }
  ~ExodusWriter() {
    if (id_ >= 0) nc_abort(id_);
  }
  ExodusWriter(const ExodusWriter&) = delete;
  ExodusWriter& operator=(const ExodusWriter&) = delete;

  int dimension(const std::string& name, std::size_t length) {
    int dim = 0;
    require(nc_def_dim(id_, name.c_str(), length, &dim));
    return dim;
  }
  int variable(const std::string& name, nc_type type, std::initializer_list<int> dims) {
    int variable = 0;
    require(nc_def_var(id_, name.c_str(), type, static_cast<int>(dims.size()), dims.begin(), &variable));
    return variable;
  }
  void attribute(int variable, const char* name, const std::string& text) {
    require(nc_put_att_text(id_, variable, name, text.size(), text.data()));
  }
  void attribute(const char* name, float value) {
    require(nc_put_att_float(id_, NC_GLOBAL, name, NC_FLOAT, 1, &value));
  }
  void attribute(const char* name, int value) { require(nc_put_att_int(id_, NC_GLOBAL, name, NC_INT, 1, &value)); }
  void end_declarations() { require(nc_enddef(id_)); }

  void put(int variable, const std::vector<double>& values) {
    require(nc_put_var_double(id_, variable, values.data()));
  }
  void put(int variable, const std::vector<int>& values) { require(nc_put_var_int(id_, variable, values.data())); }
  void put(int variable, const std::vector<char>& text) { require(nc_put_var_text(id_, variable, text.data())); }

  std::string take() {
    NC_memio memory{};
    const int id = id_;
    id_ = -1;
    require(nc_close_memio(id, &memory));
    std::string bytes(static_cast<const char*>(memory.memory), memory.size);
    std::free(memory.memory);
    return bytes;
  }

 private:
  void require(int status) const {
    if (status == NC_ENOMEM) throw std::bad_alloc();
    if (status != NC_NOERR)
      throw InputError(std::string("Exodus: netCDF cannot hold the mesh: ") + nc_strerror(status));
  }
  int id_ = -1;
};

/// A block to be written.
struct WrittenBlock {
  int reference;
  CellKind kind;
  std::vector<std::size_t> cells;
  int id = 0;
  std::string name{};
};

constexpr std::size_t kLongestName = 255;   // that readers take
constexpr std::size_t kLongestSuffix = 20;  // of a kind of cell or a number

/// Cuts a name to so many bytes, not within a character.
std::string exodus_name(std::string name, std::size_t longest = kLongestName) {
  std::size_t end = std::min(name.size(), longest);
  while (end > 0 && end < name.size() && (static_cast<unsigned char>(name[end]) & 0xC0) == 0x80) --end;
  name.resize(end);
  return name;
}

std::vector<WrittenBlock> blocks_of(const NodalMesh& mesh) {
  std::vector<WrittenBlock> blocks;
  for (const std::size_t c : exodus_order(mesh)) {
    const int reference = reference_of(mesh, c);
    if (blocks.empty() || blocks.back().reference != reference || blocks.back().kind != mesh.kinds[c])
      blocks.push_back({reference, mesh.kinds[c], {}});
    blocks.back().cells.push_back(c);
  }
  PositiveNumbers ids(mesh.references);
  const WrittenBlock* first = nullptr;  // of the same reference
  for (WrittenBlock& block : blocks) {
    const bool continues = first && first->reference == block.reference;
    block.id = continues ? ids.take_free() : ids.of(block.reference);
    const std::string number = std::to_string(block.reference), suffix = kind_suffix(block.kind);
    if (continues) {
      block.name = first->name + suffix;
      continue;
    }
    block.name = std::string(kReferenceBlock) + number;
    for (const Group& region : mesh.regions)
      if (region.number == block.reference && !region.name.empty())
        block.name = exodus_name(region.name, kLongestName - kLongestSuffix);
    if (first && block.name == first->name + suffix) block.name += ' ' + number;  // it would continue that one
    first = &block;
  }
  return blocks;
}

std::string type_name(CellKind kind, std::size_t num_nodes) {
  if (kind == CellKind::tet) return num_nodes == 4 ? "TETRA" : "TETRA10";
  if (kind == CellKind::prism) return num_nodes == 6 ? "WEDGE" : "WEDGE" + std::to_string(num_nodes);
  if (kind == CellKind::pyramid) return "PYRAMID";
  return "HEX" + std::to_string(num_nodes);
}

/// Rows of characters of equal length.
std::vector<char> table_of(const std::vector<std::string>& names, std::size_t length) {
  std::vector<char> table(names.size() * length, '\0');
  for (std::size_t i = 0; i < names.size(); ++i)
    std::copy_n(names[i].begin(), std::min(names[i].size(), length - 1),
                table.begin() + static_cast<std::ptrdiff_t>(i * length));
  return table;
}

std::string bytes_of(const NodalMesh& mesh) {
  const int order = common_order(mesh, "Exodus", 2);
  const bool edges_only = order == 2 && has_edge_nodes_only(mesh);
  // Nodes that no element has are left out, but for vertices.
  std::vector<bool> used(mesh.positions.size(), true);
  if (edges_only) used = edge_nodes(mesh, order);
  std::vector<Index> number(mesh.positions.size(), kNoIndex);
  std::vector<double> coordinates[3];
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    if (!used[v]) continue;
    number[v] = static_cast<Index>(coordinates[0].size());
    for (int k = 0; k < 3; ++k) coordinates[k].push_back(mesh.positions[v][k]);
  }
  const auto one_based = [&](Index node) { return number[static_cast<std::size_t>(node)] + 1; };
  const std::vector<WrittenBlock> blocks = blocks_of(mesh);
  const auto num_nodes = [&](CellKind kind) {
    return edges_only ? num_edge_nodes(kind, 2) : num_lattice_points(kind, order);
  };
  std::vector<int> element(mesh.num_cells());  // number of each cell
  int next = 0;
  for (const WrittenBlock& block : blocks)
    for (const std::size_t c : block.cells) element[c] = ++next;

  std::vector<GroupSides> sides = sides_of_groups(mesh, exodus_faces, !edges_only);
  std::vector<int> group_numbers;
  for (const Group& group : mesh.face_groups.groups) group_numbers.push_back(group.number);
  PositiveNumbers positive(group_numbers);
  std::vector<int> set_ids;
  std::vector<std::string> set_names, block_names;
  std::vector<const GroupSides*> sets;
  for (std::size_t g = 0; g < sides.size(); ++g) {
    if (sides[g].sides.empty()) continue;
    sets.push_back(&sides[g]);
    set_ids.push_back(positive.of(group_numbers[g]));
    set_names.push_back(exodus_name(mesh.face_groups.groups[g].name));
  }
  std::vector<int> block_ids;
  for (const WrittenBlock& block : blocks) {
    block_ids.push_back(block.id);
    block_names.push_back(block.name);
  }
  std::size_t longest = 32;  // of names; older readers expect at least so many
  for (const auto* names : {&set_names, &block_names})
    for (const std::string& name : *names) longest = std::max(longest, name.size());

  ExodusWriter file;
  constexpr float kVersion = 5.1f;
  file.attribute("api_version", kVersion);
  file.attribute("version", kVersion);
  file.attribute("floating_point_word_size", 8);
  file.attribute("file_size", 1);
  file.attribute("maximum_name_length", static_cast<int>(longest));
  file.attribute(NC_GLOBAL, "title", "subvol volume mesh");
  const int len_string = file.dimension("len_string", 33), len_name = file.dimension("len_name", longest + 1);
  file.dimension("len_line", 81);
  file.dimension("four", 4);
  const int time_step = file.dimension("time_step", NC_UNLIMITED);
  const int num_dim = file.dimension("num_dim", 3), nodes = file.dimension("num_nodes", coordinates[0].size());
  file.dimension("num_elem", mesh.num_cells());
  const int num_blocks = file.dimension("num_el_blk", blocks.size());
  file.variable("time_whole", NC_DOUBLE, {time_step});
  const int coor_names = file.variable("coor_names", NC_CHAR, {num_dim, len_string});
  int coordinate_variables[3];
  constexpr const char* kCoordinates[] = {"coordx", "coordy", "coordz"};
  for (int k = 0; k < 3; ++k) coordinate_variables[k] = file.variable(kCoordinates[k], NC_DOUBLE, {nodes});
  const int eb_status = file.variable("eb_status", NC_INT, {num_blocks});
  const int eb_prop = file.variable("eb_prop1", NC_INT, {num_blocks});
  file.attribute(eb_prop, "name", "ID");
  const int eb_names = file.variable("eb_names", NC_CHAR, {num_blocks, len_name});
  std::vector<int> connects;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const std::string suffix = std::to_string(b + 1);
    const int elements = file.dimension("num_el_in_blk" + suffix, blocks[b].cells.size());
    const int of_element = file.dimension("num_nod_per_el" + suffix, num_nodes(blocks[b].kind));
    connects.push_back(file.variable("connect" + suffix, NC_INT, {elements, of_element}));
    file.attribute(connects.back(), "elem_type", type_name(blocks[b].kind, num_nodes(blocks[b].kind)));
  }
  struct SetVariables {
    int elements, sides, nodes;
  };
  std::vector<SetVariables> set_variables;
  int ss_status = 0, ss_prop = 0, ss_names = 0, ns_status = 0, ns_prop = 0, ns_names = 0;
  if (!sets.empty()) {
    const int num_side_sets = file.dimension("num_side_sets", sets.size()),
              num_node_sets = file.dimension("num_node_sets", sets.size());
    ss_status = file.variable("ss_status", NC_INT, {num_side_sets});
    ss_prop = file.variable("ss_prop1", NC_INT, {num_side_sets});
    file.attribute(ss_prop, "name", "ID");
    ss_names = file.variable("ss_names", NC_CHAR, {num_side_sets, len_name});
    ns_status = file.variable("ns_status", NC_INT, {num_node_sets});
    ns_prop = file.variable("ns_prop1", NC_INT, {num_node_sets});
    file.attribute(ns_prop, "name", "ID");
    ns_names = file.variable("ns_names", NC_CHAR, {num_node_sets, len_name});
    for (std::size_t s = 0; s < sets.size(); ++s) {
      const std::string suffix = std::to_string(s + 1);
      const int num_sides = file.dimension("num_side_ss" + suffix, sets[s]->sides.size()),
                num_set_nodes = file.dimension("num_nod_ns" + suffix, sets[s]->nodes.size());
      set_variables.push_back({file.variable("elem_ss" + suffix, NC_INT, {num_sides}),
                               file.variable("side_ss" + suffix, NC_INT, {num_sides}),
                               file.variable("node_ns" + suffix, NC_INT, {num_set_nodes})});
    }
  }
  file.end_declarations();

  file.put(coor_names, table_of({"x", "y", "z"}, 33));
  for (int k = 0; k < 3; ++k) file.put(coordinate_variables[k], coordinates[k]);
  file.put(eb_status, std::vector<int>(blocks.size(), 1));
  file.put(eb_prop, block_ids);
  file.put(eb_names, table_of(block_names, longest + 1));
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const std::size_t size = num_nodes(blocks[b].kind);
    const std::vector<std::size_t> places = exodus_places(blocks[b].kind, size);
    std::vector<int> connect(blocks[b].cells.size() * size);
    for (std::size_t e = 0; e < blocks[b].cells.size(); ++e)
      for (std::size_t i = 0; i < size; ++i)
        connect[e * size + places[i]] = one_based(mesh.cell(blocks[b].cells[e])[i]);
    file.put(connects[b], connect);
  }
  if (sets.empty()) return file.take();
  const std::vector<int> present(sets.size(), 1);
  file.put(ss_status, present);
  file.put(ss_prop, set_ids);
  file.put(ss_names, table_of(set_names, longest + 1));
  file.put(ns_status, present);
  file.put(ns_prop, set_ids);
  file.put(ns_names, table_of(set_names, longest + 1));
  for (std::size_t s = 0; s < sets.size(); ++s) {
    std::vector<int> elements, numbers, set_nodes;
    for (const Side& side : sets[s]->sides) {
      elements.push_back(element[side.cell]);
      numbers.push_back(side.number);
    }
    for (const Index node : sets[s]->nodes) set_nodes.push_back(one_based(node));
    file.put(set_variables[s].elements, elements);
    file.put(set_variables[s].sides, numbers);
    file.put(set_variables[s].nodes, set_nodes);
  }
  return file.take();
}

}  // namespace

std::string exodus_bytes(const NodalMesh& mesh) {
  const std::lock_guard lock(netcdf_lock());
  return bytes_of(mesh);
}

#endif

}  // namespace subvol::internal

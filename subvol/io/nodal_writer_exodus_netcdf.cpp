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

std::string exodus_bytes(const NodalMesh&) { throw InputError(kNoNetcdf); }

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
constexpr std::size_t kStringLength = 33;   // of the names of axes, with the zero at the end

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

/// The side sets and node sets of a file, one of each for a group that has faces.
struct WrittenSets {
  std::vector<GroupSides> groups;
  std::vector<int> ids;
  std::vector<std::string> names;
};

WrittenSets sets_of(const NodalMesh& mesh, bool with_centers) {
  std::vector<GroupSides> sides = sides_of_groups(mesh, exodus_faces, with_centers);
  std::vector<int> numbers;
  for (const Group& group : mesh.face_groups.groups) numbers.push_back(group.number);
  PositiveNumbers positive(numbers);
  WrittenSets sets;
  for (std::size_t g = 0; g < sides.size(); ++g) {
    if (sides[g].sides.empty()) continue;
    sets.groups.push_back(std::move(sides[g]));
    sets.ids.push_back(positive.of(numbers[g]));
    sets.names.push_back(exodus_name(mesh.face_groups.groups[g].name));
  }
  return sets;
}

/// One mesh on its way into a file: first all dimensions and variables are declared, then the values are put.
class ExodusMesh {
 public:
  explicit ExodusMesh(const NodalMesh& mesh);
  std::string write();

 private:
  /// Variables of a list of blocks, side sets or node sets.
  struct ListVariables {
    int status, ids, names;
  };
  struct SetVariables {
    int elements, sides, nodes;
  };

  void number_nodes();
  void declare();
  void declare_blocks(int num_blocks);
  void declare_sets();
  ListVariables declare_list(const std::string& prefix, int length);
  void put_nodes();
  void put_blocks();
  void put_sets();
  void put_list(const ListVariables& list, const std::vector<int>& ids, const std::vector<std::string>& names);

  std::size_t num_nodes(CellKind kind) const {
    return edges_only_ ? num_edge_nodes(kind, 2) : num_lattice_points(kind, order_);
  }
  int one_based(Index node) const { return number_[static_cast<std::size_t>(node)] + 1; }

  const NodalMesh& mesh_;
  int order_;
  bool edges_only_;            // without the nodes inside faces and cells
  std::vector<Index> number_;  // of each node in the file; kNoIndex if it is left out
  std::vector<double> coordinates_[3];
  std::vector<WrittenBlock> blocks_;
  WrittenSets sets_;
  std::size_t longest_ = 32;  // of names; older readers expect at least so many
  ExodusWriter file_;
  int len_name_ = 0;  // a dimension; the other numbers are those of variables
  int axis_names_ = 0, axes_[3]{};
  ListVariables block_list_{}, side_set_list_{}, node_set_list_{};
  std::vector<int> connects_;
  std::vector<SetVariables> of_sets_;
};

ExodusMesh::ExodusMesh(const NodalMesh& mesh)
    : mesh_(mesh),
      order_(common_order(mesh, "Exodus", 2)),
      edges_only_(order_ == 2 && has_edge_nodes_only(mesh)),
      blocks_(blocks_of(mesh)),
      sets_(sets_of(mesh, !edges_only_)) {
  number_nodes();
  for (const WrittenBlock& block : blocks_) longest_ = std::max(longest_, block.name.size());
  for (const std::string& name : sets_.names) longest_ = std::max(longest_, name.size());
}

/// Numbers the nodes of the file. Nodes that no element has are left out, but for vertices.
void ExodusMesh::number_nodes() {
  std::vector<bool> used(mesh_.positions.size(), true);
  if (edges_only_) used = edge_nodes(mesh_, order_);
  number_.assign(mesh_.positions.size(), kNoIndex);
  for (std::size_t v = 0; v < mesh_.positions.size(); ++v) {
    if (!used[v]) continue;
    number_[v] = static_cast<Index>(coordinates_[0].size());
    for (int k = 0; k < 3; ++k) coordinates_[k].push_back(mesh_.positions[v][k]);
  }
}

std::string ExodusMesh::write() {
  declare();
  put_nodes();
  put_blocks();
  if (!sets_.ids.empty()) put_sets();
  return file_.take();
}

void ExodusMesh::declare() {
  constexpr float kExodusVersion = 5.1f;
  file_.attribute("api_version", kExodusVersion);
  file_.attribute("version", kExodusVersion);
  file_.attribute("floating_point_word_size", 8);
  file_.attribute("file_size", 1);
  file_.attribute("maximum_name_length", static_cast<int>(longest_));
  file_.attribute(NC_GLOBAL, "title", "subvol volume mesh");
  const int len_string = file_.dimension("len_string", kStringLength);
  len_name_ = file_.dimension("len_name", longest_ + 1);
  file_.dimension("len_line", 81);
  file_.dimension("four", 4);
  const int time_step = file_.dimension("time_step", NC_UNLIMITED);
  const int num_dim = file_.dimension("num_dim", 3), nodes = file_.dimension("num_nodes", coordinates_[0].size());
  file_.dimension("num_elem", mesh_.num_cells());
  const int num_blocks = file_.dimension("num_el_blk", blocks_.size());
  file_.variable("time_whole", NC_DOUBLE, {time_step});
  axis_names_ = file_.variable("coor_names", NC_CHAR, {num_dim, len_string});
  constexpr const char* kCoordinates[] = {"coordx", "coordy", "coordz"};
  for (int k = 0; k < 3; ++k) axes_[k] = file_.variable(kCoordinates[k], NC_DOUBLE, {nodes});
  declare_blocks(num_blocks);
  if (!sets_.ids.empty()) declare_sets();
  file_.end_declarations();
}

ExodusMesh::ListVariables ExodusMesh::declare_list(const std::string& prefix, int length) {
  ListVariables list{};
  list.status = file_.variable(prefix + "_status", NC_INT, {length});
  list.ids = file_.variable(prefix + "_prop1", NC_INT, {length});
  file_.attribute(list.ids, "name", "ID");
  list.names = file_.variable(prefix + "_names", NC_CHAR, {length, len_name_});
  return list;
}

void ExodusMesh::declare_blocks(int num_blocks) {
  block_list_ = declare_list("eb", num_blocks);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const std::string suffix = std::to_string(b + 1);
    const std::size_t size = num_nodes(blocks_[b].kind);
    const int elements = file_.dimension("num_el_in_blk" + suffix, blocks_[b].cells.size());
    const int of_element = file_.dimension("num_nod_per_el" + suffix, size);
    connects_.push_back(file_.variable("connect" + suffix, NC_INT, {elements, of_element}));
    file_.attribute(connects_.back(), "elem_type", type_name(blocks_[b].kind, size));
  }
}

void ExodusMesh::declare_sets() {
  const int num_side_sets = file_.dimension("num_side_sets", sets_.ids.size()),
            num_node_sets = file_.dimension("num_node_sets", sets_.ids.size());
  side_set_list_ = declare_list("ss", num_side_sets);
  node_set_list_ = declare_list("ns", num_node_sets);
  for (std::size_t s = 0; s < sets_.groups.size(); ++s) {
    const std::string suffix = std::to_string(s + 1);
    const int num_sides = file_.dimension("num_side_ss" + suffix, sets_.groups[s].sides.size()),
              num_nodes = file_.dimension("num_nod_ns" + suffix, sets_.groups[s].nodes.size());
    of_sets_.push_back({file_.variable("elem_ss" + suffix, NC_INT, {num_sides}),
                        file_.variable("side_ss" + suffix, NC_INT, {num_sides}),
                        file_.variable("node_ns" + suffix, NC_INT, {num_nodes})});
  }
}

void ExodusMesh::put_list(const ListVariables& list, const std::vector<int>& ids,
                          const std::vector<std::string>& names) {
  file_.put(list.status, std::vector<int>(ids.size(), 1));  // all are there
  file_.put(list.ids, ids);
  file_.put(list.names, table_of(names, longest_ + 1));
}

void ExodusMesh::put_nodes() {
  file_.put(axis_names_, table_of({"x", "y", "z"}, kStringLength));
  for (int k = 0; k < 3; ++k) file_.put(axes_[k], coordinates_[k]);
}

void ExodusMesh::put_blocks() {
  std::vector<int> ids;
  std::vector<std::string> names;
  for (const WrittenBlock& block : blocks_) {
    ids.push_back(block.id);
    names.push_back(block.name);
  }
  put_list(block_list_, ids, names);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const std::size_t size = num_nodes(blocks_[b].kind);
    const std::vector<std::size_t> places = exodus_places(blocks_[b].kind, size);
    std::vector<int> connect(blocks_[b].cells.size() * size);
    for (std::size_t e = 0; e < blocks_[b].cells.size(); ++e)
      for (std::size_t i = 0; i < size; ++i)
        connect[e * size + places[i]] = one_based(mesh_.cell(blocks_[b].cells[e])[i]);
    file_.put(connects_[b], connect);
  }
}

void ExodusMesh::put_sets() {
  put_list(side_set_list_, sets_.ids, sets_.names);
  put_list(node_set_list_, sets_.ids, sets_.names);
  std::vector<int> element(mesh_.num_cells());  // number of each cell
  int next = 0;
  for (const WrittenBlock& block : blocks_)
    for (const std::size_t c : block.cells) element[c] = ++next;
  for (std::size_t s = 0; s < sets_.groups.size(); ++s) {
    std::vector<int> elements, numbers, nodes;
    for (const Side& side : sets_.groups[s].sides) {
      elements.push_back(element[side.cell]);
      numbers.push_back(side.number);
    }
    for (const Index node : sets_.groups[s].nodes) nodes.push_back(one_based(node));
    file_.put(of_sets_[s].elements, elements);
    file_.put(of_sets_[s].sides, numbers);
    file_.put(of_sets_[s].nodes, nodes);
  }
}

}  // namespace

std::string exodus_bytes(const NodalMesh& mesh) {
  const std::lock_guard lock(netcdf_lock());
  return ExodusMesh(mesh).write();
}

#endif

}  // namespace subvol::internal

// SPDX-License-Identifier: GPL-3.0-or-later
// Reads Exodus II, the netCDF files of finite elements. Without netCDF, this is refused.

#include "subvol/base/error.h"
#include "subvol/base/sort_unique.h"
#include "subvol/io/exodus_blocks.h"
#include "subvol/io/nodal_formats.h"

#ifdef SUBVOL_NETCDF
#include "subvol/base/text_scanner.h"
#include "subvol/io/classic_netcdf.h"
#include "subvol/io/left_out.h"
#include "subvol/io/mesh_formats.h"
#include "subvol/io/nodal_sides.h"

#include <netcdf.h>
#include <netcdf_mem.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#endif

namespace subvol::internal {

#ifndef SUBVOL_NETCDF

NodalMesh parse_exodus(const std::string& name, std::string_view, const std::string&) {
  throw InputError(name + ": " + kNoNetcdf);
}

#else

namespace {

/// A file in memory. All numbers are bounded by its size before memory is taken for them.
class ExodusFile {
 public:
  ExodusFile(const std::string& name, std::string_view bytes) : name_(name) {
    // netCDF does not write to what it only reads.
    const int status = nc_open_mem("mesh", NC_NOWRITE, bytes.size(), const_cast<char*>(bytes.data()), &id_);
    if (status != NC_NOERR) fail(std::string("no netCDF file: ") + nc_strerror(status));
    int format = 0;
    nc_inq_format(id_, &format);
    constexpr std::size_t kMostCompressed = 1032;  // zlib's largest ratio
    const bool packed = format == NC_FORMAT_NETCDF4 || format == NC_FORMAT_NETCDF4_CLASSIC;
    most_bytes_ = bytes.size() * (packed ? kMostCompressed : 1);
    if (!packed) require_whole(bytes.size());
  }
  ~ExodusFile() { nc_close(id_); }
  ExodusFile(const ExodusFile&) = delete;
  ExodusFile& operator=(const ExodusFile&) = delete;

  [[noreturn]] void fail(const std::string& what) const { throw InputError(name_ + ": " + what); }

  /// Returns the length of a dimension; nothing if there is none of that name.
  std::optional<std::size_t> dimension(const std::string& name) const {
    int dim = 0;
    std::size_t length = 0;
    if (nc_inq_dimid(id_, name.c_str(), &dim) != NC_NOERR || nc_inq_dimlen(id_, dim, &length) != NC_NOERR)
      return std::nullopt;
    return length;
  }
  bool has(const std::string& name) const {
    int variable = 0;
    return nc_inq_varid(id_, name.c_str(), &variable) == NC_NOERR;
  }

  std::vector<double> reals(const std::string& name, std::size_t count) const {
    const int variable = variable_of(name, count);
    std::vector<double> values(count);
    require_read(name, nc_get_var_double(id_, variable, values.data()));
    return values;
  }
  std::vector<long long> integers(const std::string& name, std::size_t count) const {
    const int variable = variable_of(name, count);
    std::vector<long long> values(count);
    require_read(name, nc_get_var_longlong(id_, variable, values.data()));
    return values;
  }
  /// Returns the rows of a table of characters, without what follows a zero and blanks at the end; empty names if there
  /// is no such table.
  std::vector<std::string> names(const std::string& name, std::size_t count) const {
    std::vector<std::string> rows(count);
    int variable = 0, num_dims = 0;
    nc_type type = 0;
    if (nc_inq_varid(id_, name.c_str(), &variable) != NC_NOERR) return rows;
    int dims[NC_MAX_VAR_DIMS];
    std::size_t length = 0;
    if (nc_inq_var(id_, variable, nullptr, &type, &num_dims, dims, nullptr) != NC_NOERR || type != NC_CHAR ||
        num_dims != 2 || nc_inq_dimlen(id_, dims[1], &length) != NC_NOERR || length == 0)
      fail(name + ": expected a table of characters");
    std::vector<char> text(size_of(name, count, length));
    variable_of(name, text.size());
    require_read(name, nc_get_var_text(id_, variable, text.data()));
    for (std::size_t i = 0; i < count; ++i) {
      const std::string_view row(text.data() + i * length, length);
      const std::string_view used = row.substr(0, row.find('\0'));
      rows[i] = std::string(used.substr(0, used.find_last_not_of(" \t\r\n") + 1));
    }
    return rows;
  }
  /// Returns an attribute of a variable that is a text; empty if there is none.
  std::string attribute(const std::string& variable_name, const char* name) const {
    int variable = 0;
    std::size_t length = 0;
    nc_type type = 0;
    if (nc_inq_varid(id_, variable_name.c_str(), &variable) != NC_NOERR ||
        nc_inq_att(id_, variable, name, &type, &length) != NC_NOERR || type != NC_CHAR || length > most_bytes_)
      return {};
    std::string text(length, '\0');
    if (nc_get_att_text(id_, variable, name, text.data()) != NC_NOERR) return {};
    return text.substr(0, text.find('\0'));
  }
  /// The product of two counts. InputError: more than the file can hold.
  std::size_t size_of(const std::string& name, std::size_t rows, std::size_t columns) const {
    if (columns > 0 && rows > most_bytes_ / columns) fail(name + ": more entries than the file can hold");
    return rows * columns;
  }

 private:
  /// Throws InputError if the variables are larger than the file: netCDF reads zeros behind its end.
  void require_whole(std::size_t file_size) const {
    int num_variables = 0;
    nc_inq_nvars(id_, &num_variables);
    std::size_t sum = 0;
    for (int variable = 0; variable < num_variables; ++variable) {
      nc_type type = 0;
      int num_dims = 0, dims[NC_MAX_VAR_DIMS];
      nc_inq_var(id_, variable, nullptr, &type, &num_dims, dims, nullptr);
      std::size_t size = 0;
      nc_inq_type(id_, type, nullptr, &size);
      for (int k = 0; k < num_dims; ++k) {
        std::size_t length = 0;
        nc_inq_dimlen(id_, dims[k], &length);
        if (length > 0 && size > file_size / length) fail("is cut short: a variable is larger than the file");
        size *= length;
      }
      sum += size;
      if (sum > file_size) fail("is cut short: its variables are larger than the file");
    }
  }
  /// Finds a variable. InputError: there is none, or it has not this number of entries.
  int variable_of(const std::string& name, std::size_t count) const {
    int variable = 0, num_dims = 0;
    if (nc_inq_varid(id_, name.c_str(), &variable) != NC_NOERR) fail("expected the variable " + name);
    int dims[NC_MAX_VAR_DIMS];
    if (nc_inq_var(id_, variable, nullptr, nullptr, &num_dims, dims, nullptr) != NC_NOERR)
      fail(name + ": cannot be read");
    std::size_t total = 1;
    for (int k = 0; k < num_dims; ++k) {
      std::size_t length = 0;
      nc_inq_dimlen(id_, dims[k], &length);
      total = size_of(name, total, length);
    }
    if (total != count || count > most_bytes_)
      fail(name + ": expected " + std::to_string(count) + " entries, found " + std::to_string(total));
    return variable;
  }
  void require_read(const std::string& name, int status) const {
    if (status != NC_NOERR) fail(name + ": " + nc_strerror(status));
  }

  std::string name_;
  int id_ = 0;
  std::size_t most_bytes_ = 0;
};

class ExodusParser {
 public:
  ExodusParser(const std::string& name, std::string_view bytes) : file_(name, bytes), cells_(mesh_) {}

  NodalMesh parse() {
    read_nodes();
    read_blocks();
    name_references();
    read_side_sets();
    read_node_sets();
    left_out_.tell(mesh_.warnings);
    return std::move(mesh_);
  }

 private:
  struct Block {
    std::string name;
    long long id;
    std::optional<CellKind> kind;  ///< none: elements that are no cells
    std::size_t num_elements, first_cell;
    long long first_element = 1;  ///< its number: elements are numbered from 1 through all blocks
  };

  std::size_t count_of(const std::string& dimension) const {
    const std::size_t n = file_.dimension(dimension).value_or(0);
    if (n > static_cast<std::size_t>(std::numeric_limits<Index>::max()))
      file_.fail(dimension + ": expected at most 2^31 - 1");
    return n;
  }
  int number_of(long long id, const std::string& what) const {
    if (id < 0 || id > std::numeric_limits<int>::max()) file_.fail(what + ": expected a positive number of 32 bits");
    return static_cast<int>(id);
  }

  void read_nodes() {
    const std::size_t n = count_of("num_nodes");
    if (!file_.dimension("num_nodes") || !file_.dimension("num_dim")) file_.fail("no Exodus file: expected num_nodes");
    if (count_of("num_dim") != 3)
      file_.fail("a mesh whose dimension is " + std::to_string(count_of("num_dim")) + ": expected 3, as of a solid");
    std::vector<double> x, y, z;
    if (file_.has("coord")) {
      const std::vector<double> all = file_.reals("coord", file_.size_of("coord", 3, n));
      const auto first = all.begin(), step = first + static_cast<std::ptrdiff_t>(n);
      x.assign(first, step);
      y.assign(step, step + (step - first));
      z.assign(step + (step - first), all.end());
    } else {
      x = file_.reals("coordx", n), y = file_.reals("coordy", n), z = file_.reals("coordz", n);
    }
    for (std::size_t v = 0; v < n; ++v) {
      mesh_.positions.emplace_back(x[v], y[v], z[v]);
      if (!mesh_.positions.back().allFinite())
        file_.fail("node " + std::to_string(v + 1) + ": expected finite coordinates");
    }
    num_nodes_ = n;
  }

  std::vector<long long> ids(const std::string& variable, std::size_t count) const {
    if (file_.has(variable)) return file_.integers(variable, count);
    std::vector<long long> numbers(count);
    for (std::size_t i = 0; i < count; ++i) numbers[i] = static_cast<long long>(i) + 1;
    return numbers;
  }

  void read_blocks() {
    const std::size_t n = count_of("num_el_blk");
    const std::vector<long long> numbers = ids("eb_prop1", file_.size_of("eb_prop1", n, 1));
    const std::vector<std::string> names = file_.names("eb_names", n);
    long long first_element = 1;
    for (std::size_t b = 0; b < n; ++b) {
      const std::string number = std::to_string(b + 1), connect = "connect" + number;
      const std::size_t size = count_of("num_el_in_blk" + number);
      const std::string type = upper_case(file_.attribute(connect, "elem_type"));
      Block block{names[b], numbers[b], std::nullopt, size, mesh_.num_cells(), first_element};
      first_element += static_cast<long long>(size);
      if (size > 0) read_block(block, connect, type, count_of("num_nod_per_el" + number));
      blocks_.push_back(std::move(block));
    }
  }

  void read_block(Block& block, const std::string& connect, const std::string& type, std::size_t size) {
    if (type.starts_with("PYR")) block.kind = CellKind::pyramid;
    if (type.starts_with("HEX")) block.kind = CellKind::hex;
    if (type.starts_with("WED")) block.kind = CellKind::prism;
    if (type.starts_with("TET")) block.kind = CellKind::tet;
    if (!block.kind) {
      left_out_.add("elements of type " + (type.empty() ? "(none)" : type), block.num_elements);
      return;
    }
    const CellKind kind = *block.kind;
    const int order = size == num_corners(kind) ? 1 : 2;
    if (kind == CellKind::pyramid && order > 1) file_.fail(connect + ": " + kNoCurvedPyramids);
    if (!NodalCells::is_size(kind, order, size))
      file_.fail(connect + ": " + in_quotes(type) + " with " + std::to_string(size) +
                 " nodes is not read, expected HEX8, 20, 27, WEDGE6, 15, 18, TET4, 10 or PYRAMID5");
    const std::vector<std::size_t> places = exodus_places(kind, size);
    const std::vector<long long> nodes = file_.integers(connect, file_.size_of(connect, block.num_elements, size));
    std::vector<Index> cell(size);
    for (std::size_t e = 0; e < block.num_elements; ++e) {
      for (std::size_t i = 0; i < size; ++i) {
        const long long node = nodes[e * size + places[i]];
        if (node < 1 || node > static_cast<long long>(num_nodes_))
          file_.fail(connect + ": element " + std::to_string(e + 1) + " names node " + std::to_string(node) + " of " +
                     std::to_string(num_nodes_));
        cell[i] = static_cast<Index>(node - 1);
      }
      cells_.add(kind, order, NodeOrdering::vtk, cell);
    }
  }

  /// For each block, the place of the one whose name it continues for another kind of cell, which stands before it with
  /// no others between them; its own place if there is none.
  std::vector<std::size_t> first_blocks() const {
    std::vector<std::size_t> firsts;
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      const Block& block = blocks_[b];
      const std::size_t before = b > 0 ? firsts.back() : b;
      const bool continues = b > 0 && block.kind && blocks_[before].kind && !blocks_[before].name.empty() &&
                             block.name == blocks_[before].name + kind_suffix(*block.kind);
      firsts.push_back(continues ? before : b);
    }
    return firsts;
  }
  /// The reference in the name of a block that subvol may have named.
  static std::optional<int> named_reference(const Block& block) {
    if (!block.name.starts_with(kReferenceBlock)) return std::nullopt;
    const auto number = parse_integer(std::string_view(block.name).substr(kReferenceBlock.size()));
    if (!number || std::abs(*number) > std::numeric_limits<int>::max()) return std::nullopt;
    return static_cast<int>(*number);
  }

  /// A block stands for the reference in its name, unless that is the number of another block, or in the name of
  /// another one: two regions would become one.
  void name_references() {
    const auto is_of_cells = [](const Block& block) { return block.kind.has_value(); };
    const bool has_one = std::count_if(blocks_.begin(), blocks_.end(), is_of_cells) == 1;
    const std::vector<std::size_t> firsts = first_blocks();
    std::set<long long> numbers;
    std::map<int, int> num_named;
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      if (!blocks_[b].kind || firsts[b] != b) continue;
      numbers.insert(blocks_[b].id);
      if (const auto named = named_reference(blocks_[b])) ++num_named[*named];
    }
    mesh_.references.assign(mesh_.num_cells(), 0);
    std::set<int> named_regions;
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      const Block &block = blocks_[b], &first = blocks_[firsts[b]];
      if (!block.kind) continue;
      std::optional<int> own = named_reference(first);
      if (own && *own != first.id && (num_named[*own] > 1 || numbers.contains(*own))) own.reset();
      if (has_one && !own && first.name.empty()) continue;  // nothing is told by a single block without a name
      const int reference = own ? *own : number_of(first.id, "eb_prop1");
      std::fill_n(mesh_.references.begin() + static_cast<std::ptrdiff_t>(block.first_cell), block.num_elements,
                  reference);
      if (!own && !first.name.empty() && named_regions.insert(reference).second)
        mesh_.regions.push_back({first.name, reference, 3});
    }
  }

  void read_side_sets() {
    const std::size_t n = count_of("num_side_sets");
    const std::vector<long long> numbers = ids("ss_prop1", file_.size_of("ss_prop1", n, 1));
    side_names_ = file_.names("ss_names", n);
    const auto faces = faces_by_kind(exodus_faces);
    GroupList groups;
    std::vector<Index> corners, group_of_set;
    for (std::size_t s = 0; s < n; ++s) {
      const std::string number = std::to_string(s + 1);
      const std::size_t size = count_of("num_side_ss" + number);
      const Index group = groups.by_number(number_of(numbers[s], "ss_prop1"));
      group_of_set.push_back(group);
      if (size == 0) continue;
      const std::vector<long long> elements = file_.integers("elem_ss" + number, size),
                                   sides = file_.integers("side_ss" + number, size);
      for (std::size_t i = 0; i < size; ++i) {
        const std::optional<std::size_t> cell = cell_of(elements[i], "elem_ss" + number);
        if (!cell) {
          left_out_.add("sides of elements that are no cells");
          continue;
        }
        const auto& of_cell = faces[static_cast<std::size_t>(mesh_.kinds[*cell])];
        if (sides[i] < 1 || sides[i] > static_cast<long long>(of_cell.size()))
          file_.fail("side_ss" + number + ": an element has no side " + std::to_string(sides[i]));
        corners.clear();
        for (const int k : of_cell[static_cast<std::size_t>(sides[i]) - 1])
          corners.push_back(mesh_.cell(*cell)[static_cast<std::size_t>(k)]);
        add_face(mesh_, corners, group);
      }
    }
    mesh_.face_groups.groups = groups.take();
    for (std::size_t s = 0; s < n; ++s)
      if (Group& group = mesh_.face_groups.groups[static_cast<std::size_t>(group_of_set[s])]; group.name.empty())
        group.name = side_names_[s];
  }

  /// The cell of an element; nothing if its block has none.
  std::optional<std::size_t> cell_of(long long element, const std::string& where) const {
    const auto behind = std::ranges::upper_bound(blocks_, element, {}, &Block::first_element);
    if (behind == blocks_.begin() ||
        element - behind[-1].first_element >= static_cast<long long>(behind[-1].num_elements))
      file_.fail(where + ": there is no element " + std::to_string(element));
    const Block& block = behind[-1];
    if (!block.kind) return std::nullopt;
    return block.first_cell + static_cast<std::size_t>(element - block.first_element);
  }

  /// Node sets that hold all corners of some faces of the boundary become groups of these faces. Sets of the nodes of
  /// side sets say nothing new: those of the same name, and those without one whose corners are the ones of the side
  /// set of their number.
  void read_node_sets() {
    const std::size_t n = count_of("num_node_sets");
    const std::vector<std::string> names = file_.names("ns_names", n);
    const std::vector<long long> numbers = ids("ns_prop1", file_.size_of("ns_prop1", n, 1));
    const std::set<std::string> side_names(side_names_.begin(), side_names_.end());
    list_groups();
    long long next_free = 1;
    std::optional<BoundaryOfNodes> boundary;
    for (std::size_t s = 0; s < n; ++s) {
      const bool is_known = names[s].empty() ? holds_corners_of_group(s, numbers[s]) : side_names.contains(names[s]);
      if (is_known) continue;
      if (!boundary) boundary.emplace(mesh_);
      const auto faces = boundary->faces_of(nodes_of_set(s));
      auto& groups = mesh_.face_groups.groups;
      const auto is_free = [&](long long number) {
        return number > 0 && number <= std::numeric_limits<int>::max() &&
               !group_of_number_.contains(static_cast<int>(number));
      };
      long long number = numbers[s];
      if (!names[s].empty() && !is_free(number)) {
        while (!is_free(next_free)) ++next_free;
        number = next_free;
      }
      if (faces.empty() || !is_free(number)) {
        left_out_.add(faces.empty() ? "node sets of no faces, or of all" : "node sets with the number of a side set");
        continue;
      }
      const auto group = static_cast<Index>(groups.size());
      groups.push_back({names[s], static_cast<int>(number), 2});
      group_of_number_.emplace(static_cast<int>(number), group);
      corners_of_group_.emplace_back();
      for (const auto face : faces) {
        add_face(mesh_, face, group);
        corners_of_group_.back().insert(corners_of_group_.back().end(), face.begin(), face.end());
      }
      sort_unique(corners_of_group_.back());
    }
  }

  /// Notes the numbers and the corners of the groups so far.
  void list_groups() {
    const VolumeFaceGroups& all = mesh_.face_groups;
    for (std::size_t g = 0; g < all.groups.size(); ++g)
      group_of_number_.emplace(all.groups[g].number, static_cast<Index>(g));
    corners_of_group_.resize(all.groups.size());
    for (const GroupedFace& entry : all.faces)
      for (const Index v : entry.face)
        if (v != kNoIndex) corners_of_group_[static_cast<std::size_t>(entry.group)].push_back(v);
    for (std::vector<Index>& corners : corners_of_group_) sort_unique(corners);
  }

  /// The nodes of a set, each once and ascending.
  std::vector<Index> nodes_of_set(std::size_t set) const {
    const std::string suffix = std::to_string(set + 1);
    const std::size_t size = count_of("num_nod_ns" + suffix);
    std::vector<Index> nodes;
    if (size == 0) return nodes;
    for (const long long node : file_.integers("node_ns" + suffix, size))
      if (node >= 1 && node <= static_cast<long long>(num_nodes_)) nodes.push_back(static_cast<Index>(node - 1));
    sort_unique(nodes);
    return nodes;
  }

  bool holds_corners_of_group(std::size_t set, long long number) {
    if (number <= 0 || number > std::numeric_limits<int>::max()) return false;
    const auto group = group_of_number_.find(static_cast<int>(number));
    if (group == group_of_number_.end()) return false;
    const auto place = static_cast<std::size_t>(group->second);
    if (!mesh_.face_groups.groups[place].name.empty()) return false;
    if (is_corner_.empty()) {
      is_corner_.assign(mesh_.positions.size(), false);
      for (std::size_t c = 0; c < mesh_.num_cells(); ++c)
        for (const Index v : mesh_.cell(c).first(num_corners(mesh_.kinds[c])))
          is_corner_[static_cast<std::size_t>(v)] = true;
    }
    std::vector<Index> found = nodes_of_set(set);
    std::erase_if(found, [&](Index node) { return !is_corner_[static_cast<std::size_t>(node)]; });
    return found == corners_of_group_[place];
  }

  ExodusFile file_;
  NodalMesh mesh_;
  NodalCells cells_;
  LeftOut left_out_;
  std::vector<Block> blocks_;
  std::vector<std::string> side_names_;
  std::map<int, Index> group_of_number_;               ///< places of the groups; see list_groups
  std::vector<std::vector<Index> > corners_of_group_;  ///< ascending
  std::vector<bool> is_corner_;  ///< of the nodes: one of a cell's corners; empty until it is asked for
  std::size_t num_nodes_ = 0;
};

}  // namespace

NodalMesh parse_exodus(const std::string& name, std::string_view bytes, const std::string&) {
  require_sound_netcdf_header(name, bytes);
  const std::lock_guard lock(netcdf_lock());
  return ExodusParser(name, bytes).parse();
}

#endif

}  // namespace subvol::internal

bool subvol::has_exodus() {
#ifdef SUBVOL_NETCDF
  return true;
#else
  return false;
#endif
}

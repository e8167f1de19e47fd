// SPDX-License-Identifier: GPL-3.0-or-later
// Reads CGNS by its own library. Without that library, this is refused.

#include "subvol/base/error.h"
#include "subvol/io/nodal_formats.h"

#ifdef SUBVOL_CGNS
#include "subvol/base/text_scanner.h"
#include "subvol/io/exodus_blocks.h"
#include "subvol/io/left_out.h"
#include "subvol/io/mesh_formats.h"

#include <cgnslib.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#endif

namespace subvol::internal {

#ifndef SUBVOL_CGNS

NodalMesh parse_cgns(const std::string& name, std::string_view, const std::string&) {
  throw InputError(name +
                   ": CGNS: this program was built without the CGNS library; install libcgns-dev and build it "
                   "again, or take another format");
}

#else

namespace {

/// Throws InputError unless the file begins as HDF5 or as ADF, the older format: the library ends the program if a
/// header is neither.
void require_cgns_header(const std::string& name, std::string_view bytes) {
  constexpr std::string_view kHdf5("\x89HDF\r\n\x1a\n", 8), kAdf = "ADF Database Version", kFormats = "BLCN";
  constexpr std::size_t kAdfAt = 4, kFormatAt = 100, kAdfHeader = 186;
  constexpr std::pair<std::size_t, std::string_view> kMarks[] = {{32, "AdF0"},  {64, "AdF1"},  {96, "AdF2"},
                                                                 {102, "AdF3"}, {130, "AdF4"}, {182, "AdF5"}};
  if (bytes.starts_with(kHdf5)) return;
  const auto holds = [&](std::size_t at, std::string_view text) { return bytes.substr(at, text.size()) == text; };
  const bool is_adf = bytes.size() >= kAdfHeader && holds(kAdfAt, kAdf) &&
                      std::ranges::all_of(kMarks, [&](const auto& mark) { return holds(mark.first, mark.second); });
  if (!is_adf || kFormats.find(bytes[kFormatAt]) == std::string_view::npos)
    throw InputError(name + ": no CGNS file: it begins neither as HDF5 nor as ADF");
}

/// A copy of the bytes on the disk, since the library opens nothing else.
class CopyOnDisk {
 public:
  explicit CopyOnDisk(std::string_view bytes) {
    const int file = mkstemp(path_.data());
    if (file < 0) throw InputError("CGNS: no temporary file can be made: " + path_);
    bool is_whole = true;
    while (!bytes.empty() && is_whole) {
      const ssize_t written = write(file, bytes.data(), bytes.size());
      is_whole = written > 0 || (written < 0 && errno == EINTR);
      if (written > 0) bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    close(file);
    if (is_whole) return;
    remove_name();
    throw InputError("CGNS: the temporary file cannot be written: " + path_);
  }
  ~CopyOnDisk() { remove_name(); }
  CopyOnDisk(const CopyOnDisk&) = delete;
  CopyOnDisk& operator=(const CopyOnDisk&) = delete;
  const char* path() const { return path_.c_str(); }
  /// Removes the file once it has been opened: so it does not outlive a program that is killed.
  void remove_name() {
    if (!path_.empty()) unlink(path_.c_str());
    path_.clear();
  }

 private:
  std::string path_ = (std::filesystem::temp_directory_path() / "subvol-cgns-XXXXXX").string();
};

/// The kind and order of a type of element that is a cell.
struct CellType {
  CellKind kind;
  int order;
};

std::optional<CellType> cell_type(CGNS_ENUMT(ElementType_t) type) {
  switch (type) {
    case CGNS_ENUMV(TETRA_4): return CellType{CellKind::tet, 1};
    case CGNS_ENUMV(TETRA_10): return CellType{CellKind::tet, 2};
    case CGNS_ENUMV(PENTA_6): return CellType{CellKind::prism, 1};
    case CGNS_ENUMV(PENTA_15):
    case CGNS_ENUMV(PENTA_18): return CellType{CellKind::prism, 2};
    case CGNS_ENUMV(PYRA_5): return CellType{CellKind::pyramid, 1};
    case CGNS_ENUMV(HEXA_8): return CellType{CellKind::hex, 1};
    case CGNS_ENUMV(HEXA_20):
    case CGNS_ENUMV(HEXA_27): return CellType{CellKind::hex, 2};
    default: return std::nullopt;
  }
}

/// Number of corners of a face; 0: the element is none.
std::size_t num_face_corners(std::string_view type) {
  return type.starts_with("TRI_") ? 3 : type.starts_with("QUAD_") ? 4 : 0;
}

/// Places in an element of CGNS of the nodes of `NodeOrdering::vtk`: as in Exodus, but for the faces of a hex.
std::vector<std::size_t> cgns_places(CellKind kind, std::size_t num_nodes) {
  std::vector<std::size_t> places = exodus_places(kind, num_nodes);
  if (num_nodes == 27) std::ranges::copy(std::array<std::size_t, 7>{24, 22, 21, 23, 20, 25, 26}, places.begin() + 20);
  return places;
}

/// The library has one error message and one list of open files.
std::mutex& cgns_lock() {
  static std::mutex lock;
  return lock;
}

class CgnsParser {
 public:
  CgnsParser(const std::string& name, std::string_view bytes) : name_(name), copy_(bytes), cells_(mesh_) {
    constexpr std::size_t kMostCompressed = 1032;  // zlib's largest ratio
    most_entries_ = bytes.size() * kMostCompressed / sizeof(float);
    const int status = cg_open(copy_.path(), CG_MODE_READ, &file_);
    copy_.remove_name();
    if (status != CG_OK) fail("no CGNS file: " + std::string(cg_get_error()));
  }
  ~CgnsParser() { cg_close(file_); }
  CgnsParser(const CgnsParser&) = delete;
  CgnsParser& operator=(const CgnsParser&) = delete;

  NodalMesh parse() {
    choose_base();
    int num_zones = 0;
    require(cg_nzones(file_, base_, &num_zones), "zones");
    for (zone_ = 1; zone_ <= num_zones; ++zone_) read_zone();
    if (num_zones > 1) mesh_.warnings.push_back(std::to_string(num_zones) + " zones are not joined where they meet");
    name_regions(num_zones);
    mesh_.face_groups.groups = groups_.take();
    left_out_.tell(mesh_.warnings);
    return std::move(mesh_);
  }

 private:
  using Type = CGNS_ENUMT(ElementType_t);
  /// An element of two dimensions by its corners; the fourth of a triangle is kNoIndex.
  struct Face {
    cgsize_t number;
    std::array<Index, 4> corners;
    int section;
  };
  /// A list of elements, or one element of a mixed list, of one type.
  struct Elements {
    Type type;
    cgsize_t first_number;
    const cgsize_t* nodes;
    std::size_t count, size;
    int section;
  };
  /// A section with cells.
  struct CellSection {
    std::string zone, name;
    int zone_number;
    Type type;  ///< MIXED: several
    std::size_t first_cell, end_cell;
  };

  [[noreturn]] void fail(const std::string& what) const { throw InputError(name_ + ": " + what); }
  void require(int status, const std::string& what) const {
    if (status != CG_OK) fail(what + ": " + cg_get_error());
  }
  /// Returns a count of entries. InputError: negative, or more than the file can hold.
  std::size_t size_of(cgsize_t count, const std::string& what) const {
    if (count < 0 || static_cast<std::size_t>(count) > most_entries_)
      fail(what + ": more entries than the file can hold");
    return static_cast<std::size_t>(count);
  }
  std::string in_zone(const std::string& what) const { return "zone " + in_quotes(zone_name_) + ", " + what; }

  /// Takes the first base of cells in space.
  void choose_base() {
    int num_bases = 0;
    require(cg_nbases(file_, &num_bases), "bases");
    for (int b = 1; b <= num_bases; ++b) {
      char base_name[kNameSize] = {};
      int cell_dimension = 0, dimension = 0;
      require(cg_base_read(file_, b, base_name, &cell_dimension, &dimension), "base");
      if (base_ == 0 && cell_dimension == 3 && dimension == 3)
        base_ = b;
      else
        left_out_.add("bases");
    }
    if (base_ == 0) fail("expected a base with cells of three dimensions");
  }

  void read_zone() {
    char zone_name[kNameSize] = {};
    cgsize_t size[9] = {};
    CGNS_ENUMT(ZoneType_t) type;
    require(cg_zone_read(file_, base_, zone_, zone_name, size), "zone " + std::to_string(zone_));
    zone_name_ = zone_name;
    require(cg_zone_type(file_, base_, zone_, &type), in_zone("type"));
    if (type != CGNS_ENUMV(Unstructured)) fail(in_zone("structured: only zones of type Unstructured are read"));
    first_node_ = mesh_.positions.size();
    num_nodes_ = size_of(size[0], in_zone("vertices"));
    if (first_node_ + num_nodes_ > static_cast<std::size_t>(std::numeric_limits<Index>::max()))
      fail("expected at most 2^31 - 1 vertices");
    read_coordinates();
    faces_.clear();
    section_names_.clear();
    int num_sections = 0;
    require(cg_nsections(file_, base_, zone_, &num_sections), in_zone("sections"));
    for (int section = 1; section <= num_sections; ++section) read_section(section);
    std::ranges::stable_sort(faces_, {}, &Face::number);
    read_conditions();
  }

  void read_coordinates() {
    std::vector<double> axes[3];
    constexpr const char* kCgnsCoordinateNames[] = {"CoordinateX", "CoordinateY", "CoordinateZ"};
    const cgsize_t first = 1, last = static_cast<cgsize_t>(num_nodes_);
    for (int k = 0; k < 3; ++k) {
      axes[k].resize(num_nodes_);
      if (num_nodes_ == 0) continue;
      require(cg_coord_read(file_, base_, zone_, kCgnsCoordinateNames[k], CGNS_ENUMV(RealDouble), &first, &last,
                            axes[k].data()),
              in_zone(kCgnsCoordinateNames[k]));
    }
    for (std::size_t v = 0; v < num_nodes_; ++v) {
      mesh_.positions.emplace_back(axes[0][v], axes[1][v], axes[2][v]);
      if (!mesh_.positions.back().allFinite())
        fail(in_zone("vertex " + std::to_string(v + 1) + ": expected finite coordinates"));
    }
  }

  void read_section(int section) {
    char section_name[kNameSize] = {};
    Type type;
    cgsize_t first = 0, last = 0, data_size = 0;
    int boundary = 0, has_parents = 0;
    require(cg_section_read(file_, base_, zone_, section, section_name, &type, &first, &last, &boundary, &has_parents),
            in_zone("section " + std::to_string(section)));
    section_names_.emplace_back(section_name);
    const std::string what = in_zone("section " + in_quotes(section_name));
    if (last < first) fail(what + ": its last element comes before the first one");
    const std::size_t count = size_of(last - first + 1, what);
    if (type == CGNS_ENUMV(NGON_n) || type == CGNS_ENUMV(NFACE_n)) fail(what + ": polyhedra are not read");
    require(cg_ElementDataSize(file_, base_, zone_, section, &data_size), what);
    std::vector<cgsize_t> data(size_of(data_size, what));
    const std::size_t first_cell = mesh_.num_cells();
    if (type == CGNS_ENUMV(MIXED)) {
      std::vector<cgsize_t> offsets(count + 1);
      require(cg_poly_elements_read(file_, base_, zone_, section, data.data(), offsets.data(), nullptr), what);
      add_mixed(data, first, count, section, what);
    } else {
      const std::size_t size = nodes_per_element(type, what);
      if (data.size() != count * size) fail(what + ": expected " + std::to_string(count * size) + " vertices");
      require(cg_elements_read(file_, base_, zone_, section, data.data(), nullptr), what);
      add_elements({type, first, data.data(), count, size, section}, what);
    }
    if (mesh_.num_cells() > first_cell)
      sections_.push_back({zone_name_, section_name, zone_, type, first_cell, mesh_.num_cells()});
  }

  std::size_t nodes_per_element(Type type, const std::string& what) const {
    int size = 0;
    if (type <= CGNS_ENUMV(ElementTypeUserDefined) || type >= NofValidElementTypes || cg_npe(type, &size) != CG_OK ||
        size < 1)
      fail(what + ": an element has an unknown type, " + std::to_string(static_cast<int>(type)));
    return static_cast<std::size_t>(size);
  }

  /// The elements of a mixed list: each begins with its type.
  void add_mixed(const std::vector<cgsize_t>& data, cgsize_t first, std::size_t count, int section,
                 const std::string& what) {
    std::size_t at = 0;
    for (std::size_t e = 0; e < count; ++e) {
      if (at >= data.size()) fail(what + ": is cut short");
      const auto type = static_cast<Type>(std::clamp<cgsize_t>(data[at], 0, NofValidElementTypes));
      const std::size_t size = nodes_per_element(type, what);
      if (data.size() - at - 1 < size) fail(what + ": is cut short");
      add_elements({type, first + static_cast<cgsize_t>(e), &data[at + 1], 1, size, section}, what);
      at += 1 + size;
    }
  }

  void add_elements(const Elements& elements, const std::string& what) {
    const std::string_view type_name = cg_ElementTypeName(elements.type);
    if (type_name.starts_with("PYRA_") && elements.type != CGNS_ENUMV(PYRA_5)) fail(what + ": " + kNoCurvedPyramids);
    const std::optional<CellType> cell = cell_type(elements.type);
    const std::size_t num_corners = num_face_corners(type_name);
    if (!cell && num_corners == 0) {
      if (type_name.starts_with("TETRA_") || type_name.starts_with("PENTA_") || type_name.starts_with("HEXA_"))
        fail(what + ": " + std::string(type_name) + " is not read: expected cells of order 1 or 2");
      left_out_.add("elements of type " + std::string(type_name), elements.count);
      return;
    }
    std::vector<std::size_t>& places = places_[elements.type];
    if (cell && places.empty()) places = cgns_places(cell->kind, elements.size);
    std::vector<Index>& nodes = nodes_;
    nodes.resize(cell ? elements.size : num_corners);
    for (std::size_t e = 0; e < elements.count; ++e) {
      const cgsize_t number = elements.first_number + static_cast<cgsize_t>(e);
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        const cgsize_t vertex = elements.nodes[e * elements.size + (cell ? places[i] : i)];
        if (vertex < 1 || static_cast<std::size_t>(vertex) > num_nodes_)
          fail(what + ": element " + std::to_string(number) + " names vertex " + std::to_string(vertex) + " of " +
               std::to_string(num_nodes_));
        nodes[i] = static_cast<Index>(first_node_ + static_cast<std::size_t>(vertex) - 1);
      }
      if (cell) {
        cells_.add(cell->kind, cell->order, NodeOrdering::vtk, nodes);
      } else {
        Face face{number, {kNoIndex, kNoIndex, kNoIndex, kNoIndex}, elements.section};
        std::ranges::copy(nodes, face.corners.begin());
        faces_.push_back(face);
      }
    }
  }

  void put_in_group(const Face& face, Index group) {
    const std::size_t size = face.corners[3] == kNoIndex ? 3 : 4;
    add_face(mesh_, std::span(face.corners).first(size), group);
  }

  /// Each boundary condition is a group of faces; if a zone has none, each of its sections with faces is one.
  void read_conditions() {
    int num_conditions = 0;
    require(cg_nbocos(file_, base_, zone_, &num_conditions), in_zone("boundary conditions"));
    for (int condition = 1; condition <= num_conditions; ++condition) read_condition(condition);
    if (num_conditions > 0) return;
    for (const Face& face : faces_)
      put_in_group(face, groups_.by_name(section_names_[static_cast<std::size_t>(face.section) - 1]));
  }

  void read_condition(int condition) {
    char condition_name[kNameSize] = {};
    CGNS_ENUMT(BCType_t) type;
    CGNS_ENUMT(PointSetType_t) set;
    CGNS_ENUMT(DataType_t) normal_type;
    CGNS_ENUMT(GridLocation_t) location;
    cgsize_t count = 0, normals = 0;
    int normal_index[3] = {}, num_data = 0;
    require(cg_boco_info(file_, base_, zone_, condition, condition_name, &type, &set, &count, normal_index, &normals,
                         &normal_type, &num_data),
            in_zone("boundary condition " + std::to_string(condition)));
    const std::string what = in_zone("boundary condition " + in_quotes(condition_name));
    std::vector<cgsize_t> points(size_of(count, what));
    if (points.empty()) return;
    require(cg_boco_gridlocation_read(file_, base_, zone_, condition, &location), what);
    require(cg_boco_read(file_, base_, zone_, condition, points.data(), nullptr), what);
    const bool is_range = set == CGNS_ENUMV(PointRange) || set == CGNS_ENUMV(ElementRange);
    if (is_range && points.size() != 2) fail(what + ": expected the two ends of a range");
    if (!is_range) std::ranges::sort(points);
    const auto has = [&](cgsize_t number) {
      return is_range ? number >= points[0] && number <= points[1]
                      : std::binary_search(points.begin(), points.end(), number);
    };
    const bool is_of_vertices =
        location == CGNS_ENUMV(Vertex) && set != CGNS_ENUMV(ElementRange) && set != CGNS_ENUMV(ElementList);
    const auto has_corners = [&](const Face& face) {
      return std::ranges::all_of(face.corners, [&](Index node) {
        return node == kNoIndex || has(static_cast<cgsize_t>(static_cast<std::size_t>(node) - first_node_ + 1));
      });
    };
    const Index group = groups_.by_name(family_of(condition).value_or(condition_name));
    bool has_faces = false;
    for (const Face& face : faces_) {
      if (!(is_of_vertices ? has_corners(face) : has(face.number))) continue;
      put_in_group(face, group);
      has_faces = true;
    }
    if (!has_faces) left_out_.add("boundary conditions without faces");
  }

  /// Returns the name of the family of a boundary condition; nothing if it has none.
  std::optional<std::string> family_of(int condition) const {
    char family[kNameSize * 21] = {};  // a path of families
    if (cg_goto(file_, base_, "Zone_t", zone_, "ZoneBC_t", 1, "BC_t", condition, "end") != CG_OK ||
        cg_famname_read(family) != CG_OK || family[0] == '\0')
      return std::nullopt;
    return std::string(family);
  }

  /// Zones are regions, if there are several. In a zone with two sections of one type, sections are regions; sections
  /// of different types are taken for one list that was sorted by type.
  void name_regions(int num_zones) {
    std::map<std::pair<int, Type>, int> counts;
    std::map<int, bool> divides;
    for (const CellSection& section : sections_)
      if (++counts[{section.zone_number, section.type}] > 1) divides[section.zone_number] = true;
    if (num_zones == 1 && divides.empty()) return;
    mesh_.references.assign(mesh_.num_cells(), 0);
    std::map<std::string, int> numbers;
    for (const CellSection& section : sections_) {
      std::string region = num_zones > 1 ? section.zone : "";
      if (divides[section.zone_number]) region += (region.empty() ? "" : "/") + section.name;
      const auto [found, is_new] = numbers.try_emplace(region, static_cast<int>(numbers.size()) + 1);
      if (is_new) mesh_.regions.push_back({region, found->second, 3});
      std::fill(mesh_.references.begin() + static_cast<std::ptrdiff_t>(section.first_cell),
                mesh_.references.begin() + static_cast<std::ptrdiff_t>(section.end_cell), found->second);
    }
  }

  static constexpr std::size_t kNameSize = 33;  // of the library's names

  std::string name_;
  CopyOnDisk copy_;
  int file_ = 0, base_ = 0, zone_ = 0;
  std::size_t most_entries_ = 0;
  NodalMesh mesh_;
  NodalCells cells_;
  LeftOut left_out_;
  GroupList groups_;
  std::vector<CellSection> sections_;
  std::map<Type, std::vector<std::size_t> > places_;  ///< `cgns_places` of the types of cells
  std::vector<Index> nodes_;                          ///< of the element that is being read
  // These members describe the zone that is being read.
  std::string zone_name_;
  std::size_t first_node_ = 0, num_nodes_ = 0;
  std::vector<Face> faces_;
  std::vector<std::string> section_names_;
};

}  // namespace

NodalMesh parse_cgns(const std::string& name, std::string_view bytes, const std::string&) {
  require_cgns_header(name, bytes);
  const std::lock_guard lock(cgns_lock());
  return CgnsParser(name, bytes).parse();
}

#endif

}  // namespace subvol::internal

bool subvol::has_cgns() {
#ifdef SUBVOL_CGNS
  return true;
#else
  return false;
#endif
}

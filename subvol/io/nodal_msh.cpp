// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/binary_value.h"
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/mesh_formats.h"
#include "subvol/io/nodal_formats.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>

namespace subvol::internal {

namespace {

enum class Shape { point, line, triangle, quad, tet, hex, prism, pyramid };

/// An element type of Gmsh.
struct MshType {
  int type;
  Shape shape;
  int order;
  int size;  ///< number of nodes
};

constexpr MshType kMshTypes[] = {
    {1, Shape::line, 1, 2},       {2, Shape::triangle, 1, 3},   {3, Shape::quad, 1, 4},
    {4, Shape::tet, 1, 4},        {5, Shape::hex, 1, 8},        {6, Shape::prism, 1, 6},
    {7, Shape::pyramid, 1, 5},    {8, Shape::line, 2, 3},       {9, Shape::triangle, 2, 6},
    {10, Shape::quad, 2, 9},      {11, Shape::tet, 2, 10},      {12, Shape::hex, 2, 27},
    {13, Shape::prism, 2, 18},    {14, Shape::pyramid, 2, 14},  {15, Shape::point, 1, 1},
    {16, Shape::quad, 2, 8},      {17, Shape::hex, 2, 20},      {18, Shape::prism, 2, 15},
    {19, Shape::pyramid, 2, 13},  {20, Shape::triangle, 3, 9},  {21, Shape::triangle, 3, 10},
    {22, Shape::triangle, 4, 12}, {23, Shape::triangle, 4, 15}, {24, Shape::triangle, 5, 15},
    {25, Shape::triangle, 5, 21}, {26, Shape::line, 3, 4},      {27, Shape::line, 4, 5},
    {28, Shape::line, 5, 6},      {29, Shape::tet, 3, 20},      {30, Shape::tet, 4, 35},
    {31, Shape::tet, 5, 56},      {36, Shape::quad, 3, 16},     {37, Shape::quad, 4, 25},
    {38, Shape::quad, 5, 36},     {39, Shape::quad, 3, 12},     {40, Shape::quad, 4, 16},
    {41, Shape::quad, 5, 20},     {42, Shape::triangle, 6, 28}, {43, Shape::triangle, 7, 36},
    {44, Shape::triangle, 8, 45}, {45, Shape::triangle, 9, 55}, {46, Shape::triangle, 10, 66},
    {47, Shape::quad, 6, 49},     {48, Shape::quad, 7, 64},     {49, Shape::quad, 8, 81},
    {50, Shape::quad, 9, 100},    {51, Shape::quad, 10, 121},   {62, Shape::line, 6, 7},
    {63, Shape::line, 7, 8},      {64, Shape::line, 8, 9},      {65, Shape::line, 9, 10},
    {66, Shape::line, 10, 11},    {71, Shape::tet, 6, 84},      {72, Shape::tet, 7, 120},
    {73, Shape::tet, 8, 165},     {74, Shape::tet, 9, 220},     {75, Shape::tet, 10, 286},
    {84, Shape::line, 1, 1},      {90, Shape::prism, 3, 40},    {91, Shape::prism, 4, 75},
    {92, Shape::hex, 3, 64},      {93, Shape::hex, 4, 125},     {94, Shape::hex, 5, 216},
    {95, Shape::hex, 6, 343},     {96, Shape::hex, 7, 512},     {97, Shape::hex, 8, 729},
    {98, Shape::hex, 9, 1000},    {118, Shape::pyramid, 3, 30}, {119, Shape::pyramid, 4, 55},
};

int dimension(Shape shape) {
  if (shape == Shape::point) return 0;
  if (shape == Shape::line) return 1;
  return shape == Shape::triangle || shape == Shape::quad ? 2 : 3;
}

CellKind kind_of(Shape shape) {
  switch (shape) {
    case Shape::tet: return CellKind::tet;
    case Shape::prism: return CellKind::prism;
    case Shape::pyramid: return CellKind::pyramid;
    default: return CellKind::hex;
  }
}

/// An element with the tags of its nodes still unresolved: nodes may come after elements.
struct Element {
  const MshType* type;
  int physical;                  ///< number of its first physical group, 0: none
  const std::vector<int>* more;  ///< all of them, or null: only that one
  std::int64_t entity;           ///< the part of the geometry that it is on
  std::size_t line;
  std::size_t first_node;  ///< in the list of all elements' nodes
};

constexpr std::int64_t kMostNumber = std::numeric_limits<int>::max();  // of a group, an entity or a reference

/// The numbers of a file in ASCII or binary, and the ends of its sections.
class MshStream {
 public:
  MshStream(const std::string& name, std::string_view bytes) : scan_(name, bytes, TextScanner::Comments::none) {}

  TextScanner& scan() { return scan_; }
  const TextScanner& scan() const { return scan_; }
  /// Returns true for versions below 3.
  bool is_old() const { return is_old_; }
  /// Returns true for version 4.1, and false for 4.0.
  bool is_4_1() const { return is_4_1_; }
  bool is_binary() const { return binary_; }
  /// The type of counts, and of tags in version 4.1.
  ValueType size_type() const { return size_type_; }

  void read_format() {
    const std::string_view first = scan_.word("$MeshFormat");
    if (first == "$NOD") scan_.fail("version 1 of Gmsh's format, expected 2.2, 4.0 or 4.1");
    if (first != "$MeshFormat") scan_.fail("expected $MeshFormat, found " + in_quotes(first));
    const double version = scan_.number("the version");
    if (version != 2 && version != 2.1 && version != 2.2 && version != 4 && version != 4.1)
      scan_.fail("expected version 2.2, 4.0 or 4.1 of Gmsh's format");
    is_old_ = version < 3;
    is_4_1_ = version == 4.1;
    const std::int64_t type = scan_.integer("0 (ASCII) or 1 (binary)");
    if (type != 0 && type != 1) scan_.fail("expected 0 (ASCII) or 1 (binary)");
    binary_ = type == 1;
    const std::int64_t size = scan_.integer("the size of a number, 4 or 8");
    if (size != 4 && size != 8) scan_.fail("expected 4 or 8 bytes for a size");
    size_type_ = size == 4 ? kUInt32 : kUInt64;
    if (!is_4_1_) size_type_ = kUInt64;
    if (binary_) {
      scan_.line();
      const std::string_view one = scan_.bytes(4, "the number 1");
      if (decode(one.data(), kInt32, std::endian::little) == 1)
        endian_ = std::endian::little;
      else if (decode(one.data(), kInt32, std::endian::big) == 1)
        endian_ = std::endian::big;
      else
        scan_.fail("expected the number 1 in four bytes after the format");
    }
    end_section("$MeshFormat");
  }

  void end_section(const std::string& section) {
    const std::string end = "$End" + section.substr(1);
    const std::string_view word = scan_.word(end.c_str());
    if (word != end) scan_.fail("expected " + end + ", found " + in_quotes(word));
  }

  void skip_section(const std::string& section) {
    const std::string end = "$End" + section.substr(1);
    while (const auto line = scan_.line())
      if (line->substr(0, line->find_last_not_of(" \t") + 1).ends_with(end)) return;
    scan_.fail("the file ends within " + section);
  }

  /// Goes to where the binary part of a section begins.
  void begin_section() {
    if (binary_) scan_.line();
  }

  double read(ValueType type, const char* what) {
    if (!binary_) return type.is_real() ? scan_.number(what) : static_cast<double>(scan_.integer(what));
    const double value = decode(scan_.bytes(type.size, what).data(), type, endian_);
    if (!std::isfinite(value)) scan_.fail(std::string(what) + " is not a finite number");
    return value;
  }
  std::int64_t read_int(const char* what) { return static_cast<std::int64_t>(read(kInt32, what)); }
  std::int64_t read_tag(const char* what) {  // a tag of a node or element
    if (is_4_1_) return static_cast<std::int64_t>(std::min(read(size_type_, what), 9e15));
    return read_int(what);
  }

  /// Reads a number of things that each take so many words in ASCII, at least a byte each in binary.
  std::size_t read_size(const char* what, std::size_t words, bool as_int = false) {
    if (!binary_) return scan_.count(what, words);
    const double n = read(as_int ? kInt32 : size_type_, what);
    if (n < 0 || n > static_cast<double>(scan_.bytes_left()) || n > std::numeric_limits<Index>::max())
      scan_.fail(std::string(what) + " is more than the rest of the file can hold");
    return static_cast<std::size_t>(n);
  }

  /// Boxes of entities do not matter, and may be infinite.
  void read_box_coordinate() {
    if (binary_)
      scan_.bytes(8, "a coordinate");
    else
      scan_.word("a coordinate");
  }

  Vec3 read_position() {
    Vec3 p;
    for (int k = 0; k < 3; ++k) p[k] = read(kFloat64, "a coordinate");
    return p;
  }

 private:
  TextScanner scan_;
  bool is_old_ = false, is_4_1_ = false, binary_ = false;
  std::endian endian_ = std::endian::little;
  ValueType size_type_ = kUInt64;
};

/// Holds what the parser has read of all sections.
struct MshContent {
  NodalMesh mesh;                                                    ///< nodes and warnings
  std::unordered_map<std::int64_t, Index> numbers;                   ///< of nodes by their tags
  std::array<std::map<int, std::string>, 4> names;                   ///< of physical groups, by dimension
  std::array<std::map<std::int64_t, std::vector<int>>, 4> physical;  ///< groups of entities
  std::vector<Element> elements;
  std::vector<std::int64_t> element_nodes;
  std::size_t num_skipped = 0, num_more_groups = 0;
};

/// Reads the sections of a file.
class MshParser {
 public:
  explicit MshParser(MshStream& stream) : stream_(stream), scan_(stream.scan()) {}

  MshContent parse() {
    stream_.read_format();
    while (const auto word = scan_.next()) {
      const std::string section(*word);
      if (section == "$Nodes")
        read_nodes();
      else if (section == "$Elements")
        read_elements();
      else if (section == "$PhysicalNames")
        read_physical_names();
      else if (section == "$Entities")
        read_entities();
      else if (section == "$PartitionedEntities")
        skip_partitions();
      else if (section.starts_with("$"))
        stream_.skip_section(section);
      else
        scan_.fail("expected a section such as $Nodes, found " + in_quotes(*word));
    }
    if (!has_nodes_) scan_.fail("the file ends without $Nodes");
    if (!has_elements_) scan_.fail("the file ends without $Elements");
    return std::move(content_);
  }

 private:
  void skip_partitions() {
    stream_.skip_section("$PartitionedEntities");
    content_.mesh.warnings.push_back("the file is partitioned: physical groups of partitions are not read");
  }

  void read_physical_names() {
    const std::size_t n = scan_.count("the number of names", 3);
    for (std::size_t i = 0; i < n; ++i) {
      const std::int64_t dim = scan_.integer("a dimension"), number = scan_.integer("the number of a group");
      const auto rest = scan_.line();
      const std::size_t begin = rest ? rest->find('"') : std::string_view::npos,
                        end = rest ? rest->rfind('"') : std::string_view::npos;
      if (begin == std::string_view::npos || end <= begin) scan_.fail("expected a name in double quotes");
      if (dim < 0 || dim > 3 || std::abs(number) > std::numeric_limits<int>::max())
        scan_.fail("expected a dimension from 0 to 3 and a number of 32 bits");
      content_.names[static_cast<std::size_t>(dim)][static_cast<int>(number)] =
          std::string(rest->substr(begin + 1, end - begin - 1));
    }
    stream_.end_section("$PhysicalNames");
  }

  /// Reads the physical groups of the parts of the geometry.
  void read_entities() {
    stream_.begin_section();
    std::array<std::size_t, 4> counts{};
    for (std::size_t& n : counts) n = stream_.read_size("a number of entities", 1);
    for (std::size_t dim = 0; dim < 4; ++dim)
      for (std::size_t i = 0; i < counts[dim]; ++i) {
        const std::int64_t tag = stream_.read_int("the tag of an entity");
        const int num_coordinates = dim == 0 && stream_.is_4_1() ? 3 : 6;
        for (int k = 0; k < num_coordinates; ++k) stream_.read_box_coordinate();
        const std::size_t groups = stream_.read_size("the number of physical groups", 1);
        for (std::size_t k = 0; k < groups; ++k) {
          const std::int64_t group = std::abs(stream_.read_int("a physical group"));
          content_.physical[dim][tag].push_back(static_cast<int>(std::min<std::int64_t>(group, kMostNumber)));
          content_.num_more_groups += k > 0 && dim == 3;
        }
        if (dim == 0) continue;
        const std::size_t borders = stream_.read_size("the number of bounding entities", 1);
        for (std::size_t k = 0; k < borders; ++k) stream_.read_int("a bounding entity");
      }
    stream_.end_section("$Entities");
  }

  void add_node(std::int64_t tag, const Vec3& position) {
    if (!content_.numbers.try_emplace(tag, static_cast<Index>(content_.mesh.positions.size())).second)
      scan_.fail("a second node " + std::to_string(tag));
    content_.mesh.positions.push_back(position);
  }

  void read_nodes() {
    if (has_nodes_) scan_.fail("a second section $Nodes");
    has_nodes_ = true;
    if (stream_.is_old()) {
      const std::size_t n = scan_.count("the number of nodes", stream_.is_binary() ? 1 : 4);
      stream_.begin_section();
      for (std::size_t i = 0; i < n; ++i) {
        const std::int64_t tag = stream_.read_int("the number of a node");
        add_node(tag, stream_.read_position());
      }
      return stream_.end_section("$Nodes");
    }
    stream_.begin_section();
    const std::size_t num_blocks = stream_.read_size("the number of blocks", 4);
    stream_.read_size("the number of nodes", 3);
    if (stream_.is_4_1())
      stream_.read(stream_.size_type(), "the smallest tag"), stream_.read(stream_.size_type(), "the largest tag");
    std::vector<std::int64_t> tags;
    for (std::size_t block = 0; block < num_blocks; ++block) {
      const std::int64_t first = stream_.read_int("a dimension or tag"),
                         second = stream_.read_int("a dimension or tag");
      const std::int64_t dim = stream_.is_4_1() ? first : second;
      const std::int64_t parametric = stream_.read_int("0 or 1");
      if (dim < 0 || dim > 3 || parametric < 0 || parametric > 1)
        scan_.fail("expected a dimension from 0 to 3, and 0 or 1 for parametric coordinates");
      const std::size_t n = stream_.read_size("the number of nodes of a block", stream_.is_4_1() ? 1 : 4);
      tags.clear();
      if (stream_.is_4_1())
        for (std::size_t i = 0; i < n; ++i) tags.push_back(stream_.read_tag("the tag of a node"));
      for (std::size_t i = 0; i < n; ++i) {
        const std::int64_t tag = stream_.is_4_1() ? tags[i] : stream_.read_tag("the tag of a node");
        const Vec3 position = stream_.read_position();
        for (int k = 0; k < parametric * dim; ++k) stream_.read_box_coordinate();
        add_node(tag, position);
      }
    }
    stream_.end_section("$Nodes");
  }

  const MshType& type_of(std::int64_t type) {
    const auto found =
        std::find_if(std::begin(kMshTypes), std::end(kMshTypes), [&](const MshType& t) { return t.type == type; });
    if (found == std::end(kMshTypes)) scan_.fail("elements of Gmsh's type " + std::to_string(type) + " are not read");
    if (found->shape == Shape::pyramid && found->order > 1)
      scan_.fail(std::string("a curved pyramid: ") + kNoCurvedPyramids);
    if (found->shape == Shape::prism && found->order > 2)
      scan_.fail("a prism of order " + std::to_string(found->order) +
                 ", which Gmsh does not evaluate; expected order 1 "
                 "or 2");
    return *found;
  }

  void add_element(const MshType& type, int physical, std::int64_t entity, const std::vector<int>* more = nullptr) {
    const bool wanted = dimension(type.shape) >= 2;
    if (wanted)
      content_.elements.push_back({&type, physical, more, entity, scan_.word_line(), content_.element_nodes.size()});
    else
      ++content_.num_skipped;
    for (int i = 0; i < type.size; ++i) {
      const std::int64_t node = stream_.read_tag("a node of an element");
      if (wanted) content_.element_nodes.push_back(node);
    }
  }

  void read_elements() {
    if (has_elements_) scan_.fail("a second section $Elements");
    has_elements_ = true;
    if (stream_.is_old()) return read_old_elements();
    stream_.begin_section();
    const std::size_t num_blocks = stream_.read_size("the number of blocks", 4);
    stream_.read_size("the number of elements", 2);
    if (stream_.is_4_1())
      stream_.read(stream_.size_type(), "the smallest tag"), stream_.read(stream_.size_type(), "the largest tag");
    for (std::size_t block = 0; block < num_blocks; ++block) {
      const std::int64_t first = stream_.read_int("a dimension or tag"),
                         second = stream_.read_int("a dimension or tag");
      const std::int64_t entity = stream_.is_4_1() ? second : first;
      const MshType& type = type_of(stream_.read_int("a type of elements"));
      const std::size_t n =
          stream_.read_size("the number of elements of a block", static_cast<std::size_t>(type.size) + 1);
      const auto& groups = content_.physical[static_cast<std::size_t>(dimension(type.shape))];
      const auto group = groups.find(entity);
      for (std::size_t i = 0; i < n; ++i) {
        stream_.read_tag("the tag of an element");
        const bool in_none = group == groups.end() || group->second.empty();
        add_element(type, in_none ? 0 : group->second[0], entity, in_none ? nullptr : &group->second);
      }
    }
    stream_.end_section("$Elements");
  }

  void read_old_elements() {
    const std::size_t n = scan_.count("the number of elements", stream_.is_binary() ? 1 : 4);
    stream_.begin_section();
    for (std::size_t i = 0; i < n;) {
      if (!stream_.is_binary()) stream_.read_int("the number of an element");
      const MshType& type = type_of(stream_.read_int("the type of an element"));
      const std::size_t group = stream_.is_binary() ? stream_.read_size("a number of elements", 1, true) : 1;
      if (group == 0 || group > n - i) scan_.fail("expected a number of elements up to that of the section");
      const std::size_t num_tags = stream_.read_size("the number of tags", 1, true);
      for (std::size_t k = 0; k < group; ++k, ++i) {
        if (stream_.is_binary()) stream_.read_int("the number of an element");
        std::int64_t physical = 0, entity = 0;
        for (std::size_t t = 0; t < num_tags; ++t) {
          const std::int64_t tag = stream_.read_int("a tag");
          if (t == 0) physical = std::min<std::int64_t>(std::abs(tag), kMostNumber);
          if (t == 1) entity = tag;
        }
        add_element(type, static_cast<int>(physical), entity);
      }
    }
    stream_.end_section("$Elements");
  }

  MshStream& stream_;
  TextScanner& scan_;
  MshContent content_;
  bool has_nodes_ = false, has_elements_ = false;
};

/// Makes a mesh of the elements that were read.
class MshBuilder {
 public:
  /// stream: names the file in errors.
  MshBuilder(MshContent content, const MshStream& stream) : content_(std::move(content)), stream_(stream) {}

  NodalMesh build() {
    const auto is_cell = [](const Element& element) { return dimension(element.type->shape) == 3; };
    const bool has_groups =
        std::any_of(content_.elements.begin(), content_.elements.end(),
                    [&](const Element& element) { return is_cell(element) && element.physical != 0; });
    if (std::none_of(content_.elements.begin(), content_.elements.end(), is_cell)) {
      build_shells();
      return std::move(mesh_);
    }
    find_own_references();
    NodalCells cells(mesh_);
    GroupList faces;
    std::vector<Index> nodes;
    for (const Element& element : content_.elements) {
      if (!is_cell(element) && element.physical == 0) {
        ++content_.num_skipped;
        continue;
      }
      take_nodes(element, nodes);
      if (!is_cell(element)) {
        const std::size_t corners = element.type->shape == Shape::quad ? 4 : 3;
        const auto add = [&](int group) { add_face(mesh_, std::span(nodes).first(corners), faces.by_number(group)); };
        if (element.more)
          std::for_each(element.more->begin(), element.more->end(), add);
        else
          add(element.physical);
        continue;
      }
      cells.add(kind_of(element.type->shape), element.type->order, NodeOrdering::gmsh, nodes);
      const std::int64_t entity = std::clamp<std::int64_t>(element.entity, -kMostNumber, kMostNumber);
      mesh_.references.push_back(has_groups ? reference_of(element.physical) : static_cast<int>(entity));
    }
    mesh_.face_groups.groups = faces.take();
    for (Group& group : mesh_.face_groups.groups)
      if (const auto name = content_.names[2].find(group.number); name != content_.names[2].end())
        group.name = name->second;
    if (!has_groups && std::all_of(mesh_.references.begin(), mesh_.references.end(),
                                   [&](int reference) { return reference == mesh_.references.front(); }))
      mesh_.references.clear();
    name_regions();
    if (content_.num_more_groups > 0)
      mesh_.warnings.push_back(
          std::to_string(content_.num_more_groups) +
          " physical groups of volumes are not used: each volume has a physical group before them");
    if (content_.num_skipped > 0)
      mesh_.warnings.push_back(std::to_string(content_.num_skipped) +
                               " elements of lower dimension that are no face of a physical group are skipped");
    return std::move(mesh_);
  }

 private:
  void take_nodes(const Element& element, std::vector<Index>& nodes) const {
    nodes.clear();
    for (int i = 0; i < element.type->size; ++i) {
      const std::int64_t tag = content_.element_nodes[element.first_node + static_cast<std::size_t>(i)];
      const auto found = content_.numbers.find(tag);
      if (found == content_.numbers.end())
        stream_.scan().fail("an element names node " + std::to_string(tag) + ", which the file does not have",
                            element.line);
      nodes.push_back(found->second);
    }
  }

  /// Without cells, the elements of two dimensions are a surface. Its groups are the physical ones; without any, the
  /// surfaces of the geometry.
  void build_shells() {
    const bool has_groups = std::any_of(content_.elements.begin(), content_.elements.end(),
                                        [](const Element& element) { return element.physical != 0; });
    GroupList groups;
    std::vector<Index> nodes, of_face;
    for (const Element& element : content_.elements) {
      take_nodes(element, nodes);
      nodes.resize(element.type->shape == Shape::quad ? 4 : 3);
      mesh_.shells.face_vertices.insert(mesh_.shells.face_vertices.end(), nodes.begin(), nodes.end());
      mesh_.shells.face_offsets.push_back(mesh_.shells.face_vertices.size());
      const std::int64_t entity = std::clamp<std::int64_t>(element.entity, -kMostNumber, kMostNumber);
      const int number = has_groups ? element.physical : static_cast<int>(entity);
      of_face.push_back(has_groups && number == 0 ? kNoIndex : groups.by_number(number));
    }
    if (!has_groups && groups.groups().size() < 2) return;
    mesh_.shells.face_groups = {groups.take(), std::move(of_face)};
    for (Group& group : mesh_.shells.face_groups.groups)
      if (const auto name = content_.names[2].find(group.number); has_groups && name != content_.names[2].end())
        group.name = name->second;
  }

  /// The reference that a group's name stands for, if `write_volume` may have named it.
  std::optional<int> named_reference(int group) const {
    constexpr std::string_view kReferenceNamePrefix = "reference ";
    const auto name = content_.names[3].find(group);
    if (name == content_.names[3].end() || !name->second.starts_with(kReferenceNamePrefix)) return std::nullopt;
    const auto reference = parse_integer(std::string_view(name->second).substr(kReferenceNamePrefix.size()));
    if (!reference || std::abs(*reference) > kMostNumber) return std::nullopt;
    return static_cast<int>(*reference);
  }

  /// Finds the groups of cells that stand for the reference in their name: not one whose reference is the number of
  /// another group, or in the name of another one, since two regions would become one.
  void find_own_references() {
    std::set<int> groups;
    for (const Element& element : content_.elements)
      if (dimension(element.type->shape) == 3 && element.physical != 0) groups.insert(element.physical);
    std::map<int, int> num_named;
    for (const int group : groups)
      if (const auto named = named_reference(group)) ++num_named[*named];
    for (const int group : groups)
      if (const auto named = named_reference(group))
        if (*named == group || (num_named[*named] == 1 && !groups.contains(*named))) own_references_[group] = *named;
  }
  int reference_of(int group) const {
    const auto own = own_references_.find(group);
    return own == own_references_.end() ? group : own->second;
  }

  void name_regions() {
    for (const auto& [number, name] : content_.names[3])
      if (!own_references_.contains(number) && std::ranges::find(mesh_.references, number) != mesh_.references.end())
        mesh_.regions.push_back({name, number, 3});
  }

  MshContent content_;
  NodalMesh& mesh_ = content_.mesh;
  const MshStream& stream_;
  std::map<int, int> own_references_;  ///< of groups of cells
};

}  // namespace

bool is_gmsh(std::string_view bytes) { return bytes.starts_with("$MeshFormat"); }

NodalMesh parse_msh(const std::string& name, std::string_view bytes, const std::string&) {
  MshStream stream(name, bytes);
  return MshBuilder(MshParser(stream).parse(), stream).build();
}

}  // namespace subvol::internal

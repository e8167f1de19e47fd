// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/left_out.h"
#include "subvol/io/mesh_formats.h"
#include "subvol/io/nodal_formats.h"
#include "subvol/io/nodal_sides.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <set>
#include <unordered_map>

namespace subvol::internal {

namespace {

/// A solid element of Abaqus: the digits of its type after "3D".
struct InpType {
  int digits;
  CellKind kind;
  int order;
};
constexpr InpType kInpTypes[] = {
    {4, CellKind::tet, 1},  {5, CellKind::pyramid, 1}, {6, CellKind::prism, 1}, {8, CellKind::hex, 1},
    {10, CellKind::tet, 2}, {15, CellKind::prism, 2},  {20, CellKind::hex, 2},  {27, CellKind::hex, 2},
};
constexpr const char* kSolidFamilies[] = {"C3D", "DC3D", "AC3D", "DCC3D", "F3D"};
constexpr const char* kShellFamilies[] = {"STRI", "S", "M3D", "R3D", "SFM3D", "DS"};

std::string upper_case(std::string_view text) {
  std::string upper(text);
  for (char& c : upper)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return upper;
}

/// The fields between commas, without blanks around them; an empty last field is dropped.
std::vector<std::string> fields_of(std::string_view line) {
  std::vector<std::string> fields;
  std::size_t at = 0;
  while (at <= line.size()) {
    const std::size_t end = std::min(line.find(',', at), line.size());
    fields.push_back(trimmed(line.substr(at, end - at)));
    at = end + 1;
  }
  if (fields.size() > 1 && fields.back().empty()) fields.pop_back();
  return fields;
}

/// The number of a name such as REFERENCE_7, or REFERENCE_M7 for -7.
std::optional<int> numbered(const std::string& name, std::string_view prefix) {
  std::string number = upper_case(name);
  if (!number.starts_with(prefix)) return std::nullopt;
  number.erase(0, prefix.size());
  if (number.starts_with("M")) number[0] = '-';
  const auto value = parse_integer(number);
  if (!value || std::abs(*value) > std::numeric_limits<int>::max()) return std::nullopt;
  return static_cast<int>(*value);
}

/// Part of a set: every step-th number of a range, or another set.
struct InpSetItem {
  std::int64_t first, last, step;
  std::size_t other;                  ///< place of the set, or kNoSet
  std::size_t line;
};
constexpr std::size_t kNoSet = static_cast<std::size_t>(-1);

/// A set of elements. Sets may name elements and sets that come later in the file.
struct InpSet {
  std::string name;                   ///< as first written
  std::vector<InpSetItem> items;
  std::vector<std::size_t> members;   ///< elements, ascending, once `is_resolved`
  bool is_resolved = false, is_open = false, is_defined = false;
};

class InpParser {
 public:
  explicit InpParser(const std::string& name) : name_(name), cells_(mesh_) {}

  NodalMesh parse(std::string_view bytes) {
    read_file_of(name_, bytes, 0);
    if (element_open_) fail("the file ends within an element");
    build();
    return std::move(mesh_);
  }

 private:
  struct Element {
    const InpType* type;
    std::size_t first_node, num_nodes;
    std::size_t set;          ///< of *ELEMENT, ELSET=; kNone if it has none
  };
  struct Shell {
    std::size_t end;          ///< of its nodes
    std::size_t set, line;
  };
  struct Side {
    std::int64_t element;     ///< its number, if `set` is kNoSet
    std::size_t set;
    int number;               ///< of the face
    Index surface;            ///< place in the list of groups
    std::size_t line;
  };
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(file_ + ":" + std::to_string(line_) + ": " + what);
  }

  // --- Lines
  // ----------------------------------------------------------------------------------------------------------

  void read_file_of(const std::string& file, std::string_view bytes, int depth) {
    file_ = file;
    line_ = 0;
    TextScanner lines(file, bytes, TextScanner::Comments::none);
    while (const auto line = lines.line()) {
      line_ = lines.word_line();
      const std::string text = trimmed(*line);
      if (text.empty() || text.starts_with("**")) continue;
      if (!text.starts_with("*")) {
        read_data(text);
        continue;
      }
      if (element_open_) fail("a keyword within an element: expected more nodes");
      open_keyword(text);
      if (keyword_ == "INCLUDE") include(depth);
      file_ = file;
      line_ = lines.word_line();
    }
  }

  void include(int depth) {
    constexpr int kMostDepth = 8, kMostFiles = 64;  // far beyond any model; a file may include itself
    const std::string input = parameter("INPUT");
    if (input.empty()) fail("*INCLUDE: expected INPUT=FILE");
    if (depth + 1 > kMostDepth || ++num_included_ > kMostFiles)
      fail("*INCLUDE: more than " + std::to_string(kMostDepth) + " files in one another, or more than " +
           std::to_string(kMostFiles) + " in all");
    const std::filesystem::path path = std::filesystem::path(file_).parent_path() / input;
    read_file_of(path.string(), read_file(path), depth + 1);
  }

  /// Splits "*KEYWORD, NAME=VALUE, NAME".
  void open_keyword(const std::string& text) {
    parameters_.clear();
    const std::vector<std::string> fields = fields_of(std::string_view(text).substr(1));
    keyword_ = upper_case(fields[0]);
    for (std::size_t i = 1; i < fields.size(); ++i) {
      const std::size_t equals = fields[i].find('=');
      std::string value = equals == std::string::npos ? "" : trimmed(std::string_view(fields[i]).substr(equals + 1));
      if (value.size() >= 2 && value.front() == '"' && value.back() == '"') value = value.substr(1, value.size() - 2);
      parameters_[upper_case(trimmed(std::string_view(fields[i]).substr(0, equals)))] = value;
    }
    if (keyword_ == "NODE") open_nodes();
    else if (keyword_ == "ELEMENT") open_elements();
    else if (keyword_ == "NSET" || keyword_ == "ELSET") open_set();
    else if (keyword_ == "SURFACE") open_surface();
    else if (keyword_ == "SOLID SECTION") sections_.push_back(upper_case(parameter("ELSET")));
    else if (keyword_ == "PART") open_part();
    else if (keyword_ == "SYSTEM" || keyword_ == "NCOPY" || keyword_ == "NGEN" || keyword_ == "ELGEN" ||
             keyword_ == "NFILL" || keyword_ == "ELCOPY" || keyword_ == "NMAP")
      fail("*" + keyword_ + " is not read: write the nodes and elements themselves");
    else if (keyword_ != "INCLUDE" && keyword_ != "HEADING" && !keyword_.starts_with("END") && keyword_ != "ASSEMBLY" &&
             keyword_ != "INSTANCE")
      left_out_.add("keywords *" + keyword_);
  }

  std::string parameter(const char* name) const {
    const auto found = parameters_.find(name);
    return found == parameters_.end() ? "" : found->second;
  }
  bool has_parameter(const char* name) const { return parameters_.contains(name); }

  void read_data(const std::string& text) {
    const std::vector<std::string> fields = fields_of(text);
    if (keyword_ == "NODE") read_node(fields);
    else if (keyword_ == "ELEMENT") read_element(fields);
    else if (keyword_ == "NSET" || keyword_ == "ELSET") read_set(fields);
    else if (keyword_ == "SURFACE") read_surface(fields);
    else if (keyword_ == "INSTANCE") require_unmoved(fields);
  }

  std::int64_t label(const std::string& text, const char* what) const {
    const auto value = parse_integer(text);
    if (!value || *value <= 0) fail(std::string("expected ") + what + " (a positive whole number), found " +
                                    in_quotes(text));
    return *value;
  }

  void require_unmoved(const std::vector<std::string>& fields) const {
    for (const std::string& field : fields)
      if (const auto value = parse_number(field); !value || *value != 0)
        fail("*INSTANCE: a part that is moved; expected it in its place");
  }

  void open_part() {
    if (++num_parts_ > 1) fail("a second *PART: expected a file of one part");
  }

  // --- Nodes and elements
  // ---------------------------------------------------------------------------------------------

  void open_nodes() {
    if (const std::string system = parameter("SYSTEM"); !system.empty() && upper_case(system) != "R")
      fail("*NODE, SYSTEM=" + system + ": expected rectangular coordinates");
  }

  void read_node(const std::vector<std::string>& fields) {
    const std::int64_t number = label(fields[0], "the number of a node");
    Vec3 p = Vec3::Zero();
    for (std::size_t k = 1; k < fields.size() && k < 4; ++k) {
      if (fields[k].empty()) continue;
      std::string text = fields[k];
      std::replace_if(text.begin(), text.end(), [](char c) { return c == 'd' || c == 'D'; }, 'e');
      const auto value = parse_number(text);
      if (!value) fail("expected a coordinate (a finite number), found " + in_quotes(fields[k]));
      p[static_cast<Eigen::Index>(k - 1)] = *value;
    }
    const auto [known, is_new] = nodes_.try_emplace(number, static_cast<Index>(mesh_.positions.size()));
    if (is_new) mesh_.positions.push_back(p);
    else mesh_.positions[known->second] = p;  // a later definition replaces an earlier one
  }

  void open_elements() {
    const std::string type = upper_case(parameter("TYPE"));
    if (type.empty()) fail("*ELEMENT: expected TYPE=");
    type_ = nullptr;
    shell_corners_ = 0;
    for (const std::string_view family : kShellFamilies)
      if (const auto digits = digits_after(type, family); digits && shell_corners_ == 0)
        shell_corners_ = *digits == 3 || *digits == 6 || *digits == 65 ? 3 : *digits == 4 || *digits == 8 ? 4 : 0;
    for (const std::string_view family : kSolidFamilies) {
      if (!type.starts_with(family)) continue;
      const auto digits = digits_after(type, family);
      if (!digits) continue;
      if (*digits == 13) fail(std::string("a curved pyramid: ") + kNoCurvedPyramids);
      const auto found = std::find_if(std::begin(kInpTypes), std::end(kInpTypes),
                                      [&](const InpType& t) { return t.digits == *digits; });
      if (found == std::end(kInpTypes))
        fail("elements of type " + in_quotes(type) + " are not read, expected C3D4, 5, 6, 8, 10, 15, 20 or 27");
      type_ = found;
    }
    set_ = has_parameter("ELSET") ? element_set(parameter("ELSET")) : kNone;
    skipped_type_ = type;
  }

  /// The number that a type has behind the letters of its family.
  static std::optional<std::int64_t> digits_after(std::string_view type, std::string_view family) {
    if (!type.starts_with(family)) return std::nullopt;
    std::size_t end = family.size();
    while (end < type.size() && type[end] >= '0' && type[end] <= '9') ++end;
    return parse_integer(type.substr(family.size(), end - family.size()));
  }

  void read_shell(const std::vector<std::string>& fields) {
    if (fields.size() <= shell_corners_) fail("fewer nodes than an element of its type has");
    for (std::size_t i = 1; i <= shell_corners_; ++i) shell_nodes_.push_back(label(fields[i], "the number of a node"));
    shells_.push_back({shell_nodes_.size(), set_, line_});
  }

  void read_element(const std::vector<std::string>& fields) {
    if (!type_) {
      ++num_skipped_[skipped_type_];
      if (shell_corners_ > 0) read_shell(fields);
      return;
    }
    std::size_t at = 0;
    if (!element_open_) {
      const std::int64_t number = label(fields[at++], "the number of an element");
      if (!elements_by_label_.try_emplace(number, elements_.size()).second)
        fail("a second element " + std::to_string(number));
      if (set_ != kNone) element_sets_[set_].items.push_back({number, number, 1, kNoSet, line_});
      elements_.push_back({type_, element_nodes_.size(), static_cast<std::size_t>(type_->digits), set_});
      lines_.push_back(line_);
      element_open_ = true;
    }
    const std::size_t end = elements_.back().first_node + elements_.back().num_nodes;
    for (; at < fields.size(); ++at) {
      if (element_nodes_.size() == end) fail("more nodes than an element of its type has");
      element_nodes_.push_back(label(fields[at], "the number of a node"));
    }
    element_open_ = element_nodes_.size() < end;
  }

  // --- Sets
  // -----------------------------------------------------------------------------------------------------------

  /// Returns the place of a set, which may still have to be defined.
  std::size_t named_set(const std::string& name) {
    const auto [known, is_new] = set_numbers_.try_emplace(upper_case(name), element_sets_.size());
    if (is_new) element_sets_.emplace_back().name = name;
    return known->second;
  }
  std::size_t element_set(const std::string& name) {
    const std::size_t set = named_set(name);
    if (!element_sets_[set].is_defined) element_sets_[set].name = name;
    element_sets_[set].is_defined = true;
    return set;
  }

  void open_set() {
    const std::string name = parameter(keyword_ == "NSET" ? "NSET" : "ELSET");
    if (name.empty()) fail("*" + keyword_ + ": expected a name");
    if (keyword_ == "NSET") left_out_.add("node sets");
    else set_ = element_set(name);
  }

  void read_set(const std::vector<std::string>& fields) {
    if (keyword_ == "NSET") return;
    if (has_parameter("GENERATE")) {
      if (fields.size() < 2) fail("GENERATE: expected a first and a last number");
      const std::int64_t first = label(fields[0], "the first number"), last = label(fields[1], "the last number");
      const std::int64_t step = fields.size() > 2 ? label(fields[2], "the step") : 1;
      element_sets_[set_].items.push_back({first, last, step, kNoSet, line_});
      return;
    }
    for (const std::string& field : fields) {
      if (field.empty()) continue;
      if (parse_integer(field)) {
        const std::int64_t number = label(field, "the number of an element");
        element_sets_[set_].items.push_back({number, number, 1, kNoSet, line_});
      } else {
        const std::size_t other = named_set(field);
        element_sets_[set_].items.push_back({0, 0, 1, other, line_});
      }
    }
  }

  /// Finds the members of a set. The work is bounded: sets of sets could double with every line.
  const std::vector<std::size_t>& members_of(std::size_t s, int depth = 0) {
    constexpr std::size_t kMostWork = 1u << 28;
    constexpr int kMostDepth = 64;
    if (element_sets_[s].is_resolved) return element_sets_[s].members;
    if (element_sets_[s].is_open || depth > kMostDepth)
      fail("*ELSET: the set " + in_quotes(element_sets_[s].name) + " includes itself, or is nested too deeply");
    element_sets_[s].is_open = true;
    std::vector<std::size_t> members;
    for (const InpSetItem& item : element_sets_[s].items) {
      line_ = item.line;
      if (item.other != kNoSet) {
        if (!element_sets_[item.other].is_defined)
          fail("*ELSET: there is no set " + in_quotes(element_sets_[item.other].name));
        const std::vector<std::size_t>& others = members_of(item.other, depth + 1);
        members.insert(members.end(), others.begin(), others.end());
        set_work_ += others.size();
      } else {
        append_range(item, members);
      }
      if (set_work_ > kMostWork) fail("*ELSET: sets with too many members");
    }
    std::sort(members.begin(), members.end());
    members.erase(std::unique(members.begin(), members.end()), members.end());
    InpSet& set = element_sets_[s];
    set.members = std::move(members);
    set.is_resolved = true;
    return set.members;
  }

  /// A range may claim any size: it is looked through from its shorter side.
  void append_range(const InpSetItem& item, std::vector<std::size_t>& members) {
    if (item.last < item.first) return;
    const std::int64_t size = (item.last - item.first) / item.step + 1;
    if (static_cast<std::uint64_t>(size) <= elements_by_label_.size()) {
      for (std::int64_t k = 0; k < size; ++k)
        if (const auto found = elements_by_label_.find(item.first + k * item.step); found != elements_by_label_.end())
          members.push_back(found->second);
      set_work_ += static_cast<std::size_t>(size);
      return;
    }
    for (const auto& [number, element] : elements_by_label_)
      if (number >= item.first && number <= item.last && (number - item.first) % item.step == 0)
        members.push_back(element);
    set_work_ += elements_by_label_.size();
  }

  void open_surface() {
    const std::string type = upper_case(parameter("TYPE"));
    surface_ = kNoIndex;
    if (!type.empty() && type != "ELEMENT") {
      left_out_.add("surfaces of nodes");
      return;
    }
    const std::string name = parameter("NAME");
    const std::optional<int> number = numbered(name, "GROUP_");
    surface_ = number ? faces_.by_number(*number) : faces_.by_name(name);
  }

  void read_surface(const std::vector<std::string>& fields) {
    if (surface_ == kNoIndex) return;
    const std::string side = fields.size() > 1 ? upper_case(fields[1]) : "";
    const auto number = side.size() == 2 && side[0] == 'S' ? parse_integer(std::string_view(side).substr(1))
                                                            : std::nullopt;
    if (!number) {
      left_out_.add("lines of surfaces without a face S1 to S6");
      return;
    }
    const bool is_element = parse_integer(fields[0]).has_value();
    sides_.push_back({is_element ? label(fields[0], "the number of an element") : 0,
                      is_element ? kNoSet : named_set(fields[0]), static_cast<int>(*number), surface_, line_});
  }

  // --- Building the mesh
  // ----------------------------------------------------------------------------------------------

  /// Without cells, shells are a surface, whose groups are the sets of *ELEMENT.
  void build_shells() {
    GroupList groups;
    std::vector<Index> of_face;
    std::size_t begin = 0;
    for (const Shell& shell : shells_) {
      line_ = shell.line;
      for (; begin < shell.end; ++begin) mesh_.shells.face_vertices.push_back(node_of(shell_nodes_[begin]));
      mesh_.shells.face_offsets.push_back(mesh_.shells.face_vertices.size());
      of_face.push_back(shell.set == kNone ? kNoIndex : groups.by_name(element_sets_[shell.set].name));
    }
    if (groups.groups().size() + (std::find(of_face.begin(), of_face.end(), kNoIndex) != of_face.end()) > 1)
      mesh_.shells.face_groups = {groups.take(), std::move(of_face)};
  }

  void build() {
    if (elements_.empty() && !shells_.empty()) return build_shells();
    std::vector<Index> nodes;
    for (std::size_t e = 0; e < elements_.size(); ++e) {
      const Element& element = elements_[e];
      nodes.clear();
      for (std::size_t i = 0; i < element.num_nodes; ++i) nodes.push_back(node(element, i, e));
      if (element.num_nodes == 27) std::rotate(nodes.begin() + 20, nodes.begin() + 21, nodes.end());
      if (element.num_nodes == 27) order_faces(nodes);
      cells_.add(element.type->kind, element.type->order, NodeOrdering::vtk, nodes);
    }
    add_sides();
    choose_references();
    for (const auto& [type, n] : num_skipped_) left_out_.add("elements of type " + type, n);
    left_out_.tell(mesh_.warnings);
  }

  Index node(const Element& element, std::size_t i, std::size_t e) {
    line_ = lines_[e];
    return node_of(element_nodes_[element.first_node + i]);
  }
  Index node_of(std::int64_t number) const {
    const auto found = nodes_.find(number);
    if (found == nodes_.end())
      fail("an element names node " + std::to_string(number) + ", which the file does not have");
    return found->second;
  }

  /// C3D27 has the middles of the faces S1 to S6 after that of the cell, which has been moved to the end; VTK has them
  /// by coordinates.
  static void order_faces(std::vector<Index>& nodes) {
    constexpr std::size_t kFaces[] = {5, 3, 2, 4, 0, 1};  // -x +x -y +y -z +z
    const std::vector<Index> old(nodes.begin() + 20, nodes.end());
    for (std::size_t f = 0; f < 6; ++f) nodes[20 + f] = old[kFaces[f]];
  }

  void add_sides() {
    for (const Side& side : sides_) {
      line_ = side.line;
      if (side.set == kNoSet) {
        const auto found = elements_by_label_.find(side.element);
        if (found != elements_by_label_.end()) add_side(side, found->second);  // else one that is skipped
        continue;
      }
      if (!element_sets_[side.set].is_defined)
        fail("*SURFACE: there is no element set " + in_quotes(element_sets_[side.set].name));
      const std::vector<std::size_t>& members = members_of(side.set);
      line_ = side.line;
      for (const std::size_t element : members) add_side(side, element);
      constexpr std::size_t kMostFaces = 1u << 26;
      if (mesh_.face_groups.faces.size() > kMostFaces) fail("*SURFACE: too many faces");
    }
    mesh_.face_groups.groups = faces_.take();
  }

  void add_side(const Side& side, std::size_t element) {
    const auto faces = inp_faces(mesh_.kinds[element]);
    if (side.number < 1 || side.number > static_cast<int>(faces.size()))
      fail("*SURFACE: an element has no face S" + std::to_string(side.number));
    std::vector<Index> corners;
    for (const int i : faces[static_cast<std::size_t>(side.number) - 1])
      corners.push_back(mesh_.cell(element)[static_cast<std::size_t>(i)]);
    add_face(mesh_, corners, side.surface);
  }

  /// The sets that say what an element is made of: those of solid sections; else those that subvol writes; else those
  /// of *ELEMENT.
  std::vector<std::size_t> material_sets() const {
    std::vector<std::size_t> sets;
    for (const std::string& section : sections_)
      if (const auto set = set_numbers_.find(section); set != set_numbers_.end()) sets.push_back(set->second);
    if (!sets.empty()) return sets;
    for (std::size_t s = 0; s < element_sets_.size(); ++s)
      if (own_reference(s)) sets.push_back(s);
    if (!sets.empty()) return sets;
    std::set<std::size_t> of_elements;
    for (const Element& element : elements_)
      if (element.set != kNone) of_elements.insert(element.set);
    return {of_elements.begin(), of_elements.end()};
  }

  /// The reference that a set of subvol stands for: REFERENCE_7, or REFERENCE_M7 for -7.
  std::optional<int> own_reference(std::size_t set) const { return numbered(element_sets_[set].name, "REFERENCE_"); }

  void choose_references() {
    const std::vector<std::size_t> sets = material_sets();
    const std::set<std::size_t> materials(sets.begin(), sets.end());
    std::set<std::size_t> used = materials;
    mesh_.references.assign(elements_.size(), 0);
    int next = 1;
    for (const std::size_t s : materials) {
      const std::optional<int> own = own_reference(s);
      const std::vector<std::size_t>& members = members_of(s);
      if (members.empty() || (!own && materials.size() == 1 && members.size() == elements_.size())) continue;
      const int reference = own ? *own : next++;
      for (const std::size_t element : members) mesh_.references[element] = reference;
      if (!own) mesh_.regions.push_back({element_sets_[s].name, reference, 3});
      else name_region(reference, s, used);
    }
    left_out_.add("element sets", element_sets_.size() - used.size());
  }

  /// A set that holds nothing but the set of one of our references has its name.
  void name_region(int reference, std::size_t own, std::set<std::size_t>& used) {
    for (std::size_t s = 0; s < element_sets_.size(); ++s) {
      const InpSet& set = element_sets_[s];
      if (used.contains(s) || set.items.size() != 1 || set.items[0].other != own) continue;
      mesh_.regions.push_back({set.name, reference, 3});
      used.insert(s);
      return;
    }
  }

  std::string name_, file_, keyword_, skipped_type_;
  std::size_t line_ = 0;
  NodalMesh mesh_;
  NodalCells cells_;
  LeftOut left_out_;
  std::map<std::string, std::string> parameters_;
  std::unordered_map<std::int64_t, Index> nodes_;
  std::unordered_map<std::int64_t, std::size_t> elements_by_label_;
  std::vector<Element> elements_;
  std::vector<std::size_t> lines_;                   ///< of elements
  std::vector<std::int64_t> element_nodes_;
  std::vector<Shell> shells_;
  std::vector<std::int64_t> shell_nodes_;            ///< corners
  std::size_t shell_corners_ = 0;                    ///< of the elements being read; 0: no shells
  std::vector<InpSet> element_sets_;
  std::map<std::string, std::size_t> set_numbers_;   ///< by name in upper case
  std::map<std::string, std::size_t> num_skipped_;   ///< lines of elements of other types
  std::vector<std::string> sections_;
  GroupList faces_;
  std::vector<Side> sides_;
  const InpType* type_ = nullptr;
  std::size_t set_ = kNone, set_work_ = 0;
  Index surface_ = kNoIndex;
  bool element_open_ = false;
  int num_included_ = 0, num_parts_ = 0;
};

}  // namespace

NodalMesh parse_inp(const std::string& name, std::string_view bytes, const std::string&) {
  return InpParser(name).parse(bytes);
}

}  // namespace subvol::internal

// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/inp_lines.h"
#include "subvol/io/inp_sets.h"
#include "subvol/io/left_out.h"
#include "subvol/io/mesh_formats.h"
#include "subvol/io/nodal_formats.h"
#include "subvol/io/nodal_sides.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

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
constexpr const char* kSolidFamilies[] = {"C3D", "DC3D",  "AC3D", "DCC3D", "F3D", "EC3D",
                                          "Q3D", "EMC3D", "SC",   "CSS"};  // the last two: shells that are solids
constexpr const char* kShellFamilies[] = {"STRI", "S", "M3D", "R3D", "SFM3D", "DS"};

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

class InpParser {
 public:
  InpParser(const std::string& name, std::string_view bytes)
      : lines_of_file_(name, bytes),
        element_sets_("*ELSET", elements_by_label_),
        node_sets_("*NSET", nodes_),
        cells_(mesh_) {}

  NodalMesh parse() {
    lines_of_file_.visit([this](const InpLine& line) {
      line_ = &line;
      place_ = line.place;
      line.is_data() ? read_data() : open_keyword();
    });
    place_ = lines_of_file_.place();
    if (element_open_) fail("the file ends within an element");
    left_out_.add("parts without an instance", lines_of_file_.unused_parts());
    element_sets_.close(place_);
    node_sets_.close(place_);
    build();
    return std::move(mesh_);
  }

 private:
  struct Element {
    const InpType* type;
    std::size_t first_node, num_nodes;
    std::size_t set;  ///< of *ELEMENT, ELSET=; InpSets::kNone if it has none
    FilePlace place;
  };
  struct Shell {
    std::size_t end;          ///< of its nodes
    std::size_t set;
    FilePlace place;
  };
  struct Side {
    std::int64_t element;  ///< its number, if `set` is InpSets::kNone
    std::size_t set;
    int number;               ///< of the face
    Index surface;            ///< place in the list of groups
    FilePlace place;
  };
  static constexpr std::size_t kNone = InpSets::kNone;

  [[noreturn]] void fail(const std::string& what) const { fail_at(place_, what); }

  void open_keyword() {
    if (element_open_) fail("a keyword within an element: expected more nodes");
    const std::string& keyword = line_->keyword;
    if (keyword == "NODE")
      open_nodes();
    else if (keyword == "ELEMENT")
      open_elements();
    else if (keyword == "NSET" || keyword == "ELSET")
      open_set();
    else if (keyword == "SURFACE")
      open_surface();
    else if (keyword == "SOLID SECTION")
      sections_.push_back(element_sets_.named(line_->parameter("ELSET"), line_->instance));
    else if (keyword == "SYSTEM" || keyword == "NCOPY" || keyword == "NGEN" || keyword == "ELGEN" ||
             keyword == "NFILL" || keyword == "ELCOPY" || keyword == "NMAP")
      fail("*" + keyword + " is not read: write the nodes and elements themselves");
    else
      left_out_.add("keywords *" + keyword);
  }

  void read_data() {
    const std::string& keyword = line_->keyword;
    const std::vector<std::string>& fields = line_->fields;
    if (keyword == "NODE")
      read_node(fields);
    else if (keyword == "ELEMENT")
      read_element(fields);
    else if (keyword == "NSET" || keyword == "ELSET")
      read_set(fields);
    else if (keyword == "SURFACE")
      read_surface(fields);
  }

  std::int64_t positive(const std::string& text, const char* what) const {
    const auto value = parse_integer(text);
    if (!value || *value <= 0)
      fail(std::string("expected ") + what + " (a positive whole number), found " + in_quotes(text));
    if (*value >= kInpNumbers) fail(std::string("expected ") + what + " below " + std::to_string(kInpNumbers));
    return *value;
  }
  /// The number of a node or an element of an instance; null: the assembly.
  std::int64_t label(const std::string& text, const char* what, const InpInstance* instance) const {
    return positive(text, what) + (instance ? instance->first : 0);
  }
  std::int64_t label(const std::string& text, const char* what) const { return label(text, what, line_->instance); }

  // --- Nodes and elements --------------------------------------------------------------------------------------------

  void open_nodes() {
    if (const std::string system = line_->parameter("SYSTEM"); !system.empty() && upper_case(system) != "R")
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
    if (line_->instance) p = line_->instance->rotation * p + line_->instance->shift;
    const auto [known, is_new] = nodes_.try_emplace(number, static_cast<Index>(mesh_.positions.size()));
    if (is_new) mesh_.positions.push_back(p);
    else mesh_.positions[known->second] = p;  // a later definition replaces an earlier one
  }

  void open_elements() {
    const std::string type = upper_case(line_->parameter("TYPE"));
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
    set_ = line_->has("ELSET") ? element_sets_.defined(line_->parameter("ELSET"), line_->instance) : kNone;
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
    shells_.push_back({shell_nodes_.size(), set_, place_});
  }

  void read_element(const std::vector<std::string>& fields) {
    if (!type_) {
      ++(shell_corners_ > 0 ? num_shells_ : num_skipped_)[skipped_type_];
      if (shell_corners_ > 0) read_shell(fields);
      return;
    }
    std::size_t at = 0;
    if (!element_open_) {
      const std::int64_t number = label(fields[at++], "the number of an element");
      if (!elements_by_label_.try_emplace(number, static_cast<Index>(elements_.size())).second)
        fail("a second element " + std::to_string(number % kInpNumbers));
      if (set_ != kNone) element_sets_.add_range(set_, number, number, 1, place_);
      elements_.push_back({type_, element_nodes_.size(), static_cast<std::size_t>(type_->digits), set_, place_});
      element_open_ = true;
    }
    const std::size_t end = elements_.back().first_node + elements_.back().num_nodes;
    for (; at < fields.size(); ++at) {
      if (element_nodes_.size() == end) fail("more nodes than an element of its type has");
      element_nodes_.push_back(label(fields[at], "the number of a node"));
    }
    element_open_ = element_nodes_.size() < end;
  }

  // --- Sets ----------------------------------------------------------------------------------------------------------

  /// The instance whose sets and numbers a line of a set or a surface names.
  const InpInstance* instance_of_set() const {
    if (line_->instance || !line_->has("INSTANCE")) return line_->instance;
    const InpInstance* instance = lines_of_file_.instance(line_->parameter("INSTANCE"));
    // A file without parts may name instances that it was made of.
    if (!instance && lines_of_file_.has_parts())
      fail("there is no instance " + in_quotes(line_->parameter("INSTANCE")));
    return instance;
  }

  void open_set() {
    const std::string name = line_->parameter(line_->keyword.c_str());
    if (name.empty()) fail("*" + line_->keyword + ": expected a name");
    sets_ = line_->keyword == "NSET" ? &node_sets_ : &element_sets_;
    set_ = sets_->defined(name, line_->instance);
    from_element_set_ = sets_ == &node_sets_ && line_->has("ELSET");
    if (from_element_set_) left_out_.add("node sets of element sets");
  }

  void read_set(const std::vector<std::string>& fields) {
    if (from_element_set_) return;
    const InpInstance* instance = instance_of_set();
    if (line_->has("GENERATE")) {
      if (fields.size() < 2) fail("GENERATE: expected a first and a last number");
      const std::int64_t first = label(fields[0], "the first number", instance),
                         last = label(fields[1], "the last number", instance);
      sets_->add_range(set_, first, last, fields.size() > 2 ? positive(fields[2], "the step") : 1, place_);
      return;
    }
    for (const std::string& field : fields) {
      if (field.empty()) continue;
      const auto [own, rest] = split(field, instance);
      if (parse_integer(rest)) {
        const std::int64_t number = label(rest, "the number of a member", own);
        sets_->add_range(set_, number, number, 1, place_);
      } else {
        sets_->add_set(set_, sets_->named(rest, own), place_);
      }
    }
  }

  /// Splits INSTANCE.NUMBER and INSTANCE.SET. Returns the instance, and what is behind its name.
  std::pair<const InpInstance*, std::string> split(const std::string& field, const InpInstance* otherwise) const {
    for (std::size_t dot = field.rfind('.'); dot != std::string::npos && dot > 0; dot = field.rfind('.', dot - 1))
      if (const InpInstance* instance = lines_of_file_.instance(field.substr(0, dot)))
        return {instance, field.substr(dot + 1)};
    return {otherwise, field};
  }

  void open_surface() {
    const std::string type = upper_case(line_->parameter("TYPE"));
    surface_ = kNoIndex;
    if (!type.empty() && type != "ELEMENT") {
      left_out_.add("surfaces of nodes");
      return;
    }
    const std::string name = line_->parameter("NAME");
    const std::optional<int> number = numbered(name, "GROUP_");
    const bool is_inside = line_->instance && !line_->instance->name.empty();
    surface_ =
        number ? faces_.by_number(*number) : faces_.by_name(is_inside ? line_->instance->name + "." + name : name);
    if (is_inside && !number) plain_names_[surface_] = name;
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
    const auto [instance, rest] = split(fields[0], instance_of_set());
    const bool is_element = parse_integer(rest).has_value();
    sides_.push_back({is_element ? label(rest, "the number of an element", instance) : 0,
                      is_element ? kNone : element_sets_.named(rest, instance), static_cast<int>(*number), surface_,
                      place_});
  }

  // --- Building the mesh ---------------------------------------------------------------------------------------------

  /// Without cells, shells are a surface, whose groups are the sets of *ELEMENT.
  void build_shells() {
    GroupList groups;
    std::vector<Index> of_face;
    std::size_t begin = 0;
    for (const Shell& shell : shells_) {
      place_ = shell.place;
      for (; begin < shell.end; ++begin) mesh_.shells.face_vertices.push_back(node_of(shell_nodes_[begin]));
      mesh_.shells.face_offsets.push_back(mesh_.shells.face_vertices.size());
      of_face.push_back(shell.set == kNone ? kNoIndex : groups.by_name(element_sets_.name(shell.set)));
    }
    if (groups.groups().size() + (std::find(of_face.begin(), of_face.end(), kNoIndex) != of_face.end()) > 1)
      mesh_.shells.face_groups = {groups.take(), std::move(of_face)};
  }

  void count_sets_of_shells() {
    std::set<std::size_t> used;
    for (const Shell& shell : shells_) used.insert(shell.set);
    for (std::size_t s = 0; s < node_sets_.size(); ++s) left_out_.add("node sets", node_sets_.is_defined(s));
    for (std::size_t s = 0; s < element_sets_.size(); ++s)
      left_out_.add("element sets", element_sets_.is_defined(s) && !used.contains(s));
  }

  void tell_left_out() {
    for (const auto& [type, n] : num_skipped_) left_out_.add("elements of type " + type, n);
    left_out_.tell(mesh_.warnings);
  }

  void build() {
    if (elements_.empty() && !shells_.empty()) {
      build_shells();
      count_sets_of_shells();
      tell_left_out();
      return;
    }
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
    add_node_sets();
    mesh_.face_groups.groups = group_names();
    choose_references();
    for (const auto& [type, n] : num_shells_) num_skipped_[type] += n;
    tell_left_out();
  }

  Index node(const Element& element, std::size_t i, std::size_t e) {
    place_ = elements_[e].place;
    return node_of(element_nodes_[element.first_node + i]);
  }
  Index node_of(std::int64_t number) const {
    const auto found = nodes_.find(number);
    if (found == nodes_.end())
      fail("an element names node " + std::to_string(number % kInpNumbers) + ", which the file does not have");
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
      place_ = side.place;
      if (side.set == kNone) {
        const auto found = elements_by_label_.find(side.element);
        if (found != elements_by_label_.end()) add_side(side, found->second);  // else one that is skipped
        continue;
      }
      if (!element_sets_.is_defined(side.set))
        fail("*SURFACE: there is no element set " + in_quotes(element_sets_.name(side.set)));
      for (const Index element : element_sets_.members(side.set)) add_side(side, element);
      constexpr std::size_t kMostFaces = 1u << 26;
      if (mesh_.face_groups.faces.size() > kMostFaces) fail("*SURFACE: too many faces");
    }
  }

  /// The names of the groups: those of instances without the instance if no other group has the name.
  std::vector<Group> group_names() {
    std::vector<Group> groups = faces_.take();
    std::map<std::string, int> times;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const auto plain = plain_names_.find(static_cast<Index>(g));
      ++times[plain == plain_names_.end() ? groups[g].name : plain->second];
    }
    for (const auto& [g, name] : plain_names_)
      if (times[name] == 1) groups[g].name = name;
    return groups;
  }

  /// Makes groups of the faces of the boundary all of whose corners are in a set of nodes. No groups are made of sets
  /// without such a face or with all of them, or that have the name of a surface.
  void add_node_sets() {
    std::vector<std::size_t> wanted;
    for (std::size_t s = 0; s < node_sets_.size(); ++s)
      if (node_sets_.is_defined(s) && !has_group(node_sets_.name(s))) wanted.push_back(s);
    if (wanted.empty()) return;
    BoundaryOfNodes boundary(mesh_);
    for (const std::size_t s : wanted) {
      const auto faces = boundary.faces_of(node_sets_.members(s));
      if (faces.empty()) {
        left_out_.add("node sets of no faces, or of all");
        continue;
      }
      const Index group = faces_.by_name(node_sets_.name(s));
      for (const std::span<const Index> face : faces) add_face(mesh_, face, group);
    }
  }

  bool has_group(const std::string& name) const {
    const auto is_name = [&](const std::string& other) { return upper_case(other) == upper_case(name); };
    return std::ranges::any_of(faces_.groups(),
                               [&](const Group& group) {
                                 return is_name(group.name) ||
                                        (group.name.empty() && is_name("GROUP_" + std::to_string(group.number)));
                               }) ||
           std::ranges::any_of(plain_names_, [&](const auto& plain) { return is_name(plain.second); });
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
    for (const std::size_t set : sections_)
      if (element_sets_.is_defined(set)) sets.push_back(set);
    if (!sets.empty()) return sets;
    for (std::size_t s = 0; s < element_sets_.size(); ++s)
      if (element_sets_.is_defined(s) && own_reference(s)) sets.push_back(s);
    if (!sets.empty()) return sets;
    std::set<std::size_t> of_elements;
    for (const Element& element : elements_)
      if (element.set != kNone) of_elements.insert(element.set);
    return {of_elements.begin(), of_elements.end()};
  }

  /// The reference that a set of subvol stands for: REFERENCE_7, or REFERENCE_M7 for -7.
  std::optional<int> own_reference(std::size_t set) const { return numbered(element_sets_.name(set), "REFERENCE_"); }

  void choose_references() {
    const std::vector<std::size_t> sets = material_sets();
    const std::set<std::size_t> materials(sets.begin(), sets.end());
    std::set<std::size_t> used = materials;
    mesh_.references.assign(elements_.size(), 0);
    int next = 1;
    for (const std::size_t s : materials) {
      const std::optional<int> own = own_reference(s);
      const std::vector<Index>& members = element_sets_.members(s);
      if (members.empty() || (!own && materials.size() == 1 && members.size() == elements_.size())) continue;
      const int reference = own ? *own : next++;
      for (const Index element : members) mesh_.references[element] = reference;
      if (!own)
        mesh_.regions.push_back({element_sets_.name(s), reference, 3});
      else name_region(reference, s, used);
    }
    if (const std::size_t all = set_of_all_elements(); all != kNone) used.insert(all);  // it says nothing
    std::size_t defined = 0;
    for (std::size_t s = 0; s < element_sets_.size(); ++s) defined += element_sets_.is_defined(s);
    left_out_.add("element sets", defined - std::min(defined, used.size()));
  }

  /// The set that every *ELEMENT names; kNone if there is none.
  std::size_t set_of_all_elements() const {
    const std::size_t first = elements_.empty() ? kNone : elements_.front().set;
    const bool is_of_all = std::ranges::all_of(elements_, [&](const Element& element) { return element.set == first; });
    return is_of_all && first != kNone && element_sets_.is_defined(first) ? first : kNone;
  }

  /// A set that holds nothing but the set of one of our references has its name.
  void name_region(int reference, std::size_t own, std::set<std::size_t>& used) {
    for (std::size_t s = 0; s < element_sets_.size(); ++s) {
      if (used.contains(s) || element_sets_.only_other(s) != own) continue;
      mesh_.regions.push_back({element_sets_.name(s), reference, 3});
      used.insert(s);
      return;
    }
  }

  InpLines lines_of_file_;
  const InpLine* line_ = nullptr;
  FilePlace place_;  ///< of what is read or built, for messages
  std::unordered_map<std::int64_t, Index> nodes_, elements_by_label_;
  InpSets element_sets_, node_sets_;
  NodalMesh mesh_;
  NodalCells cells_;
  LeftOut left_out_;
  std::vector<Element> elements_;
  std::vector<std::int64_t> element_nodes_;
  std::vector<Shell> shells_;
  std::vector<std::int64_t> shell_nodes_;            ///< corners
  std::size_t shell_corners_ = 0;                    ///< of the elements being read; 0: no shells
  std::map<std::string, std::size_t> num_skipped_;   ///< lines of elements of other types, but for
  std::map<std::string, std::size_t> num_shells_;    ///< those of shells
  std::vector<std::size_t> sections_;                ///< their sets of elements
  GroupList faces_;
  std::map<Index, std::string> plain_names_;  ///< of surfaces of instances, without the instance
  std::vector<Side> sides_;
  const InpType* type_ = nullptr;
  std::string skipped_type_;
  InpSets* sets_ = nullptr;  ///< of the set that is being read
  std::size_t set_ = kNone;
  Index surface_ = kNoIndex;
  bool element_open_ = false, from_element_set_ = false;
};

}  // namespace

NodalMesh parse_inp(const std::string& name, std::string_view bytes, const std::string&) {
  return InpParser(name, bytes).parse();
}

}  // namespace subvol::internal

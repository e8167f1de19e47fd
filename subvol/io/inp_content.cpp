// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/inp_content.h"

#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/inp_lines.h"
#include "subvol/io/nodal_sides.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <span>
#include <utility>

namespace subvol::internal {

namespace {

/// Makes a mesh from the content of a file.
class InpMesh {
 public:
  explicit InpMesh(InpContent& content) : content_(content), cells_(mesh_) {}

  NodalMesh make() {
    mesh_.positions = std::move(content_.positions);
    if (content_.elements.empty() && !content_.shells.empty()) {
      build_shells();
      count_sets_of_shells();
      tell_left_out();
      return std::move(mesh_);
    }
    std::vector<Index> nodes;
    for (const InpContent::Element& element : content_.elements) {
      place_ = element.place;
      nodes.clear();
      for (std::size_t i = 0; i < element.num_nodes; ++i)
        nodes.push_back(node_of(content_.element_nodes[element.first_node + i]));
      if (element.num_nodes == 27) std::rotate(nodes.begin() + 20, nodes.begin() + 21, nodes.end());
      if (element.num_nodes == 27) order_faces(nodes);
      cells_.add(element.type->kind, element.type->order, NodeOrdering::vtk, nodes);
    }
    add_sides();
    add_node_sets();
    mesh_.face_groups.groups = group_names();
    choose_references();
    for (const auto& [type, n] : content_.num_shells) content_.num_skipped[type] += n;
    tell_left_out();
    return std::move(mesh_);
  }

 private:
  static constexpr std::size_t kNoElementSet = InpSets::kNoInpSet;
  static constexpr std::size_t kMostInpGroupFaces = 1u << 26;  ///< sets of sets could double with every line

  [[noreturn]] void fail(const std::string& what) const { fail_at(place_, what); }

  /// Without cells, shells are a surface, whose groups are the sets of *ELEMENT.
  void build_shells() {
    GroupList groups;
    std::vector<Index> of_face;
    std::size_t begin = 0;
    for (const InpContent::Shell& shell : content_.shells) {
      place_ = shell.place;
      for (; begin < shell.end; ++begin) mesh_.shells.face_vertices.push_back(node_of(content_.shell_nodes[begin]));
      mesh_.shells.face_offsets.push_back(mesh_.shells.face_vertices.size());
      of_face.push_back(shell.set == kNoElementSet ? kNoIndex : groups.by_name(content_.element_sets.name(shell.set)));
    }
    if (groups.groups().size() + (std::find(of_face.begin(), of_face.end(), kNoIndex) != of_face.end()) > 1)
      mesh_.shells.face_groups = {groups.take(), std::move(of_face)};
  }

  void count_sets_of_shells() {
    std::set<std::size_t> used;
    for (const InpContent::Shell& shell : content_.shells) used.insert(shell.set);
    for (std::size_t s = 0; s < content_.node_sets.size(); ++s)
      content_.left_out.add("node sets", content_.node_sets.is_defined(s));
    for (std::size_t s = 0; s < content_.element_sets.size(); ++s)
      content_.left_out.add("element sets", content_.element_sets.is_defined(s) && !used.contains(s));
  }

  void tell_left_out() {
    for (const auto& [type, n] : content_.num_skipped) content_.left_out.add("elements of type " + type, n);
    content_.left_out.tell(mesh_.warnings);
  }

  Index node_of(std::int64_t number) const {
    const auto found = content_.nodes.find(number);
    if (found == content_.nodes.end())
      fail("an element names node " + std::to_string(number % kInpNumbers) + ", which the file does not have");
    return found->second;
  }

  /// C3D27 has the middles of the faces S1 to S6 after that of the cell, which has been moved to the end; VTK has them
  /// by coordinates.
  static void order_faces(std::vector<Index>& nodes) {
    constexpr std::size_t kInpFaceOfVtk[] = {5, 3, 2, 4, 0, 1};  // -x +x -y +y -z +z
    const std::vector<Index> old(nodes.begin() + 20, nodes.end());
    for (std::size_t f = 0; f < 6; ++f) nodes[20 + f] = old[kInpFaceOfVtk[f]];
  }

  void add_sides() {
    for (const InpContent::Side& side : content_.sides) {
      place_ = side.place;
      if (side.set == kNoElementSet) {
        const auto found = content_.elements_by_label.find(side.element);
        if (found != content_.elements_by_label.end()) add_side(side, found->second);  // else one that is skipped
        continue;
      }
      if (!content_.element_sets.is_defined(side.set))
        fail("*SURFACE: there is no element set " + in_quotes(content_.element_sets.name(side.set)));
      for (const Index element : content_.element_sets.members(side.set)) add_side(side, element);
      if (mesh_.face_groups.faces.size() > kMostInpGroupFaces) fail("*SURFACE: too many faces");
    }
  }

  /// The names of the groups: those of instances without the instance if no other group has the name.
  std::vector<Group> group_names() {
    std::vector<Group> groups = content_.faces.take();
    std::map<std::string, int> times;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const auto plain = content_.plain_names.find(static_cast<Index>(g));
      ++times[plain == content_.plain_names.end() ? groups[g].name : plain->second];
    }
    for (const auto& [g, name] : content_.plain_names)
      if (times[name] == 1) groups[g].name = name;
    return groups;
  }

  /// Makes groups of the faces of the boundary all of whose corners are in a set of nodes. No groups are made of sets
  /// without such a face or with all of them, or that have the name of a surface.
  void add_node_sets() {
    const std::set<std::string> surfaces = names_of_surfaces();
    std::vector<std::size_t> wanted;
    for (std::size_t s = 0; s < content_.node_sets.size(); ++s)
      if (content_.node_sets.is_defined(s) && !surfaces.contains(upper_case(content_.node_sets.name(s))))
        wanted.push_back(s);
    if (wanted.empty()) return;
    BoundaryOfNodes boundary(mesh_);
    for (const std::size_t s : wanted) {
      const auto faces = boundary.faces_of(content_.node_sets.members(s));
      if (faces.empty()) {
        content_.left_out.add("node sets of no faces, or of all");
        continue;
      }
      const Index group = content_.faces.by_name(content_.node_sets.name(s));
      for (const std::span<const Index> face : faces) add_face(mesh_, face, group);
      if (mesh_.face_groups.faces.size() > kMostInpGroupFaces) fail("*NSET: too many faces");
    }
  }

  /// The names of the surfaces, in upper case.
  std::set<std::string> names_of_surfaces() const {
    std::set<std::string> names;
    for (const Group& group : content_.faces.groups())
      names.insert(group.name.empty() ? "GROUP_" + std::to_string(group.number) : upper_case(group.name));
    for (const auto& [group, name] : content_.plain_names) names.insert(upper_case(name));
    return names;
  }

  void add_side(const InpContent::Side& side, std::size_t element) {
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
    for (const std::size_t set : content_.sections)
      if (content_.element_sets.is_defined(set)) sets.push_back(set);
    if (!sets.empty()) return sets;
    for (std::size_t s = 0; s < content_.element_sets.size(); ++s)
      if (content_.element_sets.is_defined(s) && own_reference(s)) sets.push_back(s);
    if (!sets.empty()) return sets;
    std::set<std::size_t> of_elements;
    for (const InpContent::Element& element : content_.elements)
      if (element.set != kNoElementSet) of_elements.insert(element.set);
    return {of_elements.begin(), of_elements.end()};
  }

  /// The reference that a set of subvol stands for: REFERENCE_7, or REFERENCE_M7 for -7.
  std::optional<int> own_reference(std::size_t set) const {
    return inp_number(content_.element_sets.name(set), "REFERENCE_");
  }

  void choose_references() {
    const std::vector<std::size_t> sets = material_sets();
    const std::set<std::size_t> materials(sets.begin(), sets.end());
    std::set<std::size_t> used = materials;
    std::map<std::size_t, std::vector<std::size_t>> sets_of_one;  // that hold nothing but the set
    for (std::size_t s = 0; s < content_.element_sets.size(); ++s)
      if (const std::size_t other = content_.element_sets.only_other(s); other != kNoElementSet)
        sets_of_one[other].push_back(s);
    mesh_.references.assign(content_.elements.size(), 0);
    int next = 1;
    for (const std::size_t s : materials) {
      const std::optional<int> own = own_reference(s);
      const std::vector<Index>& members = content_.element_sets.members(s);
      if (members.empty() || (!own && materials.size() == 1 && members.size() == content_.elements.size())) continue;
      const int reference = own ? *own : next++;
      for (const Index element : members) mesh_.references[element] = reference;
      if (!own)
        mesh_.regions.push_back({content_.element_sets.name(s), reference, 3});
      else
        name_region(reference, sets_of_one[s], used);
    }
    if (const std::size_t all = set_of_all_elements(); all != kNoElementSet) used.insert(all);  // it says nothing
    std::size_t defined = 0;
    for (std::size_t s = 0; s < content_.element_sets.size(); ++s) defined += content_.element_sets.is_defined(s);
    content_.left_out.add("element sets", defined - std::min(defined, used.size()));
  }

  /// The set that every *ELEMENT names; kNoElementSet if there is none.
  std::size_t set_of_all_elements() const {
    const std::size_t first = content_.elements.empty() ? kNoElementSet : content_.elements.front().set;
    const bool is_of_all = std::ranges::all_of(
        content_.elements, [&](const InpContent::Element& element) { return element.set == first; });
    return is_of_all && first != kNoElementSet && content_.element_sets.is_defined(first) ? first : kNoElementSet;
  }

  /// A set that holds nothing but the set of one of our references has its name.
  void name_region(int reference, const std::vector<std::size_t>& sets_of_one, std::set<std::size_t>& used) {
    for (const std::size_t s : sets_of_one) {
      if (used.contains(s)) continue;
      mesh_.regions.push_back({content_.element_sets.name(s), reference, 3});
      used.insert(s);
      return;
    }
  }

  InpContent& content_;
  FilePlace place_;  ///< of what is made, for messages
  NodalMesh mesh_;
  NodalCells cells_;
};

}  // namespace

std::optional<int> inp_number(const std::string& name, std::string_view prefix) {
  std::string number = upper_case(name);
  if (!number.starts_with(prefix)) return std::nullopt;
  number.erase(0, prefix.size());
  if (number.starts_with("M")) number[0] = '-';
  const auto value = parse_integer(number);
  if (!value || std::abs(*value) > std::numeric_limits<int>::max()) return std::nullopt;
  return static_cast<int>(*value);
}

NodalMesh mesh_of_inp(InpContent& content) { return InpMesh(content).make(); }

}  // namespace subvol::internal

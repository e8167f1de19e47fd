// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/cell_orientation.h"
#include "subvol/io/left_out.h"
#include "subvol/io/mesh_formats.h"
#include "subvol/io/nastran_cards.h"
#include "subvol/io/nastran_points.h"
#include "subvol/io/nodal_formats.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <unordered_map>

namespace subvol::internal {

namespace {

/// A solid of Nastran. place[i]: the card's number of node i of `NodeOrdering::vtk`.
struct SolidCard {
  const char* name;
  CellKind kind;
  std::size_t num_corners, num_nodes;
  std::vector<std::size_t> place;
};

/// Nastran lists the middles of upright edges before those of the top.
const std::vector<SolidCard>& solid_cards() {
  static const std::vector<SolidCard> kCards{
      {"CTETRA", CellKind::tet, 4, 10, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9}},
      {"CPYRAM", CellKind::pyramid, 5, 5, {0, 1, 2, 3, 4}},
      {"CPYRA", CellKind::pyramid, 5, 5, {0, 1, 2, 3, 4}},  // of OptiStruct and meshio
      {"CPENTA", CellKind::prism, 6, 15, {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14, 9, 10, 11}},
      {"CHEXA", CellKind::hex, 8, 20, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15}},
  };
  return kCards;
}

/// Elements whose names do not begin with a C, and cards that are no elements although theirs do, besides those of
/// coordinate systems and of the panels of aerodynamics.
constexpr const char* kRigidElements[] = {"rbe1", "rbe2", "rbe3", "rbar", "rrod"};
constexpr const char* kNoElements[] = {"campbll", "cbarao", "cend",    "cload", "conv",   "convm", "creep", "cset",
                                       "cset1",   "csuper", "csupext", "cyax",  "cyjoin", "cysup", "cysym"};
bool is_other_element(std::string_view name) {
  const auto is_in = [&](const auto& names) {
    return std::find(std::begin(names), std::end(names), name) != std::end(names);
  };
  if (!name.starts_with("c")) return is_in(kRigidElements);
  const auto is_sign = [](char c) { return !(c >= 'a' && c <= 'z') && !(c >= '0' && c <= '9'); };
  return !name.starts_with("cord") && !name.starts_with("caero") && !is_in(kNoElements) &&
         std::none_of(name.begin(), name.end(), is_sign);
}

class NastranParser {
 public:
  NastranParser(const std::string& name, std::string_view bytes) : cards_(name, bytes), cells_(mesh_) {}

  NodalMesh parse() {
    cards_.visit([this](const NastranCard& card) { read(card); });
    build();
    return std::move(mesh_);
  }

 private:
  struct Element {
    const SolidCard* solid;  ///< null: a face
    std::int64_t property;
    std::vector<std::int64_t> nodes;  ///< 0: left out
    FilePlace place;
  };

  void read(const NastranCard& card) {
    const std::string& name = card.name();
    const auto solid = std::find_if(solid_cards().begin(), solid_cards().end(),
                                    [&](const SolidCard& known) { return lower_case(known.name) == name; });
    if (name == "grid") {
      require_whole(card);
      points_.add_point(card);
    } else if (solid != solid_cards().end()) {
      read_solid(card, *solid);
    } else if (name == "cquad4" || name == "cquad8" || name == "cquadr") {
      read_shell(card, 4);
    } else if (name == "ctria3" || name == "ctria6" || name == "ctriar") {
      read_shell(card, 3);
    } else if (name == "grdset") {
      points_.set_defaults(card);
    } else if (name.size() == 6 && name.starts_with("cord") && (name[4] == '1' || name[4] == '2')) {
      points_.add_system(card);
    } else if (name.starts_with("begin")) {
      if (points_.empty() && elements_.empty())
        left_out_ = {};  // words of the executive and case control sections
      else
        begin_ = card.place.line;
    } else if (is_other_element(name)) {
      left_out_.add("elements of type " + upper_case(name));
    }
  }

  /// Throws InputError if lines of the card are missing, or if it is in a section with numbers of its own.
  void require_whole(const NastranCard& card) const {
    if (!card.broken.empty())
      card.fail("the continuation " + in_quotes(card.broken) +
                " below it belongs to another card: expected every "
                "continuation right behind its line");
    if (begin_ != 0)
      card.fail("in the section that begins in line " + std::to_string(begin_) +
                ", as of a superelement, numbers of "
                "points start anew: put each section into a file of its own");
  }

  /// Some programs leave the property out.
  static std::int64_t property(const NastranCard& card) {
    return card.field(2).empty() ? 0 : card.positive(2, "the number of a property");
  }

  void read_solid(const NastranCard& card, const SolidCard& solid) {
    require_whole(card);
    constexpr std::size_t kPyramidMiddles = 8;
    if (solid.kind == CellKind::pyramid && !card.field(kPyramidMiddles).empty() && card.field(kPyramidMiddles) != "0")
      card.fail(std::string("a curved pyramid: ") + kNoCurvedPyramids);
    Element element{&solid, property(card), {}, card.place};
    for (std::size_t i = 0; i < solid.num_nodes; ++i) {
      const bool is_corner = i < solid.num_corners, is_blank = card.field(3 + i).empty() || card.field(3 + i) == "0";
      element.nodes.push_back(!is_corner && is_blank ? 0 : card.positive(3 + i, "the number of a point"));
    }
    elements_.push_back(std::move(element));
    ++num_solids_;
  }

  void read_shell(const NastranCard& card, std::size_t num_corners) {
    require_whole(card);
    Element element{nullptr, property(card), {}, card.place};
    for (std::size_t i = 0; i < num_corners; ++i)
      element.nodes.push_back(card.positive(3 + i, "the number of a point"));
    elements_.push_back(std::move(element));
  }

  // --- Building the mesh --------------------------------------------------------------------------------------------

  Index point(const Element& element, std::size_t i) const {
    const auto found = points_.find(element.nodes[i]);
    if (!found)
      fail_at(element.place,
              "an element names GRID " + std::to_string(element.nodes[i]) + ", which the file does not have");
    return *found;
  }

  static int number_of(std::int64_t property) {
    return static_cast<int>(std::min<std::int64_t>(property, std::numeric_limits<int>::max()));
  }

  void build() {
    mesh_.positions = points_.positions();
    left_out_.tell(mesh_.warnings);
    if (num_solids_ == 0) return build_shells();
    GroupList faces;
    for (const Element& element : elements_) {
      if (element.solid) {
        add_solid(element);
        mesh_.references.push_back(number_of(element.property));
      } else {
        add_face(mesh_, corners_of(element), faces.by_number(number_of(element.property)));
      }
    }
    const auto is_one = [](int reference) { return reference == 1; };  // which all have that have none
    if (std::all_of(mesh_.references.begin(), mesh_.references.end(), is_one)) mesh_.references.clear();
    mesh_.face_groups.groups = faces.take();
    if (const std::size_t n = turn_cells_alike(mesh_))
      mesh_.warnings.push_back(std::to_string(n) +
                               " cells are numbered left-handed, as Nastran permits: their nodes are numbered anew");
  }

  /// Without cells, shells are a surface, whose groups are their properties.
  void build_shells() {
    GroupList groups;
    std::vector<Index> of_face;
    for (const Element& element : elements_) {
      for (const Index corner : corners_of(element)) mesh_.shells.face_vertices.push_back(corner);
      mesh_.shells.face_offsets.push_back(mesh_.shells.face_vertices.size());
      of_face.push_back(groups.by_number(number_of(element.property)));
    }
    if (groups.groups().size() > 1) mesh_.shells.face_groups = {groups.take(), std::move(of_face)};
  }

  std::vector<Index> corners_of(const Element& face) const {
    std::vector<Index> corners;
    for (std::size_t i = 0; i < face.nodes.size(); ++i) corners.push_back(point(face, i));
    return corners;
  }

  /// An edge without its middle is straight, if others of the cell have theirs.
  void add_solid(const Element& element) {
    const SolidCard& solid = *element.solid;
    const bool is_curved = std::any_of(element.nodes.begin() + static_cast<std::ptrdiff_t>(solid.num_corners),
                                       element.nodes.end(), [](std::int64_t node) { return node != 0; });
    std::vector<Index> nodes;
    const std::size_t count = is_curved ? solid.num_nodes : solid.num_corners;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t place = solid.place[i];
      nodes.push_back(element.nodes[place] != 0 ? point(element, place) : straight_middle(solid.kind, i, nodes));
    }
    cells_.add(solid.kind, is_curved ? 2 : 1, NodeOrdering::vtk, nodes);
  }

  Index straight_middle(CellKind kind, std::size_t i, const std::vector<Index>& nodes) {
    const auto lattice = cell_lattice(kind, 2, NodeOrdering::vtk);
    std::vector<Index> ends;
    const auto corners = static_cast<std::size_t>(cell_topology(kind).num_vertices);
    for (std::size_t a = 0; a < corners; ++a)
      for (std::size_t b = a + 1; b < corners; ++b)
        if (lattice[a] + lattice[b] == 2 * lattice[i] && ends.empty()) ends = {nodes[a], nodes[b]};
    std::sort(ends.begin(), ends.end());
    const auto [known, is_new] = middles_.try_emplace({ends[0], ends[1]}, static_cast<Index>(mesh_.positions.size()));
    if (is_new) mesh_.positions.push_back((mesh_.positions[ends[0]] + mesh_.positions[ends[1]]) / 2);
    return known->second;
  }

  NastranCards cards_;
  NodalMesh mesh_;
  NodalCells cells_;
  NastranPoints points_;
  LeftOut left_out_;
  std::size_t num_solids_ = 0;
  std::size_t begin_ = 0;  ///< line of the BEGIN of a further section; 0: none
  std::map<std::pair<Index, Index>, Index> middles_;
  std::vector<Element> elements_;
};

}  // namespace

NodalMesh parse_nastran(const std::string& name, std::string_view bytes, const std::string&) {
  return NastranParser(name, bytes).parse();
}

}  // namespace subvol::internal

// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/left_out.h"
#include "subvol/io/mesh_formats.h"
#include "subvol/io/nodal_formats.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <unordered_map>

namespace subvol::internal {

namespace {

/// Replaces tabs by blanks up to the next column of eight.
std::string without_tabs(std::string_view line) {
  std::string result;
  for (const char c : line) {
    if (c != '\t') result += c;
    else result.append(8 - result.size() % 8, ' ');
  }
  return result;
}

/// A number of Nastran: "1.5", "1.5E+3", "1.5D3", and "1.5+3" without a letter.
std::optional<double> nastran_number(const std::string& field) {
  std::string text;
  for (std::size_t i = 0; i < field.size(); ++i) {
    const char c = field[i];
    const bool is_letter = c == 'd' || c == 'D' || c == 'e' || c == 'E';
    const bool is_sign = (c == '+' || c == '-') && i > 0 && text.back() != 'e';
    if (is_sign) text += 'e';
    text += is_letter ? 'e' : c;
  }
  if (text.starts_with("+")) text.erase(0, 1);
  if (const std::size_t plus = text.find("e+"); plus != std::string::npos) text.erase(plus + 1, 1);
  return parse_number(text);
}

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

/// Rigid elements. All other elements have names that begin with a C, as have the cards of coordinate systems (CORD2R
/// and so on) and the end of the executive section (CEND).
constexpr const char* kRigidElements[] = {"rbe1", "rbe2", "rbe3", "rbar", "rrod"};
bool is_other_element(std::string_view name) {
  if (name.starts_with("c")) return !name.starts_with("cord") && name != "cend";
  return std::find(std::begin(kRigidElements), std::end(kRigidElements), name) != std::end(kRigidElements);
}

class NastranParser {
 public:
  NastranParser(const std::string& name, std::string_view bytes)
      : lines_(name, bytes, TextScanner::Comments::none), name_(name), cells_(mesh_) {}

  NodalMesh parse() {
    while (const auto line = lines_.line()) read_line(*line);
    end_card();
    build();
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void fail(const std::string& what, std::size_t line) const {
    throw InputError(name_ + ":" + std::to_string(line) + ": " + what);
  }
  [[noreturn]] void fail(const std::string& what) const { fail(what, card_line_); }

  // --- Cards ----------------------------------------------------------------------------------------------------------

  void read_line(std::string_view whole) {
    const std::string line = without_tabs(whole.substr(0, whole.find('$')));
    if (trimmed(line).empty() || is_over_) return;
    const std::vector<std::string> fields = fields_of(line);
    std::string name = lower_case(fields[0]);
    if (name.ends_with('*')) name.pop_back();
    const bool continues = name.empty() || name[0] == '+' || name[0] == '*';
    if (continues && in_card_) {
      card_.insert(card_.end(), fields.begin() + 1, fields.end());
      return;
    }
    if (continues) return;
    end_card();
    if (name == "enddata") is_over_ = true;
    card_ = fields;
    card_[0] = name;
    card_line_ = lines_.word_line();
    in_card_ = true;
  }

  /// The name and the data of a line: eight of them, or four of a line of large fields. A field for continuations at
  /// the end of a line is dropped.
  static std::vector<std::string> fields_of(const std::string& line) {
    std::vector<std::string> fields;
    if (line.find(',') != std::string::npos) {
      std::size_t at = 0;
      while (at <= line.size()) {
        const std::size_t end = std::min(line.find(',', at), line.size());
        fields.push_back(trimmed(std::string_view(line).substr(at, end - at)));
        at = end + 1;
      }
      const std::size_t most = fields[0].find('*') == std::string::npos ? 9 : 5;
      fields.resize(most);
      return fields;
    }
    fields.push_back(trimmed(std::string_view(line).substr(0, 8)));
    const bool is_large = fields[0].find('*') != std::string::npos;
    const std::size_t width = is_large ? 16 : 8, count = is_large ? 4 : 8;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t begin = 8 + i * width;
      fields.push_back(begin < line.size() ? trimmed(std::string_view(line).substr(begin, width)) : std::string());
    }
    return fields;
  }

  void end_card() {
    if (!in_card_) return;
    in_card_ = false;
    const std::string& name = card_[0];
    const auto solid = std::find_if(solid_cards().begin(), solid_cards().end(),
                                    [&](const SolidCard& card) { return lower_case(card.name) == name; });
    if (name == "grid") read_grid();
    else if (solid != solid_cards().end()) read_solid(*solid);
    else if (name == "cquad4" || name == "cquad8" || name == "cquadr") read_shell(4);
    else if (name == "ctria3" || name == "ctria6" || name == "ctriar")
      read_shell(3);
    else if (name == "include" || name.starts_with("include ")) fail("INCLUDE is not followed: put the files together");
    else if (name == "grdset") fail("GRDSET is not read: write the coordinate systems of the points themselves");
    else if (is_other_element(name))
      ++num_others_;
  }

  const std::string& field(std::size_t i) const {
    static const std::string kNone;
    return i < card_.size() ? card_[i] : kNone;
  }

  std::int64_t whole(std::size_t i, const char* what) const {
    const auto value = parse_integer(field(i));
    if (!value || *value <= 0)
      fail(std::string("expected ") + what + " (a positive whole number), found " + in_quotes(field(i)));
    return *value;
  }

  /// Some programs leave the property out.
  std::int64_t property() const { return field(2).empty() ? 0 : whole(2, "the number of a property"); }

  void read_grid() {
    const std::int64_t number = whole(1, "the number of a point");
    if (const auto system = parse_integer(field(2)); !field(2).empty() && (!system || *system != 0))
      fail("GRID " + std::to_string(number) + " is in coordinate system " + in_quotes(field(2)) +
           "; expected the basic system");
    Vec3 p = Vec3::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      if (field(3 + k).empty()) continue;
      const auto value = nastran_number(field(3 + k));
      if (!value) fail("expected a coordinate (a finite number), found " + in_quotes(field(3 + k)));
      p[static_cast<Eigen::Index>(k)] = *value;
    }
    if (!points_.try_emplace(number, static_cast<Index>(mesh_.positions.size())).second)
      fail("a second GRID " + std::to_string(number));
    mesh_.positions.push_back(p);
  }

  struct Element {
    const SolidCard* solid;           ///< null: a face
    std::int64_t property;
    std::vector<std::int64_t> nodes;  ///< 0: left out
    std::size_t line;
  };

  void read_solid(const SolidCard& solid) {
    Element element{&solid, property(), {}, card_line_};
    for (std::size_t i = 0; i < solid.num_nodes; ++i) {
      const bool is_corner = i < solid.num_corners, is_blank = field(3 + i).empty() || field(3 + i) == "0";
      element.nodes.push_back(!is_corner && is_blank ? 0 : whole(3 + i, "the number of a point"));
    }
    elements_.push_back(std::move(element));
  }

  void read_shell(std::size_t num_corners) {
    Element element{nullptr, property(), {}, card_line_};
    for (std::size_t i = 0; i < num_corners; ++i) element.nodes.push_back(whole(3 + i, "the number of a point"));
    elements_.push_back(std::move(element));
  }

  // --- Building the mesh ----------------------------------------------------------------------------------------------

  Index point(const Element& element, std::size_t i) const {
    const auto found = points_.find(element.nodes[i]);
    if (found == points_.end())
      fail("an element names GRID " + std::to_string(element.nodes[i]) + ", which the file does not have",
           element.line);
    return found->second;
  }

  static int number_of(std::int64_t property) {
    return static_cast<int>(std::min<std::int64_t>(property, std::numeric_limits<int>::max()));
  }

  void build() {
    GroupList faces;
    std::vector<Index> corners;
    for (const Element& element : elements_) {
      if (element.solid) {
        add_solid(element);
        mesh_.references.push_back(number_of(element.property));
        continue;
      }
      corners.clear();
      for (std::size_t i = 0; i < element.nodes.size(); ++i) corners.push_back(point(element, i));
      add_face(mesh_, corners, faces.by_number(number_of(element.property)));
    }
    const auto is_one = [](int reference) { return reference == 1; };  // which all have that have none
    if (std::all_of(mesh_.references.begin(), mesh_.references.end(), is_one)) mesh_.references.clear();
    mesh_.face_groups.groups = faces.take();
    LeftOut left_out;
    left_out.add("other elements", num_others_);
    left_out.tell(mesh_.warnings);
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
    const auto [known, is_new] =
        middles_.try_emplace({ends[0], ends[1]}, static_cast<Index>(mesh_.positions.size()));
    if (is_new) mesh_.positions.push_back((mesh_.positions[ends[0]] + mesh_.positions[ends[1]]) / 2);
    return known->second;
  }

  TextScanner lines_;
  std::string name_;
  NodalMesh mesh_;
  NodalCells cells_;
  std::vector<std::string> card_;
  std::size_t card_line_ = 0, num_others_ = 0;
  bool in_card_ = false, is_over_ = false;
  std::unordered_map<std::int64_t, Index> points_;
  std::map<std::pair<Index, Index>, Index> middles_;
  std::vector<Element> elements_;
};

}  // namespace

NodalMesh parse_nastran(const std::string& name, std::string_view bytes, const std::string&) {
  return NastranParser(name, bytes).parse();
}

}  // namespace subvol::internal

// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/nodal_writers.h"

#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/nodal_sides.h"
#include "subvol/io/positive_numbers.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <numeric>
#include <set>

namespace subvol::internal {

namespace {

/// The text of a number that is closest to it, of at most so many characters. form: makes a format's text of a plain
/// one.
template <class Form>
std::string number_within(double value, std::size_t width, const Form& form) {
  std::string exact;
  append_number(exact, value);
  std::string text = form(exact);
  char buffer[40];
  for (int digits = 16; text.size() > width && digits > 0; --digits) {
    std::snprintf(buffer, sizeof buffer, "%.*g", digits, value);
    text = form(buffer);
  }
  return text;
}

/// CalculiX reads twenty characters of a number, and refuses longer ones.
void append_inp_position(std::string& text, const Vec3& p) {
  constexpr std::size_t kInpNumberWidth = 20;
  for (int k = 0; k < 3; ++k)
    text += ", " + number_within(p[k], kInpNumberWidth, [](const std::string& plain) { return plain; });
}

// --- Abaqus and CalculiX --------------------------------------------------------------------------------------------

/// Names that are not taken yet, in the letters that Abaqus allows; upper and lower case are the same.
class SetNames {
 public:
  std::string take(const std::string& wanted, const std::string& otherwise) {
    std::string name = inp_name(wanted);
    if (name.empty()) name = otherwise;
    std::string free = name;
    for (int i = 2; !taken_.insert(lower_case(free)).second; ++i) free = name + "_" + std::to_string(i);
    return free;
  }

 private:
  std::set<std::string> taken_;
};

std::string numbered(const char* prefix, int number) {
  return number < 0 ? prefix + ("M" + std::to_string(-static_cast<std::int64_t>(number)))
                    : prefix + std::to_string(number);
}

/// Appends numbers, sixteen to a line, which is what Abaqus takes.
template <class Numbers>
void append_set(std::string& text, const Numbers& numbers) {
  std::size_t i = 0;
  for (const auto number : numbers) {
    text += std::to_string(number + 1);
    text += ++i % 16 == 0 || i == numbers.size() ? "\n" : ", ";
  }
}

void append_inp_elements(std::string& text, const NodalMesh& mesh, int order) {
  constexpr const char* kInpElementTypes[2][kNumCellKinds] = {{"C3D4", "C3D6", "C3D8", "C3D5"},
                                                              {"C3D10", "C3D15", "C3D20"}};
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const CellKind kind = mesh.kinds[c];
    if (c == 0 || mesh.kinds[c - 1] != kind)
      text += std::string("*ELEMENT, TYPE=") + kInpElementTypes[order - 1][static_cast<std::size_t>(kind)] +
              ", ELSET=EALL\n";
    text += std::to_string(c + 1);
    const auto nodes = mesh.cell(c).first(num_edge_nodes(kind, order));
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      text += i == 10 ? ",\n" : ", ";  // a line takes sixteen numbers
      text += std::to_string(nodes[i] + 1);
    }
    text += '\n';
  }
}

void append_inp_references(std::string& text, const NodalMesh& mesh, SetNames& names) {
  std::map<int, std::vector<std::size_t>> cells;
  for (std::size_t c = 0; c < mesh.references.size(); ++c) cells[mesh.references[c]].push_back(c);
  std::map<int, std::string> own_names;  // before those of regions, one of which may look like them
  for (const auto& [reference, members] : cells)
    own_names[reference] = names.take(numbered("REFERENCE_", reference), "");
  for (const auto& [reference, members] : cells) {
    const std::string& own = own_names.at(reference);
    text += "*ELSET, ELSET=" + own + "\n";
    append_set(text, members);
    for (const Group& region : mesh.regions)
      if (region.number == reference && !region.name.empty())
        text += "*ELSET, ELSET=" + names.take(region.name, own) + "\n" + own + "\n";
  }
}

void append_inp_groups(std::string& text, const NodalMesh& mesh) {
  const std::vector<GroupSides> groups = sides_of_groups(mesh, inp_faces, false);
  SetNames names;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    if (groups[g].sides.empty()) continue;
    const Group& group = mesh.face_groups.groups[g];
    const std::string name = names.take(group.name, numbered("GROUP_", group.number));
    text += "*SURFACE, NAME=" + name + ", TYPE=ELEMENT\n";
    for (const Side& side : groups[g].sides)
      text += std::to_string(side.cell + 1) + ", S" + std::to_string(side.number) + "\n";
    text += "*NSET, NSET=" + name + "\n";
    append_set(text, groups[g].nodes);
  }
}

// --- Nastran --------------------------------------------------------------------------------------------------------

std::string padded(std::string text, std::size_t width) {
  text.resize(std::max(width, text.size()), ' ');
  return text;
}

/// The shortest text of at most sixteen characters that is closest to a number, with a decimal point as Nastran
/// requires it.
std::string nastran_field(double value) {
  constexpr std::size_t kNastranFieldWidth = 16;
  return number_within(value, kNastranFieldWidth, [](std::string text) {
    const std::size_t e = text.find('e');
    if (text.find('.') == std::string::npos) text.insert(e == std::string::npos ? text.size() : e, ".");
    return text;
  });
}

/// Appends a card of whole numbers: in fields of eight columns, or of sixteen if a number does not fit.
void append_nastran_card(std::string& text, std::string name, const std::vector<std::int64_t>& numbers) {
  constexpr std::int64_t kMostInSmallField = 99'999'999;
  const bool is_large = *std::max_element(numbers.begin(), numbers.end()) > kMostInSmallField;
  const std::size_t width = is_large ? 16 : 8, fields_of_line = is_large ? 4 : 8;
  const char mark = is_large ? '*' : '+';  // some readers take no blank as the mark of a continuation
  if (is_large) name += mark;
  text += padded(name, 8);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (i > 0 && i % fields_of_line == 0) ((text += mark) += '\n') += padded(std::string(1, mark), 8);
    text += padded(std::to_string(numbers[i]), width);
  }
  text += '\n';
}

}  // namespace

std::string inp_name(const std::string& wanted) {
  constexpr std::size_t kMostInpNameLength = 72;  // Abaqus allows 80
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  std::string name;
  for (const char c : wanted.substr(0, kMostInpNameLength))
    name += is_letter(c) || (c >= '0' && c <= '9') || c == '-' ? c : '_';
  if (name.find_first_not_of('_') == std::string::npos) return {};
  return is_letter(name[0]) ? name : "N" + name;
}

std::vector<std::size_t> exodus_order(const NodalMesh& mesh) {
  std::vector<std::size_t> order(mesh.num_cells());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(reference_of(mesh, a), mesh.kinds[a]) < std::pair(reference_of(mesh, b), mesh.kinds[b]);
  });
  return order;
}

NodalMesh nodal_mesh(const VolumeMesh& mesh) {
  NodalMesh result;
  result.positions = mesh.positions;
  result.kinds = mesh.kinds;
  result.orders.assign(mesh.num_cells(), 1);
  result.offsets = mesh.cell_offsets;
  result.nodes = mesh.cell_vertices;
  result.references = mesh.references;
  result.regions = mesh.regions;
  result.face_groups = mesh.face_groups;
  return result;
}

std::string inp_text(const NodalMesh& mesh) {
  const int order = common_order(mesh, "Abaqus", 2);
  const std::vector<bool> used = edge_nodes(mesh, order);
  std::string text = "*HEADING\nsubvol volume mesh\n*NODE, NSET=NALL\n";
  for (std::size_t n = 0; n < mesh.positions.size(); ++n) {
    if (!used[n]) continue;
    text += std::to_string(n + 1);
    append_inp_position(text, mesh.positions[n]);
    text += '\n';
  }
  append_inp_elements(text, mesh, order);
  SetNames names;
  names.take("EALL", "EALL");
  append_inp_references(text, mesh, names);
  append_inp_groups(text, mesh);
  return text;
}

std::string nastran_text(const NodalMesh& mesh) {
  const int order = common_order(mesh, "Nastran", 2);
  const std::vector<bool> used = edge_nodes(mesh, order);
  PositiveNumbers properties(mesh.references);
  std::string text = "$ subvol volume mesh\nBEGIN BULK\n";
  for (std::size_t n = 0; n < mesh.positions.size(); ++n) {
    if (!used[n]) continue;
    text += "GRID*   " + padded(std::to_string(n + 1), 16) + padded("", 16);
    text += padded(nastran_field(mesh.positions[n][0]), 16) + padded(nastran_field(mesh.positions[n][1]), 16);
    text += "\n*       " + nastran_field(mesh.positions[n][2]) + "\n";
  }
  // Nastran has the middles of upright edges before those of the top.
  constexpr std::array<std::size_t, 15> kNastranPrismNodes{0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14, 9, 10, 11};
  constexpr std::array<std::size_t, 20> kNastranHexNodes{0,  1,  2,  3,  4,  5,  6,  7,  8,  9,
                                                         10, 11, 16, 17, 18, 19, 12, 13, 14, 15};
  constexpr const char* kCards[] = {"CTETRA", "CPENTA", "CHEXA", "CPYRAM"};
  std::vector<std::int64_t> numbers;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const CellKind kind = mesh.kinds[c];
    numbers = {static_cast<std::int64_t>(c) + 1, properties.of(reference_of(mesh, c))};
    const std::size_t count = num_edge_nodes(kind, order);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t place = kind == CellKind::hex     ? kNastranHexNodes[i]
                                : kind == CellKind::prism ? kNastranPrismNodes[i]
                                                          : i;
      numbers.push_back(std::int64_t{mesh.cell(c)[place]} + 1);
    }
    append_nastran_card(text, kCards[static_cast<std::size_t>(kind)], numbers);
  }
  return text + "ENDDATA\n";
}

}  // namespace subvol::internal

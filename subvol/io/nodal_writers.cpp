// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/nodal_writers.h"

#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/nodal_formats.h"
#include "subvol/io/positive_numbers.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <set>

namespace subvol {

namespace {

int common_order(const NodalMesh& mesh, const char* format, int most) {
  const int order = mesh.orders.front();
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    if (mesh.orders[c] != order)
      throw InputError(std::string(format) + ": cells of several orders, expected one for all");
  if (order > most)
    throw InputError(std::string(format) + ": cells of order " + std::to_string(order) + ", expected order 1 to " +
                     std::to_string(most));
  return order;
}

std::size_t num_corners(CellKind kind) { return static_cast<std::size_t>(cell_topology(kind).num_vertices); }

/// Number of the corners, and of the middles of edges in order 2.
std::size_t num_written(CellKind kind, int order) {
  return num_corners(kind) + (order == 2 ? static_cast<std::size_t>(cell_topology(kind).num_edges) : 0);
}

int reference_of(const NodalMesh& mesh, std::size_t c) { return mesh.references.empty() ? 0 : mesh.references[c]; }

/// The text of a number that is closest to it, of at most so many characters. form: makes a format's text of a plain one.
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
  constexpr std::size_t kWidth = 20;
  for (int k = 0; k < 3; ++k) text += ", " + number_within(p[k], kWidth, [](const std::string& plain) { return plain; });
}

std::vector<bool> used_nodes(const NodalMesh& mesh, int order) {
  std::vector<bool> used(mesh.positions.size(), false);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (const Index node : mesh.cell(c).first(num_written(mesh.kinds[c], order)))
      used[static_cast<std::size_t>(node)] = true;
  if (order == 1) used.assign(used.size(), true);  // vertices of no cell keep their place
  return used;
}

// --- Abaqus and CalculiX --------------------------------------------------------------------------------------------

/// Names that are not taken yet, in the letters that Abaqus allows; upper and lower case are the same.
class SetNames {
 public:
  std::string take(const std::string& wanted, const std::string& otherwise) {
    constexpr std::size_t kLongest = 72;  // Abaqus allows 80
    std::string name;
    for (const char c : wanted.substr(0, kLongest)) {
      const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
      name += is_letter || (c >= '0' && c <= '9') || c == '-' ? c : '_';
    }
    if (name.find_first_not_of('_') == std::string::npos) name = otherwise;
    const char first = name[0];
    if (!((first >= 'a' && first <= 'z') || (first >= 'A' && first <= 'Z'))) name = "N" + name;
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
  constexpr const char* kTypes[2][3] = {{"C3D4", "C3D6", "C3D8"}, {"C3D10", "C3D15", "C3D20"}};
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const CellKind kind = mesh.kinds[c];
    if (c == 0 || mesh.kinds[c - 1] != kind)
      text += std::string("*ELEMENT, TYPE=") + kTypes[order - 1][static_cast<std::size_t>(kind)] + ", ELSET=EALL\n";
    text += std::to_string(c + 1);
    const auto nodes = mesh.cell(c).first(num_written(kind, order));
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
  for (const auto& [reference, members] : cells) {
    const std::string own = names.take(numbered("REFERENCE_", reference), "");
    text += "*ELSET, ELSET=" + own + "\n";
    append_set(text, members);
    for (const Group& region : mesh.regions)
      if (region.number == reference && !region.name.empty())
        text += "*ELSET, ELSET=" + names.take(region.name, own) + "\n" + own + "\n";
  }
}

/// A face of a cell: S1, S2, ..
struct Side {
  std::size_t cell;
  int number;
};

/// The sides of the grouped faces, each of the first cell that has it.
std::map<FaceKey, Side> sides_of(const NodalMesh& mesh) {
  std::set<FaceKey> wanted;
  for (const GroupedFace& face : mesh.face_groups.faces) wanted.insert(face.face);
  std::map<FaceKey, Side> sides;
  std::vector<Index> corners;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    int number = 0;
    for (const std::vector<int>& face : inp_faces(mesh.kinds[c])) {
      ++number;
      corners.clear();
      for (const int i : face) corners.push_back(mesh.cell(c)[static_cast<std::size_t>(i)]);
      if (const FaceKey key = face_key(corners); wanted.contains(key)) sides.try_emplace(key, Side{c, number});
    }
  }
  return sides;
}

void add_side_nodes(const NodalMesh& mesh, const Side& side, int order, std::set<Index>& nodes) {
  const CellKind kind = mesh.kinds[side.cell];
  const std::vector<int> face = inp_faces(kind)[static_cast<std::size_t>(side.number) - 1];
  const auto cell = mesh.cell(side.cell);
  for (const int i : face) nodes.insert(cell[static_cast<std::size_t>(i)]);
  if (order == 1) return;
  const auto lattice = cell_lattice(kind, 2, NodeOrdering::vtk);
  for (std::size_t i = num_corners(kind); i < num_written(kind, 2); ++i)
    for (const int a : face)
      for (const int b : face)
        if (a < b && lattice[static_cast<std::size_t>(a)] + lattice[static_cast<std::size_t>(b)] == 2 * lattice[i])
          nodes.insert(cell[i]);
}

void append_inp_groups(std::string& text, const NodalMesh& mesh, int order) {
  const std::map<FaceKey, Side> sides = sides_of(mesh);
  SetNames names;
  for (std::size_t g = 0; g < mesh.face_groups.groups.size(); ++g) {
    const Group& group = mesh.face_groups.groups[g];
    std::string lines;
    std::set<Index> nodes;
    for (const GroupedFace& face : mesh.face_groups.faces) {
      const auto side = sides.find(face.face);
      if (static_cast<std::size_t>(face.group) != g || side == sides.end()) continue;
      lines += std::to_string(side->second.cell + 1) + ", S" + std::to_string(side->second.number) + "\n";
      add_side_nodes(mesh, side->second, order, nodes);
    }
    if (nodes.empty()) continue;
    const std::string name = names.take(group.name, numbered("GROUP_", group.number));
    text += "*SURFACE, NAME=" + name + ", TYPE=ELEMENT\n" + lines + "*NSET, NSET=" + name + "\n";
    append_set(text, nodes);
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
  constexpr std::size_t kWidth = 16;
  return number_within(value, kWidth, [](std::string text) {
    const std::size_t e = text.find('e');
    if (text.find('.') == std::string::npos) text.insert(e == std::string::npos ? text.size() : e, ".");
    return text;
  });
}

}  // namespace

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
  const std::vector<bool> used = used_nodes(mesh, order);
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
  append_inp_groups(text, mesh, order);
  return text;
}

std::string nastran_text(const NodalMesh& mesh) {
  const int order = common_order(mesh, "Nastran", 2);
  const std::vector<bool> used = used_nodes(mesh, order);
  PositiveNumbers properties(mesh.references);
  std::string text = "$ subvol volume mesh\nBEGIN BULK\n";
  for (std::size_t n = 0; n < mesh.positions.size(); ++n) {
    if (!used[n]) continue;
    text += "GRID*   " + padded(std::to_string(n + 1), 16) + padded("", 16);
    text += padded(nastran_field(mesh.positions[n][0]), 16) + padded(nastran_field(mesh.positions[n][1]), 16);
    text += "\n*       " + nastran_field(mesh.positions[n][2]) + "\n";
  }
  // Nastran has the middles of upright edges before those of the top.
  constexpr std::array<std::size_t, 15> kPrism{0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14, 9, 10, 11};
  constexpr std::array<std::size_t, 20> kHex{0,  1,  2,  3,  4,  5,  6,  7,  8,  9,
                                             10, 11, 16, 17, 18, 19, 12, 13, 14, 15};
  constexpr const char* kCards[] = {"CTETRA", "CPENTA", "CHEXA"};
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const CellKind kind = mesh.kinds[c];
    text += padded(kCards[static_cast<std::size_t>(kind)], 8) + padded(std::to_string(c + 1), 8) +
            padded(std::to_string(properties.of(reference_of(mesh, c))), 8);
    const std::size_t count = num_written(kind, order);
    for (std::size_t i = 0; i < count; ++i) {
      if ((i + 2) % 8 == 0) text += "+\n+       ";  // some readers take no blank as the mark of a continuation
      const std::size_t place = kind == CellKind::hex ? kHex[i] : kind == CellKind::prism ? kPrism[i] : i;
      text += padded(std::to_string(mesh.cell(c)[place] + 1), 8);
    }
    text += '\n';
  }
  return text + "ENDDATA\n";
}

}  // namespace subvol

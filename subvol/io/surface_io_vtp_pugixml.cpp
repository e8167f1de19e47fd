// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/left_out.h"
#include "subvol/io/reference_arrays.h"
#include "subvol/io/surface_formats.h"
#include "subvol/io/vtk_xml_file.h"

#include <pugixml.hpp>

#include <cmath>
#include <limits>
#include <optional>

namespace subvol::internal {

namespace {

/// Reads the polygons and strips of VTK's PolyData. Cell data list vertices, lines, polygons and strips in this order.
class VtpParser {
 public:
  VtpParser(const std::string& name, std::string_view bytes) : file_(name, bytes, "PolyData") {}

  ParsedSurface parse() {
    std::size_t num_pieces = 0;
    for (const pugi::xml_node piece : file_.grid().children("Piece")) {
      read_piece(piece);
      ++num_pieces;
    }
    if (num_pieces == 0) file_.fail("expected an element Piece");
    ParsedSurface parsed{std::move(mesh_), {}};
    if (num_pieces > 1)
      parsed.warnings.push_back("the file has " + std::to_string(num_pieces) +
                                " pieces: points that they have in common are not merged");
    name_groups(num_pieces, parsed);
    left_out_.tell(parsed.warnings);
    return parsed;
  }

 private:
  void read_piece(const pugi::xml_node& piece) {
    const std::size_t first = mesh_.positions.size(), num_points = file_.append_points(piece, mesh_.positions);
    const std::size_t before = file_.claimed(piece, "NumberOfVerts") + file_.claimed(piece, "NumberOfLines");
    if (before > 0) left_out_.add("vertices and lines", before);
    cells_.clear();
    const std::size_t num_polygons = file_.claimed(piece, "NumberOfPolys");
    add_faces(piece.child("Polys"), num_polygons, before, first, num_points, false);
    add_faces(piece.child("Strips"), file_.claimed(piece, "NumberOfStrips"), before + num_polygons, first, num_points,
              true);
    read_cell_data(piece);
  }

  /// first_cell  number of the first of these cells among all cells of the piece.
  void add_faces(const pugi::xml_node& cells, std::size_t count, std::size_t first_cell, std::size_t first_point,
                 std::size_t num_points, bool are_strips) {
    if (count == 0) return;
    const auto nodes = file_.whole_numbers(cells, "connectivity"), ends = file_.whole_numbers(cells, "offsets");
    if (ends.size() != count)
      file_.fail(std::string(cells.name()) + ": expected one offset for each of " + std::to_string(count) + " cells");
    std::vector<Index> corners;
    for (std::size_t c = 0; c < count; ++c) {
      const std::int64_t begin = c ? ends[c - 1] : 0;
      if (begin < 0 || ends[c] < begin || ends[c] > static_cast<std::int64_t>(nodes.size()))
        file_.fail("cell " + std::to_string(c) + " has an offset beyond the connectivity");
      corners.clear();
      for (std::int64_t k = begin; k < ends[c]; ++k) {
        const std::int64_t node = nodes[static_cast<std::size_t>(k)];
        if (node < 0 || node >= static_cast<std::int64_t>(num_points))
          file_.fail("cell " + std::to_string(c) + " names point " + std::to_string(node) + " of " +
                     std::to_string(num_points));
        corners.push_back(static_cast<Index>(first_point + static_cast<std::size_t>(node)));
      }
      if (!are_strips) add_face(corners, first_cell + c);
      for (std::size_t k = 2; are_strips && k < corners.size(); ++k) {
        const bool turned = k % 2 == 1;
        add_face(std::array<Index, 3>{corners[turned ? k - 1 : k - 2], corners[turned ? k - 2 : k - 1], corners[k]},
                 first_cell + c);
      }
    }
  }

  void add_face(std::span<const Index> corners, std::size_t cell) {
    mesh_.face_vertices.insert(mesh_.face_vertices.end(), corners.begin(), corners.end());
    mesh_.face_offsets.push_back(mesh_.face_vertices.size());
    cells_.push_back(cell);
  }

  /// The first piece says which array it is; the others must have it, too.
  void read_cell_data(const pugi::xml_node& piece) {
    std::vector<CellNumbers> arrays;
    for (const pugi::xml_node node : piece.child("CellData").children("DataArray")) {
      CellNumbers numbers{
          node.attribute("Name").value(), std::string_view(node.attribute("type").value()).starts_with("Float"), {}};
      if (node.attribute("NumberOfComponents").as_int(1) != 1) continue;
      if (chosen_ && numbers.name != *chosen_) continue;
      for (const double value : file_.values(node)) {
        if (value != std::floor(value) || std::abs(value) > std::numeric_limits<int>::max()) break;
        numbers.values.push_back(static_cast<std::int64_t>(value));
      }
      const bool fits = cells_.empty() || numbers.values.size() > cells_.back();
      if (fits && (numbers.name == kOwnVtpGroupArray || reference_name_rank(numbers.name)))
        arrays.push_back(std::move(numbers));
    }
    const CellNumbers* found = nullptr;
    for (const CellNumbers& array : arrays)
      if (!found || rank(array) < rank(*found)) found = &array;
    if (!chosen_ && found) chosen_ = found->name;
    for (const std::size_t cell : cells_) labels_.push_back(found ? static_cast<int>(found->values[cell]) : 0);
  }
  static std::size_t rank(const CellNumbers& array) {
    return array.name == kOwnVtpGroupArray ? 0 : 1 + *reference_name_rank(array.name);
  }

  /// 0 is no group in our files, and a group like others in those of others, if there are several.
  void name_groups(std::size_t num_pieces, ParsedSurface& parsed) {
    if (!chosen_) return;
    GroupList groups;
    FaceGroups& result = parsed.mesh.face_groups;
    constexpr std::size_t kMostGroups = 65536;
    const bool own = *chosen_ == kOwnVtpGroupArray;
    for (const int label : labels_) {
      result.of_face.push_back(own && label == 0 ? kNoIndex : groups.by_number(label));
      if (groups.groups().size() > kMostGroups) {
        left_out_.add("labels of faces", labels_.size());
        result = {};
        return;
      }
    }
    result.groups = groups.take();
    if (result.groups.empty() || (!own && result.groups.size() == 1)) result = {};
    if (own && num_pieces == 1) read_names(result.groups);
  }

  /// The names that subvol writes: texts as the codes of their characters, each ended by 0.
  void read_names(std::vector<Group>& groups) {
    const pugi::xml_node data = file_.grid().child("FieldData");
    const pugi::xml_node numbers = data.find_child_by_attribute("DataArray", "Name", "group_numbers"),
                         names = data.find_child_by_attribute("DataArray", "Name", "group_names");
    if (!numbers || !names) return;
    const std::vector<std::int64_t> known = file_.whole_numbers(data, "group_numbers");
    std::vector<std::string> texts(1);
    TextScanner codes("group_names", names.child_value());
    while (codes.peek()) {
      const std::int64_t code = codes.integer("a character");
      if (code == 0)
        texts.emplace_back();
      else
        texts.back() += static_cast<char>(code);
    }
    for (std::size_t i = 0; i < known.size() && i < texts.size(); ++i)
      for (Group& group : groups)
        if (group.number == known[i] && texts[i] != label_of(group)) group.name = texts[i];
  }

  static constexpr std::string_view kOwnVtpGroupArray = "group";
  VtkXmlFile file_;
  PolygonMesh mesh_;
  LeftOut left_out_;
  std::vector<std::size_t> cells_;     ///< of the faces of the piece
  std::optional<std::string> chosen_;  ///< name of the array of labels
  std::vector<int> labels_;
};

}  // namespace

ParsedSurface parse_vtp(const std::string& name, std::string_view bytes) { return VtpParser(name, bytes).parse(); }

}  // namespace subvol::internal

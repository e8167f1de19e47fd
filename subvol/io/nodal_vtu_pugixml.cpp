// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/bezier_cells.h"
#include "subvol/io/cell_values.h"
#include "subvol/io/left_out.h"
#include "subvol/io/nodal_formats.h"
#include "subvol/io/reference_arrays.h"
#include "subvol/io/vtk_xml_file.h"

#include <pugixml.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

namespace subvol::internal {

namespace {

class VtuParser {
 public:
  VtuParser(const std::string& name, std::string_view bytes, const std::string& references)
      : file_(name, bytes, "UnstructuredGrid"), asked_(references) {}

  NodalMesh parse() {
    std::size_t num_pieces = 0;
    for (const pugi::xml_node piece : file_.grid().children("Piece")) {
      read_piece(piece);
      ++num_pieces;
    }
    if (num_pieces == 0) fail("expected an element Piece");
    if (num_pieces > 1)
      mesh_.warnings.push_back("the file has " + std::to_string(num_pieces) +
                               " pieces: points that they have in common are not merged");
    if (num_skipped_ > 0)
      mesh_.warnings.push_back(std::to_string(num_skipped_) + " cells of lower dimension are skipped");
    if (!beziers_.empty()) read_control_points();
    choose_references();
    if (num_pieces == 1) read_groups();
    mesh_size_ = mesh_.positions.size();
    return std::move(mesh_);
  }

  /// The data of one component, after `parse`. Data that a piece lacks are left out, and so are those of several
  /// pieces.
  std::vector<CellValues> cell_values() const {
    std::vector<CellValues> all;
    const pugi::xml_node piece = file_.grid().child("Piece");
    if (piece.next_sibling("Piece")) return all;
    for (const bool is_on_points : {false, true})
      for (const pugi::xml_node node : piece.child(is_on_points ? "PointData" : "CellData").children("DataArray")) {
        CellValues one{node.attribute("Name").value(), is_on_points, {}};
        const bool is_ghost = lower_case(one.name).find("ghost") != std::string::npos;
        if (node.attribute("NumberOfComponents").as_int(1) != 1 || is_ghost) continue;
        std::vector<double> found;
        try {
          found = decode_vtk_xml_array(described(node), file_.storage());
        } catch (const InputError&) {
          continue;  // what a reader of meshes does not need may be in a form that it does not know
        }
        if (found.size() != (is_on_points ? mesh_size_ : is_volume_.size())) continue;
        if (is_on_points)
          one.values = std::move(found);
        else
          for (std::size_t c = 0; c < found.size(); ++c)
            if (is_volume_[c]) one.values.push_back(found[c]);
        all.push_back(std::move(one));
      }
    return all;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { file_.fail(what); }

  static VtkXmlArray described(const pugi::xml_node& node) { return VtkXmlFile::described(node); }

  void read_piece(const pugi::xml_node& piece) {
    const std::size_t num_cells = file_.claimed(piece, "NumberOfCells");
    if (num_cells == 0) return;
    const std::size_t first_point = mesh_.positions.size();
    file_.append_points(piece, mesh_.positions);
    const pugi::xml_node cells = piece.child("Cells");
    const auto nodes = file_.whole_numbers(cells, "connectivity"), ends = file_.whole_numbers(cells, "offsets"),
               types = file_.whole_numbers(cells, "types");
    if (ends.size() != num_cells || types.size() != num_cells)
      fail("Cells: expected one offset and one type for each of " + std::to_string(num_cells) + " cells");
    add_cells(nodes, ends, types, first_point);
    read_cell_data(piece.child("CellData"), num_cells);
    num_left_out_ += count_arrays(piece.child("PointData"));
    num_cells_read_ += num_cells;
  }

  /// Bezier cells are polynomials if all weights of their points are 1, or if there are none.
  void read_control_points() {
    for (const pugi::xml_node piece : file_.grid().children("Piece")) {
      const pugi::xml_node data = piece.child("PointData");
      const std::string name = data.attribute("RationalWeights").as_string("RationalWeights");
      const pugi::xml_node weights = data.find_child_by_attribute("DataArray", "Name", name.c_str());
      if (!weights) continue;
      for (const double weight : decode_vtk_xml_array(described(weights), file_.storage()))
        if (weight != 1) fail(name + ": expected weights of 1 only: rational Bezier cells are no polynomials");
    }
    try {
      control_points_to_nodes(mesh_, beziers_);
    } catch (const InputError& error) {
      fail(error.what());
    }
  }

  void add_cells(const std::vector<std::int64_t>& nodes, const std::vector<std::int64_t>& ends,
                 const std::vector<std::int64_t>& types, std::size_t first_point) {
    NodalCells cells(mesh_);
    const std::size_t num_points = mesh_.positions.size() - first_point;
    std::vector<std::int64_t> cell;
    for (std::size_t c = 0; c < types.size(); ++c) {
      const auto refuse = [&](const std::string& what) { fail("cell " + std::to_string(c) + ' ' + what); };
      const std::int64_t begin = c ? ends[c - 1] : 0;
      if (begin < 0 || ends[c] < begin || ends[c] > static_cast<std::int64_t>(nodes.size()))
        refuse("has an offset beyond the connectivity");
      cell.assign(nodes.begin() + begin, nodes.begin() + ends[c]);
      for (std::int64_t& node : cell) {
        if (node < 0 || static_cast<std::uint64_t>(node) >= num_points)
          refuse("names point " + std::to_string(node) + " of " + std::to_string(num_points));
        node += static_cast<std::int64_t>(first_point);
      }
      const int type = static_cast<int>(std::clamp<std::int64_t>(types[c], -1, 1000000));
      const VtkCellUse use = add_vtk_cell(mesh_, cells, type, cell, file_.old_numbers(), refuse);
      if (use == VtkCellUse::bezier) beziers_.push_back(mesh_.num_cells() - 1);
      num_skipped_ += use == VtkCellUse::lower_dimension;
      is_volume_.push_back(use != VtkCellUse::lower_dimension);
    }
  }

  static std::size_t count_arrays(const pugi::xml_node& node) {
    const auto arrays = node.children("DataArray");
    return static_cast<std::size_t>(std::distance(arrays.begin(), arrays.end()));
  }

  /// Keeps the arrays of one whole number per cell: one of them may become the references.
  void read_cell_data(const pugi::xml_node& data, std::size_t num_cells) {
    for (const pugi::xml_node node : data.children("DataArray")) {
      const VtkXmlArray described_array = described(node);
      const int components = node.attribute("NumberOfComponents").as_int(1);
      const bool is_real = described_array.type.starts_with("Float");
      CellNumbers numbers{described_array.name, is_real, {}};
      if (components == 1) try {
          for (const double value : decode_vtk_xml_array(described_array, file_.storage())) {
            if (value != std::floor(value)) break;  // also of what is not a number
            numbers.values.push_back(static_cast<std::int64_t>(std::clamp(value, -1e15, 1e15)));
          }
        } catch (const InputError&) {
          numbers.values.clear();  // values such as qualities may well be nan
        }
      num_arrays_ += !is_derived(numbers, num_cells);
      if (numbers.name == "order" && asked_ != "order") continue;  // ours: it says nothing about materials
      if (numbers.values.size() == num_cells)
        keep(std::move(numbers));
      else
        others_.push_back(described_array.name);
    }
  }

  /// Returns true for the data of a piece that subvol writes beside the references, and that follow from the cells:
  /// their orders, and scaled Jacobians.
  bool is_derived(const CellNumbers& numbers, std::size_t num_cells) const {
    if (numbers.name == "scaled_jacobian") return numbers.is_real;
    if (numbers.name != "order" || numbers.values.size() != num_cells || mesh_.orders.size() < num_cells) return false;
    const auto of_piece = std::span(mesh_.orders).last(num_cells);
    return std::equal(of_piece.begin(), of_piece.end(), numbers.values.begin());
  }

  /// Joins the arrays of one name of all pieces; those that a piece lacks are dropped in the end.
  void keep(CellNumbers numbers) {
    const auto known = std::find_if(arrays_.begin(), arrays_.end(),
                                    [&](const CellNumbers& array) { return array.name == numbers.name; });
    if (known == arrays_.end()) {
      if (num_cells_read_ == 0) arrays_.push_back(std::move(numbers));
    } else if (known->values.size() == num_cells_read_) {
      known->values.insert(known->values.end(), numbers.values.begin(), numbers.values.end());
    }
  }

  void choose_references() {
    std::erase_if(arrays_, [&](const CellNumbers& array) { return array.values.size() != num_cells_read_; });
    std::optional<std::size_t> chosen;
    try {
      chosen = internal::choose_references(arrays_, asked_, others_);
    } catch (const InputError& error) {
      fail(error.what());
    }
    tell_of_references(arrays_, chosen, !asked_.empty(), num_left_out_ + num_arrays_, mesh_.warnings);
    if (chosen) take_references(arrays_[*chosen].values);
  }

  void take_references(const std::vector<std::int64_t>& values) {
    std::size_t num_beyond = 0;
    for (std::size_t c = 0; c < values.size(); ++c) {
      if (!is_volume_[c]) continue;
      const bool fits = values[c] >= std::numeric_limits<int>::min() && values[c] <= std::numeric_limits<int>::max();
      mesh_.references.push_back(fits ? static_cast<int>(values[c]) : 0);
      num_beyond += !fits;
    }
    if (num_beyond > 0)
      mesh_.warnings.push_back("the references of " + std::to_string(num_beyond) +
                               " cells are beyond 32 bits, and become 0");
  }

  /// Reads the groups of faces and the names of references that subvol writes (docs/file-formats.md), in the grid or
  /// behind it.
  void read_groups() {
    pugi::xml_node data;
    for (const pugi::xml_node parent : {file_.grid(), file_.grid().parent()})
      for (const pugi::xml_node child : parent.children("FieldData"))
        if (child.find_child_by_attribute("DataArray", "Name", "subvol_group_numbers")) data = child;
    if (!data) return;
    const auto array = [&](const char* name) { return file_.whole_numbers(data, name); };
    const auto numbers = array("subvol_group_numbers"), dimensions = array("subvol_group_dimensions"),
               codes = array("subvol_group_names"), points = array("subvol_group_faces"),
               of_faces = array("subvol_group_of_faces");
    std::string names;
    for (const std::int64_t code : codes) names += static_cast<char>(code);
    std::size_t at = 0;
    if (dimensions.size() != numbers.size() || points.size() != 4 * of_faces.size())
      fail("subvol_group_numbers: expected as many dimensions, and four points for each face");
    for (std::size_t g = 0; g < numbers.size(); ++g) {
      const std::size_t end = std::min(names.find('\n', at), names.size());
      const Group group{names.substr(at, end - at), static_cast<int>(numbers[g]), static_cast<int>(dimensions[g])};
      if ((group.dimension != 2 && group.dimension != 3) || (group.dimension == 2 && !mesh_.regions.empty()) ||
          std::abs(numbers[g]) > std::numeric_limits<int>::max())
        fail("subvol_group_dimensions: expected 2 for groups of faces, then 3 for references");
      (group.dimension == 2 ? mesh_.face_groups.groups : mesh_.regions).push_back(group);
      at = std::min(end + 1, names.size());
    }
    for (std::size_t f = 0; f < of_faces.size(); ++f) {
      const std::size_t size = points[4 * f + 3] == kNoIndex ? 3 : 4;
      std::array<Index, 4> corners{};
      for (std::size_t k = 0; k < size; ++k) {
        const std::int64_t v = points[4 * f + k];
        if (v < 0 || static_cast<std::uint64_t>(v) >= mesh_.positions.size())
          fail("subvol_group_faces: face " + std::to_string(f) + ": expected numbers of points");
        corners[k] = static_cast<Index>(v);
      }
      if (of_faces[f] < 0 || static_cast<std::size_t>(of_faces[f]) >= mesh_.face_groups.groups.size())
        fail("subvol_group_of_faces: face " + std::to_string(f) + ": expected the place of a group of faces");
      add_face(mesh_, std::span<const Index>(corners).first(size), static_cast<Index>(of_faces[f]));
    }
  }

  VtkXmlFile file_;
  std::string asked_;
  NodalMesh mesh_;
  std::vector<bool> is_volume_;       ///< of all cells of the file: whether it is one of the mesh
  std::vector<std::size_t> beziers_;  ///< cells that are given by their control points
  std::vector<CellNumbers> arrays_;
  std::vector<std::string> others_;
  std::size_t num_arrays_ = 0, num_left_out_ = 0, num_skipped_ = 0, num_cells_read_ = 0, mesh_size_ = 0;
};

}  // namespace

NodalMesh parse_vtu(const std::string& name, std::string_view bytes, const std::string& references) {
  return VtuParser(name, bytes, references).parse();
}

std::vector<CellValues> read_cell_values(const std::filesystem::path& path) {
  if (lower_case(path.extension().string()) != ".vtu") return {};
  const std::string bytes = read_file(path);
  VtuParser parser(path.string(), bytes, {});
  parser.parse();
  return parser.cell_values();
}

}  // namespace subvol::internal

// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/cell_values.h"
#include "subvol/io/left_out.h"
#include "subvol/io/nodal_formats.h"
#include "subvol/io/reference_arrays.h"
#include "subvol/io/vtk_xml_arrays.h"

#include <pugixml.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

namespace subvol {

namespace {

class VtuParser {
 public:
  VtuParser(const std::string& name, std::string_view bytes, const std::string& references)
      : name_(name), asked_(references) {
    require_no_utf16(name, bytes);
    load(bytes);
  }

  NodalMesh parse() {
    const pugi::xml_node file = document_.child("VTKFile");
    if (!file) fail("expected the element VTKFile");
    read_header(file);
    const pugi::xml_node grid = file.child("UnstructuredGrid");
    if (!grid) fail("expected the element UnstructuredGrid");
    std::size_t num_pieces = 0;
    for (const pugi::xml_node piece : grid.children("Piece")) {
      read_piece(piece);
      ++num_pieces;
    }
    if (num_pieces == 0) fail("expected an element Piece");
    if (num_pieces > 1)
      mesh_.warnings.push_back("the file has " + std::to_string(num_pieces) +
                               " pieces: points that they have in common are not merged");
    if (num_skipped_ > 0)
      mesh_.warnings.push_back(std::to_string(num_skipped_) + " cells of lower dimension are skipped");
    choose_references();
    mesh_size_ = mesh_.positions.size();
    return std::move(mesh_);
  }

  /// The data of one component, after `parse`. Data that a piece lacks are left out, and so are those of several
  /// pieces.
  std::vector<CellValues> cell_values() const {
    std::vector<CellValues> all;
    const pugi::xml_node grid = document_.child("VTKFile").child("UnstructuredGrid");
    const pugi::xml_node piece = grid.child("Piece");
    if (piece.next_sibling("Piece")) return all;
    for (const bool is_on_points : {false, true})
      for (const pugi::xml_node node : piece.child(is_on_points ? "PointData" : "CellData").children("DataArray")) {
        CellValues one{node.attribute("Name").value(), is_on_points, {}};
        const bool is_ghost = lower_case(one.name).find("ghost") != std::string::npos;
        if (node.attribute("NumberOfComponents").as_int(1) != 1 || is_ghost) continue;
        std::vector<double> found;
        try {
          found = decode_vtk_xml_array(described(node), storage_);
        } catch (const InputError&) {
          continue;  // what a reader of meshes does not need may be in a form that it does not know
        }
        if (found.size() != (is_on_points ? mesh_size_ : is_volume_.size())) continue;
        if (is_on_points) one.values = std::move(found);
        else
          for (std::size_t c = 0; c < found.size(); ++c)
            if (is_volume_[c]) one.values.push_back(found[c]);
        all.push_back(std::move(one));
      }
    return all;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw InputError(name_ + ": " + what); }

  /// Cuts the appended data off, which need not be XML, and parses the rest.
  void load(std::string_view bytes) {
    constexpr std::string_view kAppended = "<AppendedData";
    const std::size_t begin = bytes.find(kAppended);
    text_ = std::string(bytes.substr(0, begin));
    if (begin != std::string_view::npos) {
      const std::size_t end = bytes.find('>', begin), start = bytes.find('_', std::min(end, bytes.size()));
      if (end == std::string_view::npos || start == std::string_view::npos)
        fail("AppendedData: expected an underscore before the data");
      storage_.appended_base64 = bytes.substr(begin, end - begin).find("base64") != std::string_view::npos;
      storage_.appended = bytes.substr(start + 1);
      text_ += "</VTKFile>";
    }
    const pugi::xml_parse_result result =
        document_.load_buffer_inplace(text_.data(), text_.size(), pugi::parse_default, pugi::encoding_utf8);
    if (result) return;
    const auto line = std::count(bytes.begin(), bytes.begin() + std::min<std::ptrdiff_t>(result.offset, text_.size()),
                                 '\n') + 1;
    throw InputError(name_ + ":" + std::to_string(line) + ": not whole XML: " + result.description());
  }

  void read_header(const pugi::xml_node& file) {
    const std::string type = file.attribute("type").value(), order = file.attribute("byte_order").value(),
                      header = file.attribute("header_type").value();
    if (type != "UnstructuredGrid") fail("expected the type UnstructuredGrid, found " + in_quotes(type));
    const auto version = parse_number(file.attribute("version").as_string("0.1"));
    if (!version || *version < 0 || *version > 2.2) fail("expected version 0.1 to 2.2 of VTK XML");
    old_numbers_ = *version < 2.1;
    if (order == "BigEndian") storage_.endian = std::endian::big;
    else if (!order.empty() && order != "LittleEndian") fail("unknown byte_order " + in_quotes(order));
    if (header == "UInt64") storage_.header = kUInt64;
    else if (!header.empty() && header != "UInt32") fail("unknown header_type " + in_quotes(header));
    storage_.compressor = file.attribute("compressor").value();
  }

  static VtkXmlArray described(const pugi::xml_node& node) {
    return {node.attribute("Name").value(), node.attribute("type").value(), node.attribute("format").value(),
            node.child_value(), node.attribute("offset").value()};
  }

  std::vector<double> values(const pugi::xml_node& node) const {
    try {
      return decode_vtk_xml_array(described(node), storage_);
    } catch (const InputError& error) {
      fail(error.what());
    }
  }

  std::vector<std::int64_t> whole_numbers(const pugi::xml_node& cells, const char* array) const {
    const pugi::xml_node node = cells.find_child_by_attribute("DataArray", "Name", array);
    if (!node) fail(std::string("Cells: expected an array ") + array);
    std::vector<std::int64_t> numbers;
    for (const double value : values(node)) {
      if (value != std::floor(value) || std::abs(value) > 1e15)
        fail(std::string(array) + ": expected whole numbers");
      numbers.push_back(static_cast<std::int64_t>(value));
    }
    return numbers;
  }

  static std::size_t claimed(const pugi::xml_node& piece, const char* attribute) {
    return static_cast<std::size_t>(piece.attribute(attribute).as_ullong());
  }

  void read_piece(const pugi::xml_node& piece) {
    const std::size_t num_cells = claimed(piece, "NumberOfCells"), num_points = claimed(piece, "NumberOfPoints");
    if (num_cells == 0) return;
    const std::size_t first_point = mesh_.positions.size();
    const std::vector<double> points = values(piece.child("Points").child("DataArray"));
    if (points.size() != 3 * num_points || points.size() / 3 != num_points)
      fail("Points: expected three coordinates for each of " + std::to_string(num_points) + " points, found " +
           std::to_string(points.size()) + " numbers");
    if (first_point + num_points > static_cast<std::size_t>(std::numeric_limits<Index>::max()))
      fail("Points: more points than an index can tell");
    for (std::size_t i = 0; i < num_points; ++i) {
      mesh_.positions.emplace_back(&points[3 * i]);
      if (!mesh_.positions.back().allFinite())
        fail("point " + std::to_string(i) + " has a coordinate that is not finite");
    }
    const pugi::xml_node cells = piece.child("Cells");
    const auto nodes = whole_numbers(cells, "connectivity"), ends = whole_numbers(cells, "offsets"),
               types = whole_numbers(cells, "types");
    if (ends.size() != num_cells || types.size() != num_cells)
      fail("Cells: expected one offset and one type for each of " + std::to_string(num_cells) + " cells");
    add_cells(nodes, ends, types, first_point);
    read_cell_data(piece.child("CellData"), num_cells);
    num_left_out_ += count_arrays(piece.child("PointData"));
    num_cells_read_ += num_cells;
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
      const bool added = add_vtk_cell(mesh_, cells, type, cell, old_numbers_, refuse) == VtkCellUse::added;
      num_skipped_ += !added;
      is_volume_.push_back(added);
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
      if (components == 1)
        try {
          for (const double value : decode_vtk_xml_array(described_array, storage_)) {
            if (value != std::floor(value)) break;  // also of what is not a number
            numbers.values.push_back(static_cast<std::int64_t>(std::clamp(value, -1e15, 1e15)));
          }
        } catch (const InputError&) {
          numbers.values.clear();  // values such as qualities may well be nan
        }
      ++num_arrays_;
      if (numbers.name == "order" && asked_ != "order") continue;  // ours: it says nothing about materials
      if (numbers.values.size() == num_cells) keep(std::move(numbers));
      else others_.push_back(described_array.name);
    }
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
      chosen = subvol::choose_references(arrays_, asked_, others_);
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

  std::string name_, asked_, text_;
  pugi::xml_document document_;
  VtkXmlStorage storage_;
  NodalMesh mesh_;
  bool old_numbers_ = false;
  std::vector<bool> is_volume_;           ///< of all cells of the file: whether it is one of the mesh
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

}  // namespace subvol

// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/binary_value.h"
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/left_out.h"
#include "subvol/io/mesh_formats.h"
#include "subvol/io/nodal_formats.h"
#include "subvol/io/reference_arrays.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

namespace subvol::internal {

namespace {

struct VtkType {
  const char* name;
  ValueType type;
};
constexpr VtkType kVtkTypes[] = {
    {"float", kFloat32},
    {"double", kFloat64},
    {"char", kInt8},
    {"signed_char", kInt8},
    {"unsigned_char", kUInt8},
    {"short", kInt16},
    {"unsigned_short", kUInt16},
    {"int", kInt32},
    {"unsigned_int", kUInt32},
    {"long", kInt64},
    {"unsigned_long", kUInt64},
    {"vtkidtype", kInt32},
    {"vtktypeint64", kInt64},
    {"vtktypeint32", kInt32},
    {"vtktypeuint64", kUInt64},
    {"vtktypeuint32", kUInt32},
};

/// An attribute that is skipped: its keyword, its name, the number of components unless that is fixed, the size of a
/// lookup table, and the type unless the values are colors. Then come the components of each point, cell or table
/// entry.
struct VtkAttribute {
  const char* keyword;
  std::size_t components;  ///< fixed number; 0: given in the file
  bool is_colors = false;  ///< bytes in binary files, fractions in text
};
constexpr VtkAttribute kSkippedAttributes[] = {
    {"vectors", 3},
    {"normals", 3},
    {"tensors", 9},
    {"tensors6", 6},
    {"global_ids", 1},
    {"pedigree_ids", 1},
    {"edge_flags", 1},
    {"texture_coordinates", 0},
    {"color_scalars", 0, true},
    {"lookup_table", 4, true},
};

/// The numbers of a file in ASCII or binary.
class VtkStream {
 public:
  VtkStream(const std::string& name, std::string_view bytes) : scan_(name, bytes, TextScanner::Comments::none) {}

  TextScanner& scan() { return scan_; }
  bool is_binary() const { return binary_; }
  /// First part of the version.
  int major() const { return major_; }
  /// True if the nodes of cells have the numbers that they had before version 5.1.
  bool has_old_numbers() const { return old_numbers_; }

  void read_header() {
    constexpr std::string_view kOpening = "# vtk DataFile Version ";
    const auto first = scan_.line();
    if (!first || !lower_case(*first).starts_with(lower_case(kOpening)))
      scan_.fail("expected '# vtk DataFile Version 2.0' to 5.1 in the first line");
    TextScanner version("", first->substr(kOpening.size()));
    const auto number = parse_number(version.next().value_or(""));
    if (!number || *number < 2.0 || *number > 5.1) scan_.fail("expected version 2.0 to 5.1 of legacy VTK");
    major_ = static_cast<int>(*number);
    old_numbers_ = *number < 5.1;
    if (!scan_.line()) scan_.fail("the file ends where the title is expected");

    const std::string format = lower_case(scan_.word("ASCII or BINARY"));
    if (format != "ascii" && format != "binary") scan_.fail("expected ASCII or BINARY, found " + in_quotes(format));
    binary_ = format == "binary";
    const std::string_view dataset = scan_.word("DATASET");
    if (lower_case(dataset) != "dataset") scan_.fail("expected DATASET, found " + in_quotes(dataset));
    const std::string_view kind = scan_.word("UNSTRUCTURED_GRID");
    if (lower_case(kind) != "unstructured_grid") scan_.fail("expected UNSTRUCTURED_GRID, found " + in_quotes(kind));
  }

  ValueType read_type() {
    const std::string_view word = scan_.word("a data type");
    const auto type = type_of(word);
    if (!type) scan_.fail("unknown data type " + in_quotes(word));
    return *type;
  }

  static std::optional<ValueType> type_of(std::string_view word) {
    const std::string name = lower_case(word);
    for (const VtkType& type : kVtkTypes)
      if (name == type.name) return type.type;
    return std::nullopt;
  }

  /// Reads the number of things that each take at least one byte.
  std::size_t read_count(const char* what) {
    const std::int64_t n = scan_.integer(what);
    if (n < 0) scan_.fail(std::string(what) + " is negative: " + std::to_string(n));
    if (n > std::numeric_limits<Index>::max() || static_cast<std::uint64_t>(n) > scan_.bytes_left())
      scan_.fail(std::string(what) + " is " + std::to_string(n) + ", more than the rest of the file can hold");
    return static_cast<std::size_t>(n);
  }

  /// Reads n values, which in a binary file start on the next line, and calls visit(i, value) for each.
  template <class Visit>
  void read_values(std::size_t n, ValueType type, const char* what, const Visit& visit) {
    if (!binary_) {
      if (n > scan_.bytes_left()) scan_.fail(std::string("the file ends within ") + what);
      for (std::size_t i = 0; i < n; ++i) visit(i, scan_.number(what));
      return;
    }
    if (n == 0) return;
    scan_.line();
    if (n > scan_.bytes_left() / type.size) scan_.fail(std::string("the file ends within ") + what);
    const std::string_view bytes = scan_.bytes(n * type.size, what);
    for (std::size_t i = 0; i < n; ++i) visit(i, decode(bytes.data() + i * type.size, type, std::endian::big));
  }

  /// Reads n whole numbers, clamped to +-1e15: no valid number here is that large.
  std::vector<std::int64_t> read_whole_numbers(std::size_t n, ValueType type, const char* what) {
    if (type.is_real()) scan_.fail(std::string(what) + " must be of a whole-number type");
    std::vector<std::int64_t> numbers;
    numbers.reserve(std::min(n, scan_.bytes_left()));
    read_values(n, type, what, [&](std::size_t, double value) {
      if (value != std::floor(value)) scan_.fail(std::string(what) + " must be whole numbers");
      numbers.push_back(static_cast<std::int64_t>(std::clamp(value, -1e15, 1e15)));
    });
    return numbers;
  }

  /// METADATA runs to the next empty line.
  void skip_metadata() {
    scan_.line();
    while (const auto line = scan_.line())
      if (line->find_first_not_of(" \t") == std::string_view::npos) break;
  }

 private:
  TextScanner scan_;
  int major_ = 0;
  bool binary_ = false, old_numbers_ = false;
};

/// Reads attributes. Arrays of one whole number per cell are kept: one may become the references.
class VtkAttributes {
 public:
  /// asked: the array that is to become the references; empty: a usual one.
  VtkAttributes(VtkStream& stream, const std::string& name, const std::string& asked)
      : stream_(stream), scan_(stream.scan()), name_(name), asked_(asked) {}

  /// True if reading stopped at an attribute that cannot be skipped.
  bool has_stray() const { return stray_attribute_; }

  /// Reads those of points or cells. num_cells, has_types: what the file has given so far.
  void read(std::size_t expected, bool of_cells, std::size_t num_cells, bool has_types) {
    num_cells_ = num_cells;
    has_types_ = has_types;
    const std::int64_t n = scan_.integer("the number of attribute entries");
    if (n < 0 || static_cast<std::uint64_t>(n) != expected)
      scan_.fail("attributes for " + std::to_string(n) + " entries, expected " + std::to_string(expected));
    while (!stray_attribute_) {
      const auto word = scan_.peek();
      if (!word) return;
      const std::string keyword = lower_case(*word);
      if (keyword == "cell_data" || keyword == "point_data") return;
      scan_.next();
      if (keyword == "scalars")
        read_scalars(expected, of_cells);
      else if (keyword == "field")
        read_field(of_cells);
      else if (keyword == "metadata")
        stream_.skip_metadata();
      else if (!skip_attribute(keyword, expected, of_cells))
        end_attributes(*word);
    }
  }

  /// Reads a field that is outside of the attributes of points and cells.
  void read_stray_field(std::size_t num_cells, bool has_types) {
    num_cells_ = num_cells;
    has_types_ = has_types;
    read_field(false);
  }

  /// Returns the references, one per cell; empty: there are none. warnings: what became of other attributes is added.
  std::vector<std::int64_t> references(std::vector<std::string>& warnings) {
    std::optional<std::size_t> chosen;
    try {
      chosen = internal::choose_references(arrays_, asked_, others_);
    } catch (const InputError& error) {
      throw InputError(name_ + ": " + error.what());
    }
    if (!unread_.empty()) warnings.push_back(unread_);
    tell_of_references(arrays_, chosen, !asked_.empty(), num_arrays_, warnings);
    return chosen ? std::move(arrays_[*chosen].values) : std::vector<std::int64_t>();
  }

 private:
  /// Returns false if the kind or type of the attribute is not known.
  bool skip_attribute(const std::string& keyword, std::size_t n, bool of_cells) {
    const auto* attribute = std::find_if(std::begin(kSkippedAttributes), std::end(kSkippedAttributes),
                                         [&](const VtkAttribute& a) { return keyword == a.keyword; });
    if (attribute == std::end(kSkippedAttributes)) return false;
    const std::string_view name = scan_.word("the name of an attribute");
    std::size_t components = attribute->components;
    if (components == 0) components = stream_.read_count("the number of components");
    if (keyword == "lookup_table") n = stream_.read_count("the size of a lookup table");
    const auto type = attribute->is_colors ? std::optional(stream_.is_binary() ? kUInt8 : kFloat32)
                                           : VtkStream::type_of(scan_.word("a data type"));
    if (!type) return false;
    if (keyword == "lookup_table")
      read_array(n, components, *type, "", Array::no_data);
    else
      read_array(n, components, *type, name, of_cells && !keyword.ends_with("_ids") ? Array::of_cells : Array::other);
    return true;
  }

  /// Stops reading at an attribute that cannot be skipped.
  void end_attributes(std::string_view word) {
    stray_attribute_ = true;
    if (std::none_of(arrays_.begin(), arrays_.end(), may_be_references) || !asked_.empty())
      unread_ = "attributes from " + in_quotes(word) + " on are not read";
  }

  void read_scalars(std::size_t n, bool of_cells) {
    const std::string_view name = scan_.word("the name of the scalars");
    const auto type = VtkStream::type_of(scan_.word("a data type"));
    if (!type) return end_attributes(name);
    std::int64_t components = 1;
    if (const auto word = scan_.peek(); word && parse_integer(*word)) components = *parse_integer(*scan_.next());
    if (components < 1 || components > 4) scan_.fail("scalars have 1 to 4 components");
    if (const auto word = scan_.peek(); word && lower_case(*word) == "lookup_table") {
      scan_.next();
      scan_.word("the name of a lookup table");
    }
    read_array(n, static_cast<std::size_t>(components), *type, name, of_cells ? Array::of_cells : Array::other);
  }

  void read_field(bool of_cells) {
    scan_.word("the name of the field");
    const std::size_t num_arrays = stream_.read_count("the number of arrays");
    for (std::size_t i = 0; i < num_arrays; ++i) {
      auto name = scan_.word("the name of an array");
      while (lower_case(name) == "metadata") {
        stream_.skip_metadata();
        name = scan_.word("the name of an array");
      }
      const std::size_t components = stream_.read_count("the number of components"),
                        n = stream_.read_count("the number of tuples");
      if (components > 0 && n > scan_.bytes_left() / components) scan_.fail("the file ends within an array");
      const std::string_view type_name = scan_.word("a data type");
      if (lower_case(type_name) == "string") {
        scan_.line();
        for (std::size_t j = 0; j < components * n; ++j) skip_string();
        ++num_arrays_;
        continue;
      }
      const auto type = VtkStream::type_of(type_name);
      if (!type) {
        if (!has_types_) scan_.fail("unknown data type " + in_quotes(type_name));
        return end_attributes(name);
      }
      read_array(n, components, *type, name, of_cells ? Array::of_cells : Array::other);
    }
  }

  /// Skips a string: in text, a line; in binary, its length in 1, 2, 4 or 8 bytes, as the top two bits say, and then
  /// its characters.
  void skip_string() {
    if (!stream_.is_binary()) {
      if (!scan_.line()) scan_.fail("the file ends within an array");
      return;
    }
    const std::string_view first = scan_.bytes(1, "an array");
    const auto lead = static_cast<unsigned char>(first[0]);
    const std::size_t more = (std::size_t{1} << (3 - (lead >> 6))) - 1;
    std::size_t length = lead & 63u;
    for (const char c : scan_.bytes(more, "an array")) length = length << 8 | static_cast<unsigned char>(c);
    scan_.bytes(length, "an array");
  }

  enum class Array { of_cells, other, no_data };  ///< no_data: a lookup table

  void read_array(std::size_t n, std::size_t components, ValueType type, std::string_view name, Array kind) {
    if (components > 0 && n > scan_.bytes_left() / components) scan_.fail("the file ends within an array");
    CellNumbers array{decoded(name), type.is_real(), {}};
    bool keep = kind == Array::of_cells && components == 1 && n == num_cells_;
    const auto take = [&](std::size_t, double value) {
      keep = keep && value == std::floor(value);
      if (keep) array.values.push_back(static_cast<std::int64_t>(std::clamp(value, -1e15, 1e15)));
    };
    if (stream_.is_binary() || !type.is_real())
      stream_.read_values(n * components, type, "an array", take);
    else  // values such as cell qualities may well be nan
      for (std::size_t i = 0; i < n * components; ++i) {
        const auto value = parse_number(scan_.word("an array"));
        take(i, value.value_or(std::numeric_limits<double>::quiet_NaN()));
      }
    if (keep)
      arrays_.push_back(std::move(array));
    else if (kind == Array::of_cells)
      others_.push_back(std::move(array.name));
    num_arrays_ += kind != Array::no_data;
  }

  /// Decodes a name: since names are single words, VTK writes a blank as %20.
  static std::string decoded(std::string_view word) {
    std::string name;
    for (std::size_t i = 0; i < word.size(); ++i) {
      int code = 0;
      const char* digits = word.data() + i + 1;
      const bool is_code =
          word[i] == '%' && i + 2 < word.size() && std::from_chars(digits, digits + 2, code, 16).ptr == digits + 2;
      name += is_code ? static_cast<char>(code) : word[i];
      i += is_code ? 2 : 0;
    }
    return name;
  }

  VtkStream& stream_;
  TextScanner& scan_;
  std::string name_, asked_;
  std::size_t num_cells_ = 0;
  bool has_types_ = false, stray_attribute_ = false;
  std::vector<CellNumbers> arrays_;
  std::vector<std::string> others_;  ///< names of other arrays of cells
  std::size_t num_arrays_ = 0;
  std::string unread_;  ///< a warning about attributes that are not read; empty: there are none
};

/// Reads the sections of a file and makes a mesh of them.
class VtkParser {
 public:
  VtkParser(const std::string& name, std::string_view bytes, const std::string& references)
      : stream_(name, bytes), attributes_(stream_, name, references) {}

  NodalMesh parse() {
    stream_.read_header();
    while (const auto word = scan_.next()) {
      const std::string keyword = lower_case(*word);
      if (keyword == "points")
        read_points();
      else if (keyword == "cells")
        read_cells();
      else if (keyword == "cell_types")
        read_cell_types();
      else if (keyword == "cell_data")
        attributes_.read(num_cells_, true, num_cells_, has_types_);
      else if (keyword == "point_data")
        attributes_.read(mesh_.positions.size(), false, num_cells_, has_types_);
      else if (keyword == "field")
        attributes_.read_stray_field(num_cells_, has_types_);
      else if (keyword == "metadata")
        stream_.skip_metadata();
      else
        scan_.fail("expected a section of an unstructured grid, found " + in_quotes(*word));
      if (attributes_.has_stray()) break;  // the mesh itself comes before its attributes
    }
    if (!has_points_) scan_.fail("the file ends without POINTS");
    if (!has_cells_) scan_.fail("the file ends without CELLS");
    if (!has_types_) scan_.fail("the file ends without CELL_TYPES");
    build_cells();
    return std::move(mesh_);
  }

 private:
  void read_points() {
    if (has_points_) scan_.fail("a second section POINTS");
    has_points_ = true;
    const std::size_t n = stream_.read_count("the number of points");
    const ValueType type = stream_.read_type();
    if (n > scan_.bytes_left() / 3) scan_.fail("the file ends within the coordinates");
    mesh_.positions.resize(n);
    stream_.read_values(3 * n, type, "a coordinate", [&](std::size_t i, double value) {
      if (!std::isfinite(value)) scan_.fail("point " + std::to_string(i / 3) + " has a coordinate that is not finite");
      mesh_.positions[i / 3][static_cast<Eigen::Index>(i % 3)] = value;
    });
  }

  void read_cells() {
    if (has_cells_) scan_.fail("a second section CELLS");
    has_cells_ = true;
    cells_line_ = scan_.word_line();
    const std::size_t n = stream_.read_count("the number of cells"), size = stream_.read_count("the size of CELLS");
    const auto next = stream_.major() >= 5 ? scan_.peek() : std::nullopt;
    if (next && lower_case(*next) == "offsets")
      read_offsets_and_connectivity(n, size);
    else if (next && stream_.is_binary())
      scan_.fail("expected OFFSETS, found " + in_quotes(*next));
    else
      split_counted_lists(n, stream_.read_whole_numbers(size, kInt32, "cell corners"));
    num_cells_ = offsets_.size() - 1;
  }

  // Before 5.0, each cell is its number of corners followed by the corners.
  void split_counted_lists(std::size_t n, const std::vector<std::int64_t>& numbers) {
    std::size_t at = 0;
    for (std::size_t c = 0; c < n; ++c) {
      if (at == numbers.size()) scan_.fail("CELLS has fewer cells than it says", cells_line_);
      const std::int64_t corners = numbers[at++];
      if (corners < 0 || static_cast<std::uint64_t>(corners) > numbers.size() - at)
        scan_.fail(
            "cell " + std::to_string(c) + " has " + std::to_string(corners) + " corners, beyond the size of CELLS",
            cells_line_);
      corners_.insert(corners_.end(), numbers.begin() + at, numbers.begin() + at + corners);
      at += static_cast<std::size_t>(corners);
      offsets_.push_back(corners_.size());
    }
    if (at != numbers.size()) scan_.fail("the size of CELLS is larger than its cells", cells_line_);
  }

  // From 5.0 on, n is the number of offsets, one more than there are cells.
  void read_offsets_and_connectivity(std::size_t n, std::size_t size) {
    scan_.next();
    const std::vector<std::int64_t> offsets = stream_.read_whole_numbers(n, stream_.read_type(), "offsets");
    std::string_view word = scan_.word("CONNECTIVITY");
    if (lower_case(word) == "metadata") {
      stream_.skip_metadata();
      word = scan_.word("CONNECTIVITY");
    }
    if (lower_case(word) != "connectivity") scan_.fail("expected CONNECTIVITY, found " + in_quotes(word));
    corners_ = stream_.read_whole_numbers(size, stream_.read_type(), "connectivity");
    if (offsets.empty()) return;
    if (offsets.front() != 0 || offsets.back() != static_cast<std::int64_t>(size) ||
        !std::is_sorted(offsets.begin(), offsets.end()))
      scan_.fail("OFFSETS must rise from 0 to the size of CONNECTIVITY", cells_line_);
    offsets_.assign(offsets.begin(), offsets.end());
  }

  void read_cell_types() {
    if (has_types_) scan_.fail("a second section CELL_TYPES");
    has_types_ = true;
    types_line_ = scan_.word_line();
    const std::size_t n = stream_.read_count("the number of cell types");
    types_ = stream_.read_whole_numbers(n, kInt32, "cell types");
  }

  void build_cells() {
    references_ = attributes_.references(mesh_.warnings);
    if (types_.size() != num_cells_)
      scan_.fail(std::to_string(types_.size()) + " cell types for " + std::to_string(num_cells_) + " cells",
                 types_line_);
    NodalCells cells(mesh_);
    const std::size_t num_points = mesh_.positions.size();
    for (std::size_t c = 0; c < num_cells_; ++c) {
      const auto fail = [&](const std::string& what) {
        const bool is_about_type = what.starts_with("has VTK") || what.starts_with("is a");
        scan_.fail("cell " + std::to_string(c) + ' ' + what, is_about_type ? types_line_ : cells_line_);
      };
      const std::span<const std::int64_t> nodes(corners_.data() + offsets_[c], offsets_[c + 1] - offsets_[c]);
      const int type = static_cast<int>(std::clamp<std::int64_t>(types_[c], -1, 1000000));
      for (const std::int64_t node : nodes)  // nodes that complete cells come after those of the file
        if (node < 0 || static_cast<std::uint64_t>(node) >= num_points)
          fail("names point " + std::to_string(node) + " of " + std::to_string(num_points));
      const VtkCellUse use = add_vtk_cell(mesh_, cells, type, nodes, stream_.has_old_numbers(), fail);
      if (use == VtkCellUse::bezier)
        fail("has VTK type " + std::to_string(type) + ", a Bezier cell, which is only read from a .vtu");
      if (use == VtkCellUse::lower_dimension)
        ++num_skipped_;
      else
        add_reference(c);
    }
    if (num_skipped_ > 0)
      mesh_.warnings.push_back(std::to_string(num_skipped_) + " cells of lower dimension are skipped");
    if (num_beyond_ > 0)
      mesh_.warnings.push_back("the references of " + std::to_string(num_beyond_) +
                               " cells are beyond 32 bits, and become 0");
  }

  void add_reference(std::size_t c) {
    const std::int64_t reference = references_.empty() ? 0 : references_[c];
    const bool fits = reference >= std::numeric_limits<int>::min() && reference <= std::numeric_limits<int>::max();
    mesh_.references.push_back(fits ? static_cast<int>(reference) : 0);
    num_beyond_ += !fits;
  }

  VtkStream stream_;
  TextScanner& scan_ = stream_.scan();
  VtkAttributes attributes_;
  NodalMesh mesh_;
  bool has_points_ = false, has_cells_ = false, has_types_ = false;
  std::size_t num_cells_ = 0, num_skipped_ = 0, num_beyond_ = 0, cells_line_ = 0, types_line_ = 0;
  std::vector<std::size_t> offsets_{0};
  std::vector<std::int64_t> corners_, types_, references_;
};

/// The VTK type of a linear cell, and the place in it of each of our corners; each of these orders is its own inverse.
int vtk_linear_type(CellKind kind) {
  constexpr int kVtkLinearTypes[] = {10, 13, 12, 14};
  return kVtkLinearTypes[static_cast<std::size_t>(kind)];
}
std::size_t vtk_corner(CellKind kind, std::size_t i) {
  constexpr std::array<std::size_t, 6> kWedge{0, 2, 1, 3, 5, 4};  // the normal of 0 1 2 points away from 3 4 5
  return kind == CellKind::prism ? kWedge[i] : i;
}

}  // namespace

NodalMesh parse_nodal_vtk(const std::string& name, std::string_view bytes, const std::string& references) {
  return VtkParser(name, bytes, references).parse();
}

std::string format_legacy_vtk(const VolumeMesh& mesh) {
  std::string text = "# vtk DataFile Version 3.0\nsubvol volume mesh\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS " +
                     std::to_string(mesh.num_vertices()) + " double\n";
  for (const Vec3& position : mesh.positions)
    for (int i = 0; i < 3; ++i) {
      append_number(text, position[i]);
      text += i < 2 ? ' ' : '\n';
    }
  text += "CELLS " + std::to_string(mesh.num_cells()) + " " +
          std::to_string(mesh.num_cells() + mesh.cell_vertices.size()) + "\n";
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const auto cell = mesh.cell(c);
    text += std::to_string(cell.size());
    for (std::size_t i = 0; i < cell.size(); ++i)
      text.append(" ").append(std::to_string(cell[vtk_corner(mesh.kinds[c], i)]));
    text += '\n';
  }
  text += "CELL_TYPES " + std::to_string(mesh.num_cells()) + "\n";
  for (const CellKind kind : mesh.kinds) text += std::to_string(vtk_linear_type(kind)) + "\n";
  if (!mesh.references.empty()) {
    text += "CELL_DATA " + std::to_string(mesh.num_cells()) + "\n";
    for (const char* array : {"material", "reference"}) {  // MFEM looks for the first name, subvol for the second
      text += std::string("SCALARS ") + array + " int 1\nLOOKUP_TABLE default\n";
      for (const int reference : mesh.references) text += std::to_string(reference) + "\n";
    }
  }
  return text;
}

}  // namespace subvol::internal

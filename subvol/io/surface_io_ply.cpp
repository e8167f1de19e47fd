// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/binary_value.h"
#include "subvol/base/error.h"
#include "subvol/base/sort_unique.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/color_groups.h"
#include "subvol/io/left_out.h"
#include "subvol/io/reference_arrays.h"
#include "subvol/io/surface_formats.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

namespace subvol::internal {

namespace {

constexpr double kLevels = 255;  // of a color in 8 bits
/// Largest number of labels that become groups: the references of most formats have at least 16 bits.
constexpr std::size_t kMostLabels = 65535;

struct NamedType {
  const char* name;
  ValueType type;
};
constexpr NamedType kPlyTypes[] = {
    {"char", kInt8},   {"uchar", kUInt8},   {"short", kInt16},     {"ushort", kUInt16},
    {"int", kInt32},   {"uint", kUInt32},   {"float", kFloat32},   {"double", kFloat64},
    {"int8", kInt8},   {"uint8", kUInt8},   {"int16", kInt16},     {"uint16", kUInt16},
    {"int32", kInt32}, {"uint32", kUInt32}, {"float32", kFloat32}, {"float64", kFloat64}};

struct Property {
  enum class Use { none, x, y, z, corners, strip, attribute, label, red, green, blue };
  Use use = Use::none;
  std::string name;
  bool is_list = false;
  ValueType count_type = kUInt8, type = kFloat32;
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;

  std::size_t least_bytes(bool text) const {
    std::size_t bytes = 0;
    for (const Property& p : properties) bytes += text ? 2 : p.is_list ? p.count_type.size : p.type.size;
    return bytes;
  }
  bool holds_faces() const { return name == "face" || name == "tristrips"; }
  bool has(Property::Use use) const {
    return std::any_of(properties.begin(), properties.end(), [&](const Property& p) { return p.use == use; });
  }
};

/// How the rows of a text are divided: a row holds one element, as the format says, or as many values as fit.
enum class PlyRows { elements, values };

/// Holds what the header of a file announces.
struct PlyHeader {
  bool text = true;
  std::endian order = std::endian::little;
  std::vector<PlyElement> elements;
  LeftOut left_out;  ///< properties that are not used
};

/// Reads the header of a file, and chooses what its properties are used for.
class PlyHeaderReader {
 public:
  /// attribute  as for `PlyParser`.
  PlyHeaderReader(const std::string& name, TextScanner& scan, const std::string& attribute)
      : name_(name), scan_(scan), attribute_(attribute) {}

  PlyHeader read() {
    const auto first = scan_.line();
    if (first != std::optional<std::string_view>("ply")) scan_.fail("expected ply in the first line");
    bool has_format = false;
    while (const auto line = scan_.line()) {
      TextScanner words(name_, *line, TextScanner::Comments::none);
      const std::string_view keyword = words.next().value_or("comment");
      if (keyword == "end_header") {
        if (!has_format) scan_.fail("the header has no format");
        choose_face_properties();
        return std::move(header_);
      }
      if (keyword == "format")
        has_format = true, read_format(words);
      else if (keyword == "element")
        read_element_line(words);
      else if (keyword == "property")
        read_property_line(words);
      else if (keyword != "comment" && keyword != "obj_info")
        scan_.fail("unknown header keyword " + in_quotes(keyword));
    }
    scan_.fail("the file ends where end_header is expected");
  }

 private:
  void read_format(TextScanner& words) {
    const std::string_view format = words.next().value_or("");
    if (words.next().value_or("") != "1.0") scan_.fail("expected version 1.0 of the format");
    header_.text = format == "ascii";
    header_.order = format == "binary_big_endian" ? std::endian::big : std::endian::little;
    if (!header_.text && format != "binary_big_endian" && format != "binary_little_endian")
      scan_.fail("unknown format " + in_quotes(format));
  }

  void read_element_line(TextScanner& words) {
    const std::string_view name = words.next().value_or("");
    const auto count = parse_integer(words.next().value_or(""));
    if (!count || *count < 0) scan_.fail("expected 'element NAME COUNT'");
    if (*count > std::numeric_limits<Index>::max() || static_cast<std::uint64_t>(*count) > scan_.bytes_left())
      scan_.fail("element " + in_quotes(name) + " has a count of " + std::to_string(*count) +
                 ", more than the rest of the file can hold");
    header_.elements.push_back({std::string(name), static_cast<std::size_t>(*count), {}});
  }

  void read_property_line(TextScanner& words) {
    if (header_.elements.empty()) scan_.fail("a property before any element");
    Property property;
    std::string_view word = words.next().value_or("");
    if (word == "list") {
      property.is_list = true;
      property.count_type = type_of(words.next().value_or(""));
      if (property.count_type.is_real()) scan_.fail("the length of a list must be a whole number");
      word = words.next().value_or("");
    }
    property.type = type_of(word);
    const std::string_view name = words.next().value_or("");
    property.use = use_of(header_.elements.back().name, name, property.is_list);
    property.name = name;
    header_.elements.back().properties.push_back(property);
  }

  /// Chooses the properties of faces that become groups: the one whose name tells most of a material or a region, else
  /// a color. Counts all properties that are not used.
  void choose_face_properties() {
    if (std::count_if(header_.elements.begin(), header_.elements.end(),
                      [](const PlyElement& e) { return e.holds_faces() && e.count > 0; }) > 1)
      scan_.fail("more than one element of faces or tristrips; expected one");
    for (PlyElement& element : header_.elements) {
      if (element.name == "face") choose_groups(element);
      for (const Property& property : element.properties) note(element, property);
    }
  }

  static void choose_groups(PlyElement& face) {
    Property* label = nullptr;
    for (Property& p : face.properties) {
      const auto rank = reference_name_rank(p.name);
      if (p.is_list || p.type.is_real() || !rank) continue;
      if (!label || *rank < *reference_name_rank(label->name)) label = &p;
    }
    if (label) {
      label->use = Property::Use::label;
      return;
    }
    constexpr std::array kColors{std::pair("red", Property::Use::red), std::pair("green", Property::Use::green),
                                 std::pair("blue", Property::Use::blue)};
    const auto find = [&](std::string_view name) {
      return std::find_if(face.properties.begin(), face.properties.end(),
                          [&](const Property& p) { return p.name == name && !p.is_list; });
    };
    for (const auto& [name, use] : kColors)
      if (find(name) == face.properties.end()) return;
    for (const auto& [name, use] : kColors) find(name)->use = use;
  }

  /// Counts a property that is not used. Normals do not count: faces define them.
  void note(const PlyElement& element, const Property& property) {
    const std::string& name = property.name;
    const bool is_normal = name == "nx" || name == "ny" || name == "nz";
    if (element.count == 0 || property.use != Property::Use::none || is_normal) return;
    const bool is_known = element.name == "vertex" || element.name == "face";
    header_.left_out.add("properties of " + (is_known ? element.name : "element " + in_quotes(element.name)));
  }

  ValueType type_of(std::string_view word) const {
    for (const NamedType& type : kPlyTypes)
      if (word == type.name) return type.type;
    scan_.fail("unknown property type " + in_quotes(word));
  }

  Property::Use use_of(std::string_view element, std::string_view name, bool is_list) const {
    if (element == "vertex" && !is_list) {
      if (name == "x") return Property::Use::x;
      if (name == "y") return Property::Use::y;
      if (name == "z") return Property::Use::z;
      if (!attribute_.empty() && name == attribute_) return Property::Use::attribute;
    }
    const bool corners = name == "vertex_indices" || name == "vertex_index";
    if (!is_list || !corners) return Property::Use::none;
    return element == "face"        ? Property::Use::corners
           : element == "tristrips" ? Property::Use::strip
                                    : Property::Use::none;
  }

  const std::string& name_;
  TextScanner& scan_;
  const std::string& attribute_;
  PlyHeader header_;
};

class PlyParser {
 public:
  /// attribute  vertex property whose values are kept, too; empty: none.
  PlyParser(const std::string& name, std::string_view bytes, std::string attribute = "",
            PlyRows rows = PlyRows::elements)
      : name_(name),
        size_(bytes.size()),
        scan_(name, bytes, TextScanner::Comments::none),
        attribute_(std::move(attribute)),
        rows_(rows) {}

  ParsedSurface parse() {
    header_ = PlyHeaderReader(name_, scan_, attribute_).read();
    for (const PlyElement& element : header_.elements) read_element(element);
    if (header_.text && rows_ == PlyRows::values && scan_.peek()) fail("more values than the header says");
    for (const Index v : mesh_.face_vertices)
      if (static_cast<std::size_t>(v) >= mesh_.positions.size())
        throw InputError(name_ + ": a face names vertex " + std::to_string(v) + " of " +
                         std::to_string(mesh_.positions.size()));
    add_groups();
    ParsedSurface parsed{std::move(mesh_), {}};
    if (longer_rows_ > 0)
      parsed.warnings.push_back(std::to_string(longer_rows_) + (longer_rows_ == 1 ? " row has" : " rows have") +
                                " more values than the header says, the first in line " +
                                std::to_string(first_longer_row_) + ": the rest of each row is passed over");
    header_.left_out.tell(parsed.warnings);
    return parsed;
  }

  /// Reads only the header; returns true if it announces faces.
  bool has_faces() {
    header_ = PlyHeaderReader(name_, scan_, attribute_).read();
    return std::any_of(header_.elements.begin(), header_.elements.end(),
                       [](const PlyElement& element) { return element.holds_faces() && element.count > 0; });
  }

  /// True if a row held more or fewer values than the header says.
  bool has_other_rows() const { return has_shorter_row_ || longer_rows_ > 0; }

  /// Returns the values of the attribute that `parse` found, one per vertex; none if there is no such property.
  std::vector<double> take_attribute() { return std::move(values_); }

 private:
  /// Throws InputError that names the line in text, or the byte in binary data.
  [[noreturn]] void fail(const std::string& message) const {
    if (header_.text) scan_.fail(message);
    throw InputError(name_ + ": byte " + std::to_string(size_ - scan_.bytes_left()) + ": " + message);
  }

  /// Labels > 0 are the numbers of the groups; if one is not, groups are named after property and label. In the
  /// property that subvol writes, 0 is no group.
  void add_groups() {
    if (colors_) mesh_.face_groups = colors_->take(header_.left_out, "colors of faces");
    if (labels_.empty() || labels_.size() != mesh_.num_faces()) return;
    std::vector<std::int64_t> found = labels_;
    sort_unique(found);
    if (found.size() > kMostLabels) return header_.left_out.add("properties of face");
    if (label_name_ == "reference" && found.front() == 0) found.erase(found.begin());
    if (found.empty()) return;
    const bool are_numbers = found.front() > 0 && found.back() <= std::numeric_limits<int>::max();
    FaceGroups& groups = mesh_.face_groups;
    for (const std::int64_t label : found) {
      const auto next = static_cast<int>(groups.groups.size()) + 1;
      groups.groups.push_back({are_numbers ? "" : label_name_ + " " + std::to_string(label),
                               are_numbers ? static_cast<int>(label) : next, 2});
    }
    for (const std::int64_t label : labels_) {
      const auto place = std::lower_bound(found.begin(), found.end(), label);
      const bool is_group = place != found.end() && *place == label;
      groups.of_face.push_back(is_group ? static_cast<Index>(place - found.begin()) : kNoIndex);
    }
  }

  void read_element(const PlyElement& element) {
    const bool vertices = element.name == "vertex", faces = element.name == "face";
    if (vertices && !(element.has(Property::Use::x) && element.has(Property::Use::y) && element.has(Property::Use::z)))
      fail("vertices without x, y and z");
    if (faces && !element.has(Property::Use::corners)) fail("faces without vertex_indices");
    if (element.name == "tristrips" && !element.has(Property::Use::strip)) fail("tristrips without vertex_indices");
    // An element without properties takes no bytes, so its count means nothing.
    if (element.properties.empty()) return;
    if (element.count > (scan_.bytes_left() + 1) / element.least_bytes(header_.text))
      fail("element " + in_quotes(element.name) + " has a count of " + std::to_string(element.count) +
           ", more than the rest of the file can hold");
    for (std::size_t i = 0; i < element.count; ++i) {
      if (vertices) mesh_.positions.emplace_back();
      header_.text ? read_row(element) : read_properties(element);
      if (!faces) continue;
      mesh_.face_offsets.push_back(mesh_.face_vertices.size());
      if (element.has(Property::Use::red)) {
        if (!colors_) colors_.emplace();
        colors_->add_face(color_name(color_));
      }
    }
  }

  void read_properties(const PlyElement& element) {
    for (const Property& property : element.properties) read_property(property);
  }

  /// Reads an element of text. Passes over what its row holds behind it. InputError: the row ends within it.
  void read_row(const PlyElement& element) {
    if (rows_ == PlyRows::values || !scan_.peek()) return read_properties(element);
    const std::size_t row = scan_.word_line();
    const auto require_same_row = [&] {
      if (scan_.word_line() == row) return;
      has_shorter_row_ = true;
      scan_.fail("expected all values of an element " + in_quotes(element.name) + " in this line, found fewer", row);
    };
    try {
      read_properties(element);
    } catch (const InputError&) {
      require_same_row();
      throw;
    }
    require_same_row();
    if (!scan_.peek() || scan_.word_line() != row) return;
    scan_.line();
    if (longer_rows_++ == 0) first_longer_row_ = row;
  }

  void read_property(const Property& property) {
    using Use = Property::Use;
    if (property.is_list) {
      const double n = read_whole(property.count_type, "the length of a list");
      if (n < 0 || n > static_cast<double>(scan_.bytes_left())) fail("a list of impossible length");
      strip_.clear();
      for (double i = 0; i < n; ++i) {
        if (property.use == Use::corners)
          add_corner(read_whole(property.type, "a vertex number"));
        else if (property.use == Use::strip)
          add_to_strip(read_whole(property.type, "a vertex number"));
        else
          skip_value(property.type);
      }
    } else if (property.use == Use::none) {
      skip_value(property.type);
    } else if (property.use == Use::label) {
      label_name_ = property.name;
      constexpr const char* kFaceLabelText = "a label of a face";
      labels_.push_back(header_.text ? scan_.integer(kFaceLabelText)
                                     : static_cast<std::int64_t>(read_whole(property.type, kFaceLabelText)));
    } else if (property.use >= Use::red) {
      const double level = read_number(property.type, "a color of a face");
      color_[static_cast<std::size_t>(property.use) - static_cast<std::size_t>(Use::red)] =
          property.type.is_real() ? kLevels * level : level;
    } else if (property.use == Use::attribute) {
      values_.push_back(read_number(property.type, "a value of " + attribute_));
    } else {
      mesh_.positions.back()[static_cast<int>(property.use) - static_cast<int>(Use::x)] =
          read_number(property.type, "a coordinate");
    }
  }

  void add_corner(double v) {
    if (v < 0 || v > std::numeric_limits<Index>::max()) fail("vertex number out of range");
    mesh_.face_vertices.push_back(static_cast<Index>(v));
  }

  /// Adds the triangle of the last three vertices of a strip; every second one is turned. A vertex -1 ends a strip, and
  /// triangles that name a vertex twice only join strips.
  void add_to_strip(double v) {
    if (v == -1) return strip_.clear();
    if (v < 0 || v > std::numeric_limits<Index>::max()) fail("vertex number out of range");
    strip_.push_back(static_cast<Index>(v));
    if (strip_.size() < 3) return;
    std::array<Index, 3> corners{};
    std::copy(strip_.end() - 3, strip_.end(), corners.begin());
    if (strip_.size() % 2 == 0) std::swap(corners[0], corners[1]);
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) return;
    mesh_.face_vertices.insert(mesh_.face_vertices.end(), corners.begin(), corners.end());
    mesh_.face_offsets.push_back(mesh_.face_vertices.size());
  }

  double read_whole(ValueType type, const char* what) {
    if (header_.text) return static_cast<double>(scan_.integer(what));
    const double value = read_binary(type);
    if (value != std::floor(value)) fail(std::string(what) + " must be a whole number");
    return value;
  }

  double read_number(ValueType type, const std::string& what) {
    if (header_.text) return scan_.number(what.c_str());
    const double value = read_binary(type);
    if (!std::isfinite(value)) fail(what + " is not finite");
    return value;
  }

  void skip_value(ValueType type) {
    if (header_.text)
      scan_.word("a value");
    else
      read_binary(type);
  }

  double read_binary(ValueType type) {
    if (type.size > scan_.bytes_left()) fail("the file ends within its data");
    return decode(scan_.bytes(type.size, "the data").data(), type, header_.order);
  }

  std::string name_;
  std::size_t size_;
  TextScanner scan_;
  PlyHeader header_;
  PolygonMesh mesh_;
  std::vector<Index> strip_;  // vertices of the present strip of triangles
  std::string attribute_;
  std::vector<double> values_;
  std::string label_name_;
  std::vector<std::int64_t> labels_;  // of the faces
  std::array<double, 3> color_{};     // of the present face
  std::optional<ColorGroups> colors_;
  PlyRows rows_;
  std::size_t longer_rows_ = 0, first_longer_row_ = 0;
  bool has_shorter_row_ = false;
};

/// Returns the parser of a file that has been parsed, and the surface. If a file with more or fewer values in a row can
/// only be read as values in rows of any length, it is.
std::pair<PlyParser, ParsedSurface> parsed_ply(const std::string& name, std::string_view bytes,
                                               const std::string& attribute = "") {
  PlyParser parser(name, bytes, attribute);
  try {
    ParsedSurface surface = parser.parse();
    return {std::move(parser), std::move(surface)};
  } catch (const InputError&) {
    if (!parser.has_other_rows()) throw;
    try {
      PlyParser again(name, bytes, attribute, PlyRows::values);
      ParsedSurface surface = again.parse();
      return {std::move(again), std::move(surface)};
    } catch (const InputError&) {
    }
    throw;
  }
}

}  // namespace

ParsedSurface parse_ply(const std::string& name, std::string_view bytes) { return parsed_ply(name, bytes).second; }

bool ply_has_faces(const std::string& name, std::string_view bytes) { return PlyParser(name, bytes).has_faces(); }

std::vector<double> parse_ply_attribute(const std::string& name, std::string_view bytes, const std::string& attribute) {
  auto [parser, surface] = parsed_ply(name, bytes, attribute);
  const std::size_t num_vertices = surface.mesh.positions.size();
  std::vector<double> values = parser.take_attribute();
  if (values.size() != num_vertices) throw InputError(name + ": the vertices have no property " + in_quotes(attribute));
  return values;
}

}  // namespace subvol::internal

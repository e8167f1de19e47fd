// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/left_out.h"
#include "subvol/io/mesh_formats.h"
#include "subvol/mesh/features.h"
#include "subvol/mesh/mesh_topology.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <utility>

namespace subvol::internal {

namespace {

struct CellSection {
  const char* keyword;
  CellKind kind;
};
constexpr CellSection kCellSections[] = {{"Hexahedra", CellKind::hex},
                                         {"Prisms", CellKind::prism},
                                         {"Tetrahedra", CellKind::tet},
                                         {"Pyramids", CellKind::pyramid},
                                         {"Pentahedra", CellKind::prism}};  // an old name of Prisms, never written

/// Sections of faces, whose references are groups.
struct FaceSection {
  const char* keyword;
  std::size_t corners;
};
constexpr FaceSection kFaceSections[] = {{"Triangles", 3}, {"Quadrilaterals", 4}};

/// A section that says nothing about cells or features, and how many numbers each of its entries has.
struct SkippedSection {
  const char* keyword;
  std::size_t numbers_per_entry;
};
constexpr std::size_t kUntilKeyword = 0;  // files disagree on the length of an entry
constexpr SkippedSection kSkippedSections[] = {{"RequiredVertices", 1},
                                               {"RequiredEdges", 1},
                                               {"RequiredTriangles", 1},
                                               {"RequiredQuadrilaterals", 1},
                                               {"Normals", 3},
                                               {"NormalAtVertices", 2},
                                               {"NormalAtTriangleVertices", 3},
                                               {"NormalAtQuadrilateralVertices", 4},
                                               {"Tangents", 3},
                                               {"TangentAtVertices", 2},
                                               {"TangentAtEdges", 3},
                                               {"TangentAtEdgeVertices", 3},
                                               {"SubDomainFromMesh", kUntilKeyword},
                                               {"SubDomainFromGeom", kUntilKeyword}};
constexpr SkippedSection kSkippedValues[] = {{"AngleOfCornerBound", 1}, {"BoundingBox", 6}};

/// Prefixes of the comments that store finite sharpness; other readers skip them.
constexpr std::string_view kRidgeSharpness = "subvol:RidgeSharpness";
constexpr std::string_view kCornerSharpness = "subvol:CornerSharpness";
/// Prefixes of the comments that name references of faces and of cells.
constexpr std::string_view kFaceName = "subvol:FaceName";
constexpr std::string_view kCellName = "subvol:CellName";

/// A number in the file (from 1) that can only be checked once everything has been read.
struct Numbered {
  std::int64_t number;
  std::size_t line;
};
struct Sharpness {
  Numbered item;
  double value;
};

/// Sorts the groups by number, so that a file that is written again is the same.
void sort_by_number(VolumeFaceGroups& groups) {
  std::vector<Index> order(groups.groups.size()), place(order.size());
  std::iota(order.begin(), order.end(), Index{0});
  std::sort(order.begin(), order.end(),
            [&](Index a, Index b) { return groups.groups[a].number < groups.groups[b].number; });
  std::vector<Group> sorted;
  for (std::size_t i = 0; i < order.size(); ++i) {
    place[order[i]] = static_cast<Index>(i);
    sorted.push_back(std::move(groups.groups[order[i]]));
  }
  groups.groups = std::move(sorted);
  for (GroupedFace& entry : groups.faces) entry.group = place[entry.group];
  normalize(groups);
}

class MeditParser {
 public:
  MeditParser(const std::string& name, std::string_view bytes) : scan_(name, bytes) {
    scan_.on_comment = [this](std::string_view text) { read_comment(text); };
  }

  ParsedMesh parse() {
    read_header();
    while (const auto keyword = scan_.next()) {
      if (*keyword == "End") {
        ended_ = true;
        break;
      }
      read_section(*keyword);
    }
    if (!ended_) parsed_.warnings.push_back("the file has no End: it may have been cut short");
    if (!has_vertices_) scan_.fail("the file has no Vertices");
    check_cells();
    resolve_tags();
    resolve_groups();
    left_out_.tell(parsed_.warnings);
    return std::move(parsed_);
  }

 private:
  void read_header() {
    const auto first = scan_.next();
    if (!first) scan_.fail("the file is empty, expected MeshVersionFormatted");
    if (*first != "MeshVersionFormatted")
      scan_.fail("expected MeshVersionFormatted (Medit ASCII), found " + in_quotes(*first));
    const std::int64_t version = scan_.integer("the format version");
    if (version < 1 || version > 4) scan_.fail("format version " + std::to_string(version) + ", expected 1 to 4");
  }

  void read_section(std::string_view keyword) {
    const auto named = [&](const auto& section) { return keyword == section.keyword; };
    if (keyword == "Dimension") return read_dimension();
    if (keyword == "Vertices") return read_vertices();
    if (keyword == "Edges") return read_edges();
    if (keyword == "Ridges") return read_numbers(ridges_, "the number of Ridges", "an edge number");
    if (keyword == "Corners") return read_numbers(corners_, "the number of Corners", "a vertex number");
    if (const auto* s = std::find_if(std::begin(kCellSections), std::end(kCellSections), named);
        s != std::end(kCellSections))
      return read_cells(*s);
    if (const auto* s = std::find_if(std::begin(kFaceSections), std::end(kFaceSections), named);
        s != std::end(kFaceSections))
      return read_faces(*s);
    if (const auto* s = std::find_if(std::begin(kSkippedSections), std::end(kSkippedSections), named);
        s != std::end(kSkippedSections))
      return skip_section(*s);
    if (const auto* s = std::find_if(std::begin(kSkippedValues), std::end(kSkippedValues), named);
        s != std::end(kSkippedValues))
      return skip_numbers(s->numbers_per_entry);
    scan_.fail("expected a Medit keyword, found " + in_quotes(keyword) +
               (parse_number(keyword) ? " (more numbers than the section's count says?)" : ""));
  }

  void read_dimension() {
    const std::int64_t dimension = scan_.integer("the dimension");
    if (dimension != 3) scan_.fail("dimension " + std::to_string(dimension) + ", expected 3");
  }

  void skip_section(const SkippedSection& section) {
    const std::string keyword = section.keyword;
    const std::size_t n = scan_.count("the number of entries", section.numbers_per_entry);
    if (keyword.starts_with("Required")) left_out_.add(keyword, n);
    if (section.numbers_per_entry != kUntilKeyword) return skip_numbers(n * section.numbers_per_entry);
    for (auto word = scan_.peek(); word && parse_number(*word); word = scan_.peek()) scan_.next();
  }

  void skip_numbers(std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) scan_.number("a number");
  }

  void read_vertices() {
    if (has_vertices_) scan_.fail("a second section Vertices");
    has_vertices_ = true;
    const std::size_t n = scan_.count("the number of Vertices", 4);
    parsed_.mesh.positions.resize(n);
    std::size_t num_marked = 0;
    for (Vec3& position : parsed_.mesh.positions) {
      for (int i = 0; i < 3; ++i) position[i] = scan_.number("a coordinate");
      num_marked += scan_.integer("a vertex reference") != 0;
    }
    left_out_.add("references of Vertices", num_marked);
  }

  void read_cells(const CellSection& section) {
    const auto corners = static_cast<std::size_t>(cell_topology(section.kind).num_vertices);
    const std::size_t n = scan_.count((std::string("the number of ") + section.keyword).c_str(), corners + 1);
    std::array<Index, kMaxCellVertices> cell;
    for (std::size_t c = 0; c < n; ++c) {
      for (std::size_t i = 0; i < corners; ++i) cell[i] = read_vertex_number();
      parsed_.mesh.add_cell(section.kind, {cell.data(), corners});
      cell_lines_.push_back(scan_.word_line());
      parsed_.mesh.references.push_back(read_reference());
    }
  }

  /// Faces with a reference are in its group; the reference 0 means that a face is in none.
  void read_faces(const FaceSection& section) {
    const std::size_t n = scan_.count((std::string("the number of ") + section.keyword).c_str(), section.corners + 1);
    std::array<Index, 4> face;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = 0; k < section.corners; ++k) face[k] = read_vertex_number();
      const std::size_t line = scan_.word_line();
      const int reference = read_reference("a face reference");
      if (reference == 0) continue;
      parsed_.mesh.face_groups.faces.push_back(
          {face_key({face.data(), section.corners}), face_groups_.by_number(reference)});
      last_face_line_ = line;
    }
  }

  /// Reads a vertex number and returns it counted from 0. Before the section Vertices, the only check is that it fits.
  Index read_vertex_number() {
    const std::int64_t number = scan_.integer("a vertex number");
    check_number(number, has_vertices_ ? parsed_.mesh.num_vertices() : std::numeric_limits<Index>::max(), "vertex",
                 scan_.word_line());
    return static_cast<Index>(number - 1);
  }

  void check_number(std::int64_t number, std::size_t size, const char* what, std::size_t line) const {
    if (number < 1 || static_cast<std::uint64_t>(number) > size)
      scan_.fail(std::string(what) + " number " + std::to_string(number) + " is not in 1.." + std::to_string(size),
                 line);
  }

  int read_reference(const char* what = "a cell reference") {
    const std::int64_t reference = scan_.integer(what);
    if (reference < std::numeric_limits<int>::min() || reference > std::numeric_limits<int>::max())
      scan_.fail(std::string(what) + " beyond 32 bits: " + std::to_string(reference));
    return static_cast<int>(reference);
  }

  void read_edges() {
    const std::size_t n = scan_.count("the number of Edges", 3);
    for (std::size_t i = 0; i < n; ++i) {
      const Index v0 = read_vertex_number(), v1 = read_vertex_number();
      edges_.push_back({std::min(v0, v1), std::max(v0, v1)});
      left_out_.add("references of Edges", scan_.integer("an edge reference") != 0);
    }
  }

  void read_numbers(std::vector<Numbered>& numbers, const char* count_name, const char* what) {
    const std::size_t n = scan_.count(count_name, 1);
    for (std::size_t i = 0; i < n; ++i) {
      const std::int64_t number = scan_.integer(what);
      numbers.push_back({number, scan_.word_line()});
    }
  }

  void read_comment(std::string_view text) {
    for (const auto& [opening, names] : {std::pair(kFaceName, &face_names_), std::pair(kCellName, &cell_names_)})
      if (text.starts_with(opening)) names->push_back(read_name(opening, text.substr(opening.size())));
    for (const auto& [opening, list] :
         {std::pair(kRidgeSharpness, &ridge_sharpness_), std::pair(kCornerSharpness, &corner_sharpness_)}) {
      if (!text.starts_with(opening)) continue;
      TextScanner words("", text.substr(opening.size()));
      const auto number = words.next(), value = words.next();
      const auto n = number ? parse_integer(*number) : std::nullopt;
      const auto sharpness = value ? parse_number(*value) : std::nullopt;
      if (!n || !sharpness || !(*sharpness > 0) || words.next())
        scan_.fail("expected '#" + std::string(opening) + " NUMBER SHARPNESS' with a sharpness > 0");
      list->push_back({{*n, scan_.word_line()}, *sharpness});
    }
  }

  /// Reads "NUMBER NAME"; the name is the rest of the line.
  Group read_name(std::string_view opening, std::string_view text) const {
    constexpr std::string_view kMeditBlanks = " \t";
    const std::size_t begin = std::min(text.find_first_not_of(kMeditBlanks), text.size());
    const std::size_t end = std::min(text.find_first_of(kMeditBlanks, begin), text.size());
    const auto number = parse_integer(text.substr(begin, end - begin));
    const std::size_t name = text.find_first_not_of(kMeditBlanks, end);
    const bool fits =
        number && *number >= std::numeric_limits<int>::min() && *number <= std::numeric_limits<int>::max();
    if (!fits || name == text.npos) scan_.fail("expected '#" + std::string(opening) + " NUMBER NAME'");
    const std::size_t last = text.find_last_not_of(kMeditBlanks);
    return {std::string(text.substr(name, last + 1 - name)), static_cast<int>(*number), opening == kCellName ? 3 : 2};
  }

  void resolve_groups() {
    VolumeFaceGroups& groups = parsed_.mesh.face_groups;
    for (const GroupedFace& entry : groups.faces)
      for (const Index v : entry.face)
        if (v != kNoIndex) check_number(std::int64_t{v} + 1, parsed_.mesh.num_vertices(), "vertex", last_face_line_);
    std::vector<Index> places;
    for (const Group& named : face_names_) places.push_back(face_groups_.by_number(named.number));
    groups.groups = face_groups_.take();
    for (std::size_t i = 0; i < places.size(); ++i) groups.groups[places[i]].name = face_names_[i].name;
    sort_by_number(groups);
    parsed_.mesh.regions = std::move(cell_names_);
  }

  void check_cells() const {
    const VolumeMesh& mesh = parsed_.mesh;
    for (std::size_t c = 0; c < mesh.num_cells(); ++c)
      for (const Index v : mesh.cell(c))
        check_number(std::int64_t{v} + 1, mesh.num_vertices(), "vertex", cell_lines_[c]);
  }

  void resolve_tags() {
    FeatureTags& tags = parsed_.mesh.tags;
    std::vector<double> edge_sharpness(edges_.size(), kInfiniteSharpness);
    std::vector<double> corner_sharpness(parsed_.mesh.num_vertices(), kInfiniteSharpness);
    assign_sharpness(ridge_sharpness_, "edge", edge_sharpness);
    assign_sharpness(corner_sharpness_, "vertex", corner_sharpness);

    for (const auto& [number, line] : ridges_) {
      check_number(number, edges_.size(), "edge", line);
      const auto [v0, v1] = edges_[number - 1];
      check_number(std::int64_t{v1} + 1, parsed_.mesh.num_vertices(), "vertex", line);
      if (v0 == v1) scan_.fail("a ridge from a vertex to itself", line);
      tags.creases.push_back({v0, v1, edge_sharpness[number - 1]});
    }
    for (const auto& [number, line] : corners_) {
      check_number(number, parsed_.mesh.num_vertices(), "vertex", line);
      tags.corners.push_back({static_cast<Index>(number - 1), corner_sharpness[number - 1]});
    }
    tags = merge_tags(tags, {});
    if (std::all_of(parsed_.mesh.references.begin(), parsed_.mesh.references.end(), [](int r) { return r == 0; }))
      parsed_.mesh.references.clear();
  }

  void assign_sharpness(const std::vector<Sharpness>& given, const char* what, std::vector<double>& sharpness) const {
    for (const auto& [item, value] : given) {
      check_number(item.number, sharpness.size(), what, item.line);
      sharpness[item.number - 1] = value;
    }
  }

  TextScanner scan_;
  ParsedMesh parsed_;
  LeftOut left_out_;
  bool has_vertices_ = false, ended_ = false;
  std::vector<std::size_t> cell_lines_;
  std::vector<std::array<Index, 2>> edges_;
  std::vector<Numbered> ridges_, corners_;
  std::vector<Sharpness> ridge_sharpness_, corner_sharpness_;
  GroupList face_groups_;
  std::vector<Group> face_names_, cell_names_;
  std::size_t last_face_line_ = 0;
};

/// Appends a comment that names a group. Line ends in the name become blanks.
void append_name(std::string& text, std::string_view opening, const Group& group) {
  if (group.name.find_first_not_of(" \t\r\n") == group.name.npos) return;
  std::string name = group.name;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  text.append("#").append(opening).append(" ").append(std::to_string(group.number)).append(" ").append(name) += '\n';
}

void append_cells(std::string& text, const VolumeMesh& mesh, const CellSection& section) {
  const auto n = std::count(mesh.kinds.begin(), mesh.kinds.end(), section.kind);
  if (n == 0) return;
  text += std::string(section.keyword) + "\n" + std::to_string(n) + "\n";
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    if (mesh.kinds[c] != section.kind) continue;
    for (const Index v : mesh.cell(c)) text += std::to_string(v + 1) + " ";
    text += std::to_string(mesh.references.empty() ? 0 : mesh.references[c]) + "\n";
  }
}

/// Appends faces of the mesh with the number of their group as reference, and the names of groups as comments.
///
/// A group whose number is 0 would be read as none: it gets the lowest free number.
void append_face_groups(std::string& text, const VolumeMesh& mesh) {
  if (mesh.face_groups.empty()) return;
  const MeshTopology topology(mesh);
  std::vector<Group> groups = mesh.face_groups.groups;
  for (Group& group : groups)
    if (group.number == 0) group.number = free_number(groups);
  for (const FaceSection& section : kFaceSections) {
    std::string lines;
    std::size_t n = 0;
    for (std::size_t f = 0; f < topology.num_faces(); ++f) {
      const auto face = topology.face(static_cast<Index>(f));
      const Index group = face.size() == section.corners ? group_of(mesh.face_groups, face) : kNoIndex;
      if (group == kNoIndex) continue;
      for (const Index v : face) lines += std::to_string(v + 1) + " ";
      lines += std::to_string(groups[group].number) + "\n";
      ++n;
    }
    if (n > 0) text += std::string(section.keyword) + "\n" + std::to_string(n) + "\n" + lines;
  }
  for (const Group& group : groups) append_name(text, kFaceName, group);
}

void append_sharpness(std::string& text, std::string_view opening, std::size_t number, double sharpness) {
  if (sharpness >= kInfiniteSharpness) return;
  text.append("#").append(opening).append(" ").append(std::to_string(number)).append(" ");
  append_number(text, sharpness);
  text += '\n';
}

void append_tags(std::string& text, const FeatureTags& tags) {
  if (!tags.creases.empty()) {
    const std::size_t n = tags.creases.size();
    text += "Edges\n" + std::to_string(n) + "\n";
    for (const CreaseEdge& crease : tags.creases)
      text += std::to_string(crease.v0 + 1) + " " + std::to_string(crease.v1 + 1) + " 0\n";
    text += "Ridges\n" + std::to_string(n) + "\n";
    for (std::size_t i = 0; i < n; ++i) text += std::to_string(i + 1) + "\n";
    for (std::size_t i = 0; i < n; ++i) append_sharpness(text, kRidgeSharpness, i + 1, tags.creases[i].sharpness);
  }
  if (!tags.corners.empty()) {
    text += "Corners\n" + std::to_string(tags.corners.size()) + "\n";
    for (const CornerVertex& corner : tags.corners) text += std::to_string(corner.vertex + 1) + "\n";
    for (const CornerVertex& corner : tags.corners)
      append_sharpness(text, kCornerSharpness, static_cast<std::size_t>(corner.vertex) + 1, corner.sharpness);
  }
}

}  // namespace

ParsedMesh parse_medit(const std::string& name, std::string_view bytes, const std::string& references) {
  if (!references.empty())
    throw InputError(name + ": no cell data " + in_quotes(references) +
                     ": a .mesh has one reference for each cell, without a name");
  return MeditParser(name, bytes).parse();
}

std::string format_medit(const VolumeMesh& mesh) {
  std::string text = "MeshVersionFormatted 2\nDimension 3\nVertices\n" + std::to_string(mesh.num_vertices()) + "\n";
  for (const Vec3& position : mesh.positions) {
    for (int i = 0; i < 3; ++i) {
      append_number(text, position[i]);
      text += ' ';
    }
    text += "0\n";
  }
  for (const CellSection& section : std::span(kCellSections).first(kNumCellKinds)) append_cells(text, mesh, section);
  append_face_groups(text, mesh);
  for (const Group& region : mesh.regions) append_name(text, kCellName, region);
  append_tags(text, mesh.tags);
  return text + "End\n";
}

}  // namespace subvol::internal

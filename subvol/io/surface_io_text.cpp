// SPDX-License-Identifier: GPL-3.0-or-later
// OFF, OBJ and XYZ.
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/color_groups.h"
#include "subvol/io/left_out.h"
#include "subvol/io/surface_formats.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace subvol::internal {

namespace {

constexpr std::string_view kPlainOff = "OFF";
constexpr std::string_view kOtherOff[] = {"COFF", "NOFF", "CNOFF", "NCOFF", "STOFF", "STCOFF", "STNOFF", "STCNOFF"};

/// Counts of an OFF file. A third count, of edges, is not used; many files leave it out.
struct OffCounts {
  std::size_t vertices, faces;
};

OffCounts read_off_counts(TextScanner& scan) {
  // Both counts are checked before either list is read, so the bytes left bound both.
  const std::size_t vertices = scan.count("the number of vertices", 3);
  const std::size_t faces = scan.count("the number of faces", 2);
  const std::size_t line = scan.word_line();
  if (!scan.peek()) return {vertices, faces};
  const std::size_t next_line = scan.word_line();
  TextScanner ahead = scan;
  ahead.next();
  const bool is_alone = ahead.peek() && ahead.word_line() != next_line;  // as no vertex is
  if (next_line == line || is_alone) scan.integer("the number of edges");
  return {vertices, faces};
}

/// Returns the name of the color in the rest of a line of OFF: "#ff0000" for three or four numbers, whole ones up to
/// 255 or real ones up to 1, and "color 7" for a place in a color map. Returns an empty text if there is no color.
std::string color_in_rest_of_line(TextScanner& scan) {
  const auto rest = scan.line();
  if (!rest) return {};
  TextScanner words("", *rest);
  std::vector<double> numbers;
  bool is_real = false;
  while (const auto word = words.next()) {
    const auto number = parse_number(*word);
    if (!number) break;
    is_real = is_real || word->find('.') != word->npos;
    numbers.push_back(*number);
  }
  if (numbers.size() == 1) return "color " + std::to_string(static_cast<int>(std::clamp(numbers[0], 0.0, 1e9)));
  if (numbers.size() < 3) return {};
  std::array<double, 3> color;
  for (std::size_t i = 0; i < 3; ++i) color[i] = is_real ? 255 * numbers[i] : numbers[i];
  return color_name(color);
}

/// Skips the rest of the line; returns true if it held a word.
bool skip_rest_of_line(TextScanner& scan) {
  const auto rest = scan.line();
  return rest && TextScanner("", *rest).next().has_value();
}

/// Returns the groups that have faces, numbered anew from 1 in their order.
FaceGroups used_groups(const FaceGroups& all) {
  std::vector<Index> place(all.groups.size(), kNoIndex);
  for (const Index group : all.of_face)
    if (group != kNoIndex) place[group] = 0;
  FaceGroups used;
  for (std::size_t i = 0; i < place.size(); ++i) {
    if (place[i] == kNoIndex) continue;
    place[i] = static_cast<Index>(used.groups.size());
    used.groups.push_back({all.groups[i].name, place[i] + 1, 2});
  }
  for (const Index group : all.of_face) used.of_face.push_back(group == kNoIndex ? kNoIndex : place[group]);
  return used;
}

/// A keyword of OBJ that says nothing about polygons, and the name under which it counts as left out, if it does.
struct SkippedObj {
  std::string_view keyword;
  const char* missed = nullptr;
};
constexpr SkippedObj kSkippedObj[] = {{"vt", "texture coordinates"},
                                      {"vn"},
                                      {"vp"},
                                      {"s"},
                                      {"mg"},
                                      {"mtllib"},
                                      {"usemap", "uses of maps"},
                                      {"maplib"},
                                      {"l", "lines"},
                                      {"p", "points"},
                                      {"bevel"},
                                      {"c_interp"},
                                      {"d_interp"},
                                      {"lod"},
                                      {"shadow_obj"},
                                      {"trace_obj"}};

/// Keywords of OBJ's free-form curves and surfaces.
constexpr std::string_view kFreeFormObj[] = {"cstype", "deg",  "bmat", "step", "curv", "curv2", "surf",  "parm",
                                             "trim",   "hole", "scrv", "sp",   "end",  "con",   "ctech", "stech"};

/// The keywords of OBJ that name what the faces after them belong to, in order of preference.
struct ObjNaming {
  std::string_view keyword;
  const char* missed;       ///< what they are, for warnings
  std::size_t least_names;  ///< fewest names on faces for which they become groups
};
/// A lone object is the whole file; its name tells nothing apart.
constexpr std::array<ObjNaming, 3> kObjNamings{
    {{"g", "names of groups", 1}, {"usemtl", "uses of materials", 1}, {"o", "names of objects", 2}}};

/// Collects the names that one of these keywords gives to the faces of a file.
class FaceNames {
 public:
  /// name  of the faces that follow; empty: none.
  void begin(const std::string& name) {
    ++uses_;
    current_ = name.empty() ? kNoIndex : groups_.by_name(name);
  }
  void add_face() {
    of_face_.push_back(current_);
    if (current_ == kNoIndex) return;
    if (static_cast<std::size_t>(current_) >= is_used_.size()) is_used_.resize(groups_.groups().size(), 0);
    num_used_ += !is_used_[current_];
    is_used_[current_] = 1;
  }
  std::size_t uses() const { return uses_; }
  std::size_t num_used() const { return num_used_; }
  FaceGroups take() { return {groups_.take(), std::move(of_face_)}; }

 private:
  GroupList groups_;
  std::vector<Index> of_face_;
  std::vector<char> is_used_;
  Index current_ = kNoIndex;
  std::size_t uses_ = 0, num_used_ = 0;
};

class ObjParser {
 public:
  ObjParser(const std::string& name, std::string_view bytes) : name_(name), scan_(name, bytes) {}

  ParsedSurface parse() {
    while (auto line = scan_.line()) {
      line_ = scan_.word_line();
      std::string joined;
      while (line->ends_with('\\')) {  // a long line continues on the next
        joined.append(line->substr(0, line->size() - 1)).push_back(' ');
        line = scan_.line();
        if (!line) break;
      }
      if (line && !joined.empty()) joined.append(*line);
      parse_line(joined.empty() ? *line : std::string_view(joined));
      if (!line) break;
    }
    check_indices();
    choose_groups();
    ParsedSurface parsed{std::move(mesh_), {}};
    left_out_.tell(parsed.warnings);
    return parsed;
  }

 private:
  /// Groups are named by the first keyword that names at least two on faces; if none does, by the first that names one.
  void choose_groups() {
    std::size_t chosen = kObjNamings.size();
    for (const std::size_t least : {std::size_t{2}, std::size_t{1}})
      for (std::size_t i = 0; i < names_.size() && chosen == kObjNamings.size(); ++i)
        if (names_[i].num_used() >= std::max(least, kObjNamings[i].least_names)) chosen = i;
    for (std::size_t i = 0; i < names_.size(); ++i)
      if (i != chosen && names_[i].uses() >= kObjNamings[i].least_names)
        left_out_.add(kObjNamings[i].missed, names_[i].uses());
    if (chosen != kObjNamings.size()) mesh_.face_groups = used_groups(names_[chosen].take());
  }

  void parse_line(std::string_view line) {
    TextScanner words(name_, line);
    const auto keyword = words.next();
    if (!keyword) return;
    if (*keyword == "v") return parse_vertex(words);
    if (*keyword == "f" || *keyword == "fo") return parse_face(words);
    for (std::size_t i = 0; i < names_.size(); ++i)
      if (*keyword == kObjNamings[i].keyword) return names_[i].begin(rest_of(words));
    const auto* skipped = std::find_if(std::begin(kSkippedObj), std::end(kSkippedObj),
                                       [&](const SkippedObj& s) { return s.keyword == *keyword; });
    if (std::ranges::find(kFreeFormObj, *keyword) != std::end(kFreeFormObj))
      scan_.fail("free-form curves and surfaces (" + in_quotes(*keyword) + ") are not read; export polygons", line_);
    if (skipped == std::end(kSkippedObj)) scan_.fail("unknown OBJ keyword " + in_quotes(*keyword), line_);
    if (skipped->missed) left_out_.add(skipped->missed);
  }

  /// Returns the words that are left, with one blank between them.
  static std::string rest_of(TextScanner& words) {
    std::string text;
    while (const auto word = words.next()) text.append(text.empty() ? "" : " ").append(*word);
    return text;
  }

  void parse_vertex(TextScanner& words) {
    Vec3 position;
    for (int i = 0; i < 3; ++i) {
      const auto word = words.next();
      const auto value = word ? parse_number(*word) : std::nullopt;
      if (!value) scan_.fail("expected a coordinate (a finite number), found " + in_quotes(word.value_or("")), line_);
      position[i] = *value;
    }
    mesh_.positions.push_back(position);
    std::size_t more = 0;  // a single one is a weight
    while (words.next()) ++more;
    if (more >= 3) left_out_.add("colors of vertices");
  }

  void parse_face(TextScanner& words) {
    while (const auto word = words.next()) {
      const auto number = parse_integer(word->substr(0, word->find('/')));
      if (!number) scan_.fail("expected a vertex number, found " + in_quotes(*word), line_);
      const auto so_far = static_cast<std::int64_t>(mesh_.positions.size());
      const std::int64_t v = *number < 0 ? so_far + *number : *number - 1;
      if (*number == 0 || v < 0 || v >= std::numeric_limits<Index>::max())
        scan_.fail("vertex number " + std::to_string(*number) + " with " + std::to_string(so_far) +
                       " vertices so far; numbers start at 1, negative ones count back",
                   line_);
      mesh_.face_vertices.push_back(static_cast<Index>(v));
    }
    mesh_.face_offsets.push_back(mesh_.face_vertices.size());
    face_lines_.push_back(line_);
    for (FaceNames& names : names_) names.add_face();
  }

  // Vertices may come after the faces that name them.
  void check_indices() const {
    for (std::size_t f = 0; f < mesh_.num_faces(); ++f)
      for (std::size_t i = mesh_.face_offsets[f]; i < mesh_.face_offsets[f + 1]; ++i)
        if (static_cast<std::size_t>(mesh_.face_vertices[i]) >= mesh_.positions.size())
          scan_.fail("vertex number " + std::to_string(std::int64_t{mesh_.face_vertices[i]} + 1) + " of " +
                         std::to_string(mesh_.positions.size()) + " vertices",
                     face_lines_[f]);
  }

  std::string name_;
  TextScanner scan_;
  PolygonMesh mesh_;
  LeftOut left_out_;
  std::array<FaceNames, kObjNamings.size()> names_;  // of each of kObjNamings
  std::size_t line_ = 1;
  std::vector<std::size_t> face_lines_;
};

}  // namespace

namespace {

/// has_long_rows  true: rows of vertices hold more than the keyword says, which is passed over.
ParsedSurface parsed_off(const std::string& name, std::string_view bytes, bool has_long_rows) {
  TextScanner scan(name, bytes);
  const auto keyword = scan.next();
  if (!keyword) scan.fail("the file is empty, expected OFF");
  const bool plain = *keyword == kPlainOff;
  if (!plain && std::find(std::begin(kOtherOff), std::end(kOtherOff), *keyword) == std::end(kOtherOff)) {
    if (keyword->ends_with("4OFF") || keyword->ends_with("nOFF"))
      scan.fail("vertices of another dimension (" + in_quotes(*keyword) + "), expected OFF with three coordinates");
    scan.fail("expected OFF (or COFF, NOFF, CNOFF, STOFF) as a word of its own, found " + in_quotes(*keyword));
  }
  if (scan.peek() == std::optional<std::string_view>("BINARY")) scan.fail("binary OFF cannot be read; save it as text");
  const auto [num_vertices, num_faces] = read_off_counts(scan);

  PolygonMesh mesh;
  LeftOut left_out;
  ColorGroups colors;
  if (keyword->find('C') != std::string_view::npos) left_out.add("colors of vertices", num_vertices);
  if (keyword->find("ST") != std::string_view::npos) left_out.add("texture coordinates", num_vertices);
  if (plain && has_long_rows) left_out.add("values behind the coordinates of vertices", num_vertices);
  mesh.positions.resize(num_vertices);
  for (Vec3& position : mesh.positions) {
    for (int i = 0; i < 3; ++i) position[i] = scan.number("a coordinate");
    if (!plain || has_long_rows) skip_rest_of_line(scan);  // normals, colors, texture coordinates
  }
  for (std::size_t f = 0; f < num_faces; ++f) {
    const std::size_t corners = scan.count("the number of corners of a face", 1);
    for (std::size_t i = 0; i < corners; ++i) {
      const std::int64_t v = scan.integer("a vertex number");
      if (v < 0 || static_cast<std::uint64_t>(v) >= num_vertices)
        scan.fail("vertex number " + std::to_string(v) + " with " + std::to_string(num_vertices) +
                  " vertices; numbers start at 0");
      mesh.face_vertices.push_back(static_cast<Index>(v));
    }
    mesh.face_offsets.push_back(mesh.face_vertices.size());
    colors.add_face(color_in_rest_of_line(scan));
  }
  mesh.face_groups = colors.take(left_out, "colors of faces");
  if (const auto more = scan.next()) scan.fail("more than the counts say: " + in_quotes(*more));
  ParsedSurface parsed{std::move(mesh), {}};
  left_out.tell(parsed.warnings);
  return parsed;
}

}  // namespace

ParsedSurface parse_off(const std::string& name, std::string_view bytes) {
  try {
    return parsed_off(name, bytes, false);
  } catch (const InputError&) {
    try {
      return parsed_off(name, bytes, true);
    } catch (const InputError&) {
    }
    throw;
  }
}

ParsedSurface parse_obj(const std::string& name, std::string_view bytes) { return ObjParser(name, bytes).parse(); }

std::vector<Vec3> parse_xyz(const std::string& name, std::string_view bytes, std::size_t& longer_lines) {
  TextScanner scan(name, bytes);
  std::vector<Vec3> points;
  longer_lines = 0;
  while (const auto line = scan.line()) {
    TextScanner words(name, *line);
    if (!words.peek()) continue;  // blank, or a comment
    Vec3& point = points.emplace_back();
    for (int i = 0; i < 3; ++i) {
      const auto word = words.next();
      const auto value = word ? parse_number(*word) : std::nullopt;
      if (!value)
        scan.fail("expected three coordinates (finite numbers) to a line, found " + in_quotes(word.value_or("")) +
                  " as number " + std::to_string(i + 1));
      point[i] = *value;
    }
    longer_lines += words.next().has_value();
  }
  return points;
}

}  // namespace subvol::internal

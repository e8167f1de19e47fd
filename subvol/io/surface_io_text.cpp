// SPDX-License-Identifier: GPL-3.0-or-later
// OFF, OBJ and XYZ.
#include "subvol/base/text_scanner.h"
#include "subvol/io/left_out.h"
#include "subvol/io/surface_formats.h"

#include <algorithm>
#include <limits>

namespace subvol {

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
  const auto edges = scan.peek();
  if (edges && scan.word_line() == line) scan.integer("the number of edges");
  return {vertices, faces};
}

/// Skips the rest of the line; returns true if it held a word.
bool skip_rest_of_line(TextScanner& scan) {
  const auto rest = scan.line();
  return rest && TextScanner("", *rest).next().has_value();
}

/// A keyword of OBJ that says nothing about polygons, and the name under which it counts as left out, if it does.
struct SkippedObj {
  std::string_view keyword;
  const char* missed = nullptr;
};
constexpr SkippedObj kSkippedObj[] = {{"vt", "texture coordinates"},
                                      {"vn"},
                                      {"vp"},
                                      {"g", "names of groups"},
                                      {"o", "names of objects"},
                                      {"s"},
                                      {"mg"},
                                      {"usemtl", "uses of materials"},
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
    ParsedSurface parsed{std::move(mesh_), {}};
    left_out_.tell(parsed.warnings);
    return parsed;
  }

 private:
  void parse_line(std::string_view line) {
    TextScanner words(name_, line);
    const auto keyword = words.next();
    if (!keyword) return;
    if (*keyword == "v") return parse_vertex(words);
    if (*keyword == "f" || *keyword == "fo") return parse_face(words);
    const auto* skipped = std::find_if(std::begin(kSkippedObj), std::end(kSkippedObj),
                                       [&](const SkippedObj& s) { return s.keyword == *keyword; });
    if (skipped == std::end(kSkippedObj)) scan_.fail("unknown OBJ keyword " + in_quotes(*keyword), line_);
    if (skipped->missed) left_out_.add(skipped->missed);
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
    if (more >= 3) left_out_.add("colours of vertices");
  }

  void parse_face(TextScanner& words) {
    while (const auto word = words.next()) {
      const auto number = parse_integer(word->substr(0, word->find('/')));
      if (!number) scan_.fail("expected a vertex number, found " + in_quotes(*word), line_);
      const auto so_far = static_cast<std::int64_t>(mesh_.positions.size());
      const std::int64_t v = *number < 0 ? so_far + *number : *number - 1;
      if (*number == 0 || v < 0 || v >= std::numeric_limits<Index>::max())
        scan_.fail("vertex number " + std::to_string(*number) + " with " + std::to_string(so_far) +
                       " vertices so far; numbers start at 1, negative ones count back", line_);
      mesh_.face_vertices.push_back(static_cast<Index>(v));
    }
    mesh_.face_offsets.push_back(mesh_.face_vertices.size());
    face_lines_.push_back(line_);
  }

  // Vertices may come after the faces that name them.
  void check_indices() const {
    for (std::size_t f = 0; f < mesh_.num_faces(); ++f)
      for (std::size_t i = mesh_.face_offsets[f]; i < mesh_.face_offsets[f + 1]; ++i)
        if (static_cast<std::size_t>(mesh_.face_vertices[i]) >= mesh_.positions.size())
          scan_.fail("vertex number " + std::to_string(std::int64_t{mesh_.face_vertices[i]} + 1) + " of " +
                         std::to_string(mesh_.positions.size()) + " vertices", face_lines_[f]);
  }

  std::string name_;
  TextScanner scan_;
  PolygonMesh mesh_;
  LeftOut left_out_;
  std::size_t line_ = 1;
  std::vector<std::size_t> face_lines_;
};

}  // namespace

ParsedSurface parse_off(const std::string& name, std::string_view bytes) {
  TextScanner scan(name, bytes);
  const auto keyword = scan.next();
  if (!keyword) scan.fail("the file is empty, expected OFF");
  const bool plain = *keyword == kPlainOff;
  if (!plain && std::find(std::begin(kOtherOff), std::end(kOtherOff), *keyword) == std::end(kOtherOff))
    scan.fail("expected OFF (or COFF, NOFF, CNOFF, STOFF), found " + in_quotes(*keyword));
  if (scan.peek() == std::optional<std::string_view>("BINARY")) scan.fail("binary OFF cannot be read; save it as text");
  const auto [num_vertices, num_faces] = read_off_counts(scan);

  PolygonMesh mesh;
  LeftOut left_out;
  if (keyword->find('C') != std::string_view::npos) left_out.add("colours of vertices", num_vertices);
  if (keyword->find("ST") != std::string_view::npos) left_out.add("texture coordinates", num_vertices);
  mesh.positions.resize(num_vertices);
  for (Vec3& position : mesh.positions) {
    for (int i = 0; i < 3; ++i) position[i] = scan.number("a coordinate");
    if (!plain) skip_rest_of_line(scan);  // normals, colors, texture coordinates
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
    if (skip_rest_of_line(scan)) left_out.add("colours of faces");
  }
  if (const auto more = scan.next()) scan.fail("more than the counts say: " + in_quotes(*more));
  ParsedSurface parsed{std::move(mesh), {}};
  left_out.tell(parsed.warnings);
  return parsed;
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

}  // namespace subvol

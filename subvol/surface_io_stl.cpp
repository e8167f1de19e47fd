// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/binary_value.h"
#include "subvol/error.h"
#include "subvol/surface_formats.h"
#include "subvol/text_scanner.h"

#include <cmath>
#include <map>

namespace subvol {

namespace {

constexpr std::size_t kHeaderBytes = 84;    // 80 bytes of anything, then the number of facets
constexpr std::size_t kFacetBytes = 50;     // normal, three vertices, two bytes of attributes
constexpr std::size_t kFirstVertexByte = 12;

/// STL repeats a vertex in every facet: equal positions become one vertex.
class Welder {
 public:
  void add(const Vec3& position) {
    // + 0.0 makes one zero of the two.
    const std::array<double, 3> key = {position[0] + 0.0, position[1] + 0.0, position[2] + 0.0};
    const auto [it, is_new] = vertices_.try_emplace(key, static_cast<Index>(mesh_.positions.size()));
    if (is_new) mesh_.positions.push_back(position);
    mesh_.face_vertices.push_back(it->second);
    if (mesh_.face_vertices.size() % 3 == 0) mesh_.face_offsets.push_back(mesh_.face_vertices.size());
  }
  PolygonMesh take() { return std::move(mesh_); }

 private:
  std::map<std::array<double, 3>, Index> vertices_;
  PolygonMesh mesh_;
};

std::size_t num_binary_facets(std::string_view bytes) {
  return static_cast<std::size_t>(decode(bytes.data() + kHeaderBytes - 4, kUInt32, std::endian::little));
}

/// Text may have blanks and a byte order mark first, and capitals.
bool begins_as_text(std::string_view bytes) {
  const auto word = TextScanner("", bytes.substr(0, kHeaderBytes), TextScanner::Comments::none).next();
  return bytes.starts_with("solid") || (word && lower_case(*word) == "solid");
}

/// Binary files too may begin with "solid": what tells is whether the size is that of the facets announced.
bool is_binary(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes) return false;
  return !begins_as_text(bytes) || bytes.size() == kHeaderBytes + kFacetBytes * num_binary_facets(bytes);
}

PolygonMesh parse_binary(const std::string& name, std::string_view bytes) {
  const std::size_t n = num_binary_facets(bytes);
  if (n > (bytes.size() - kHeaderBytes) / kFacetBytes)
    throw InputError(name + ": byte 80: " + std::to_string(n) + " facets, more than the file can hold");
  Welder welder;
  for (std::size_t f = 0; f < n; ++f) {
    const std::size_t facet = kHeaderBytes + f * kFacetBytes;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t vertex = facet + kFirstVertexByte * (i + 1);
      Vec3 position;
      for (int j = 0; j < 3; ++j) position[j] = decode(bytes.data() + vertex + 4 * j, kFloat32, std::endian::little);
      if (!position.allFinite())
        throw InputError(name + ": byte " + std::to_string(vertex) + ": facet " + std::to_string(f) +
                         " has a coordinate that is not finite");
      welder.add(position);
    }
  }
  return welder.take();
}

void expect(TextScanner& scan, const char* word) {
  const std::string_view found = scan.word(word);
  if (lower_case(found) != word) scan.fail(std::string("expected ") + word + ", found " + in_quotes(found));
}

void parse_facet(TextScanner& scan, Welder& welder) {
  expect(scan, "normal");
  for (int i = 0; i < 3; ++i) scan.word("a normal");  // not used, and often nan
  expect(scan, "outer");
  expect(scan, "loop");
  for (int i = 0; i < 3; ++i) {
    expect(scan, "vertex");
    Vec3 position;
    for (int j = 0; j < 3; ++j) position[j] = scan.number("a coordinate");
    welder.add(position);
  }
  expect(scan, "endloop");
  expect(scan, "endfacet");
}

PolygonMesh parse_text(const std::string& name, std::string_view bytes) {
  TextScanner scan(name, bytes, TextScanner::Comments::none);
  Welder welder;
  bool in_solid = false;
  while (const auto word = scan.next()) {
    const std::string keyword = lower_case(*word);
    if (keyword == "facet" && in_solid) {
      parse_facet(scan, welder);
    } else if (keyword == (in_solid ? "endsolid" : "solid")) {
      in_solid = !in_solid;
      scan.line();  // the solid's name
    } else {
      scan.fail(std::string("expected ") + (in_solid ? "facet or endsolid" : "solid") + ", found " + in_quotes(*word));
    }
  }
  if (in_solid) scan.fail("the file ends where facet or endsolid is expected");
  return welder.take();
}

}  // namespace

PolygonMesh parse_stl(const std::string& name, std::string_view bytes) {
  return is_binary(bytes) ? parse_binary(name, bytes) : parse_text(name, bytes);
}

}  // namespace subvol

// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/binary_value.h"
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/left_out.h"
#include "subvol/io/surface_formats.h"
#include "subvol/io/triangle_welder.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace subvol::internal {

namespace {

constexpr std::size_t kHeaderBytes = 84;  // 80 arbitrary bytes, then the number of facets
constexpr std::size_t kFacetBytes = 50;   // normal, three vertices, number of attribute bytes that follow (two bytes)
constexpr std::size_t kFirstVertexByte = 12;
constexpr std::size_t kAttributeCountByte = 48;

std::size_t num_binary_facets(std::string_view bytes) {
  return static_cast<std::size_t>(decode(bytes.data() + kHeaderBytes - 4, kUInt32, std::endian::little));
}

bool has_room_for_facets(std::string_view bytes) {
  return num_binary_facets(bytes) <= (bytes.size() - kHeaderBytes) / kFacetBytes;
}

/// Returns true if the file is binary, even if its header begins like text: it has room for its number of facets (four
/// bytes of text would mean more than 150 million), or its first bytes contain a control character below tab, which
/// text does not have.
bool is_binary(std::string_view bytes) {
  const auto is_no_text = [](unsigned char c) { return c < '\t'; };
  if (bytes.size() < kHeaderBytes) return false;
  const std::string_view first = bytes.substr(0, kHeaderBytes + kFacetBytes);
  return has_room_for_facets(bytes) || std::any_of(first.begin(), first.end(), is_no_text);
}

/// Places of the facets, and the end of the last one, in bytes.
struct BinaryFacets {
  std::vector<std::size_t> begins;
  std::size_t end;
};

/// Finds the facets, each followed by as many bytes of attributes as it says. Returns nothing if one runs past the end
/// of the file.
std::optional<BinaryFacets> facets_with_attributes(std::string_view bytes) {
  BinaryFacets facets{{}, kHeaderBytes};
  for (std::size_t f = 0, n = num_binary_facets(bytes); f < n; ++f) {
    if (facets.end > bytes.size() || bytes.size() - facets.end < kFacetBytes) return std::nullopt;
    facets.begins.push_back(facets.end);
    const double more = decode(bytes.data() + facets.end + kAttributeCountByte, kUInt16, std::endian::little);
    facets.end += kFacetBytes + static_cast<std::size_t>(more);
  }
  if (facets.end > bytes.size()) return std::nullopt;
  return facets;
}

/// Finds the facets. Many programs store a color as the number of attribute bytes: the facets alone then fill the file.
BinaryFacets binary_facets(const std::string& name, std::string_view bytes, std::vector<std::string>& warnings) {
  const std::size_t n = num_binary_facets(bytes), plain_end = kHeaderBytes + kFacetBytes * n;
  if (!has_room_for_facets(bytes))
    throw InputError(name + ": byte 80: " + std::to_string(n) + " facets, more than the file can hold");
  if (bytes.size() == plain_end) {
    BinaryFacets facets{std::vector<std::size_t>(n), plain_end};
    for (std::size_t f = 0; f < n; ++f) facets.begins[f] = kHeaderBytes + f * kFacetBytes;
    return facets;
  }
  auto facets = facets_with_attributes(bytes);
  if (!facets || (facets->end != bytes.size() && facets->end != plain_end))
    throw InputError(name + ": byte " + std::to_string(plain_end) + ": the " + std::to_string(n) +
                     " facets end here without their attributes" +
                     (facets ? ", and at byte " + std::to_string(facets->end) + " with them" : "") +
                     ", but the file has " + std::to_string(bytes.size()) + " bytes");
  if (facets->end != bytes.size())  // no facet has attributes, so it is certain where the facets are
    warnings.push_back(std::to_string(bytes.size() - plain_end) + " bytes after the last facet are passed over");
  return std::move(*facets);
}

PolygonMesh parse_binary(const std::string& name, std::string_view bytes, std::vector<std::string>& warnings) {
  const BinaryFacets facets = binary_facets(name, bytes, warnings);
  TriangleWelder welder;
  LeftOut left_out;
  for (std::size_t f = 0; f < facets.begins.size(); ++f) {
    const std::size_t facet = facets.begins[f];
    if (decode(bytes.data() + facet + kAttributeCountByte, kUInt16, std::endian::little) != 0)
      left_out.add("facets' attributes");
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
  left_out.tell(warnings);
  return welder.take();
}

void expect(TextScanner& scan, const char* word) {
  const std::string_view found = scan.word(word);
  if (lower_case(found) != word) scan.fail(std::string("expected ") + word + ", found " + in_quotes(found));
}

void parse_facet(TextScanner& scan, TriangleWelder& welder) {
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

/// Each solid is a group; a single solid, whose name often only names the program that wrote it, is none.
PolygonMesh parse_text(const std::string& name, std::string_view bytes) {
  TextScanner scan(name, bytes, TextScanner::Comments::none);
  TriangleWelder welder;
  GroupList groups;
  int num_solids = 0;
  Index group = kNoIndex;
  bool in_solid = false;
  while (const auto word = scan.next()) {
    const std::string keyword = lower_case(*word);
    if (keyword == "facet" && in_solid) {
      parse_facet(scan, welder);
      welder.set_group(group);
    } else if (keyword == (in_solid ? "endsolid" : "solid")) {
      in_solid = !in_solid;
      num_solids += in_solid;
      const std::string of_solid = trimmed(scan.line().value_or(""));
      if (in_solid) group = groups.by_name(of_solid.empty() ? "solid " + std::to_string(num_solids) : of_solid);
    } else if (word->data() == bytes.data() && !in_solid) {
      scan.fail("expected solid, as STL in text begins, or the 84 bytes and the facets of a binary file, found " +
                in_quotes(*word));
    } else {
      scan.fail(std::string("expected ") + (in_solid ? "facet or endsolid" : "solid") + ", found " + in_quotes(*word));
    }
  }
  if (in_solid && welder.is_empty())
    scan.fail("the file ends after " + std::to_string(bytes.size()) + " bytes without a facet, in text or in binary");
  if (in_solid) scan.fail("the file ends where facet or endsolid is expected");
  groups.groups().size() > 1 ? welder.name_groups(groups.take()) : welder.drop_groups();
  return welder.take();
}

}  // namespace

ParsedSurface parse_stl(const std::string& name, std::string_view bytes) {
  ParsedSurface parsed;
  if (is_binary(bytes) && !has_room_for_facets(bytes)) require_no_utf16(name, bytes);
  parsed.mesh = is_binary(bytes) ? parse_binary(name, bytes, parsed.warnings) : parse_text(name, bytes);
  return parsed;
}

}  // namespace subvol::internal

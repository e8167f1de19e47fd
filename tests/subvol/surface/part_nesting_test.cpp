// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/part_nesting.h"

#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

using namespace subvol;
using namespace subvol::internal;

namespace {

/// Parts of a surface, one after the other.
struct Collection {
  TriangleMesh mesh;
  std::vector<int> part;
  int count = 0;

  void add(const TriangleMesh& one, double size, const Vec3& center, bool inward = false) {
    const auto first = static_cast<Index>(mesh.positions.size());
    for (const Vec3& x : one.positions) mesh.positions.push_back(center + size * x);
    for (auto t : one.triangles) {
      if (inward) std::swap(t[1], t[2]);
      mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
      part.push_back(count);
    }
    ++count;
  }
  PartNesting nesting() const { return part_nesting(mesh, part, count); }
};

TriangleMesh without_a_triangle(TriangleMesh mesh) {
  mesh.triangles.pop_back();
  return mesh;
}

}  // namespace

TEST_CASE("the depth of a part is the number of parts around it", "[surface][quick]") {
  const TriangleMesh ball = test::cube_surface(4, true);
  for (const int shells : {5, 150}) {  // so many that a point asks for each of them, and for all together
    CAPTURE(shells);
    Collection parts;
    for (int i = 0; i < shells; ++i) parts.add(ball, 1 + 0.1 * i, Vec3::Zero(), i % 3 == 0);
    parts.add(ball, 0.2, Vec3(0.4, 0, 0));
    parts.add(ball, 0.2, Vec3(100, 0, 0));
    const PartNesting nesting = parts.nesting();
    for (int i = 0; i < shells; ++i) CHECK(nesting.depths[i] == shells - 1 - i);
    CHECK(nesting.depths[shells] == shells);
    CHECK(nesting.depths[shells + 1] == 0);
  }
}

TEST_CASE("parts that are open have an inside, too, if their holes are small", "[surface][quick]") {
  const TriangleMesh ball = test::cube_surface(6, true), open = without_a_triangle(ball);
  Collection parts;
  parts.add(open, 2, Vec3::Zero());
  parts.add(open, 1, Vec3::Zero());
  parts.add(ball, 0.5, Vec3::Zero());
  parts.add(ball, 0.5, Vec3(5, 0, 0));
  CHECK(parts.nesting().depths == std::vector<int>{0, 1, 2, 0});
}

TEST_CASE("a part in the corner of another one's box does not lie in it", "[surface][quick]") {
  const TriangleMesh ball = test::cube_surface(6, true);
  Collection parts;
  parts.add(ball, 1, Vec3::Zero());
  parts.add(ball, 0.1, Vec3(0.85, 0.85, 0.85));
  parts.add(ball, 0.3, Vec3(0.7, 0.7, 0));  // crosses the first one
  CHECK(parts.nesting().depths == std::vector<int>{0, 0, 0});
}

TEST_CASE("a search for nested parts ends when it is cancelled", "[surface][quick]") {
  Collection parts;
  for (int i = 0; i < 9; ++i) parts.add(test::cube_surface(2, true), 9 - i, Vec3::Zero());
  int calls = 0;
  const PartNesting nesting = part_nesting(parts.mesh, parts.part, parts.count, [&] { return ++calls == 4; });
  CHECK(calls == 4);
  CHECK(nesting.volumes.size() == 9);
  CHECK(std::count(nesting.depths.begin(), nesting.depths.end(), 0) == 6);
}

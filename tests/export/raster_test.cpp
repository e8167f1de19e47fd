// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/raster.h"

#include "subvol/base/error.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

using namespace subvol;

namespace {

constexpr LinearColor kRed{1, 0, 0, 1}, kGreen{0, 1, 0, 1};

/// A square of half the picture's width, at a height, of one color.
void add_square(RasterSurface& surface, double half, double z, const LinearColor& color) {
  const auto first = static_cast<Index>(surface.mesh.positions.size());
  for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
    surface.mesh.positions.emplace_back(half * x, half * y, z);
    surface.colors.push_back(color);
  }
  surface.mesh.triangles.push_back({first, first + 1, first + 2});
  surface.mesh.triangles.push_back({first, first + 2, first + 3});
}

std::array<int, 4> pixel(const Image& image, int x, int y) {
  const std::uint8_t* p = &image.pixels[4 * (static_cast<std::size_t>(y) * image.width + x)];
  return {p[0], p[1], p[2], p[3]};
}

}  // namespace

TEST_CASE("A square covers the pixels that it should, and nothing else", "[raster]") {
  RasterSurface surface;
  add_square(surface, 0.5, 0, kRed);
  const Image image = rasterize(surface, {}, 40, 40);
  REQUIRE(image.pixels.size() == 4 * 40 * 40);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 40; ++x) {
      const bool inside = x >= 10 && x < 30 && y >= 10 && y < 30;
      const auto p = pixel(image, x, y);
      REQUIRE(p[3] == (inside ? 255 : 0));
      REQUIRE(p[1] == 0);
      REQUIRE((p[0] > 200) == inside);
    }
}

TEST_CASE("What is nearer hides what is behind, whatever the order", "[raster]") {
  for (const double z : {-0.5, 0.5}) {
    RasterSurface surface;
    add_square(surface, 0.8, 0, kRed);
    add_square(surface, 0.4, z, kGreen);
    const auto p = pixel(rasterize(surface, {}, 21, 21), 10, 10);
    CHECK((p[1] > 100) == (z > 0));
    CHECK((p[0] > 100) == (z < 0));
    const auto q = pixel(rasterize(surface, {.towards_viewer = Vec3(0, 0, -1)}, 21, 21), 10, 10);
    CHECK((q[1] > 100) == (z < 0));
  }
}

TEST_CASE("Edges are drawn where they are in sight", "[raster]") {
  RasterSurface surface;
  add_square(surface, 0.8, 0, kRed);
  const auto plain = pixel(rasterize(surface, {}, 41, 41), 20, 20);
  surface.wires = {{0, 2}};
  const auto lined = pixel(rasterize(surface, {}, 41, 41), 20, 20);
  CHECK(lined[0] < plain[0]);
  add_square(surface, 0.9, 0.5, kRed);
  CHECK(pixel(rasterize(surface, {}, 41, 41), 20, 20) == plain);
}

TEST_CASE("A view shows all of a mesh", "[raster]") {
  const std::vector<Vec3> corners = {{5, 1, 1}, {9, 1, 1}, {5, 3, 1}, {9, 3, 2}};
  const RasterView view = view_of(corners);
  for (const Vec3& p : corners) CHECK((p - view.center).norm() <= view.radius * (1 + 1e-12));
  CHECK(view_of({}).radius == 1);
  CHECK(view_of(std::vector<Vec3>(3, Vec3(1, 1, 1))).radius == 1);
}

TEST_CASE("Odd surfaces are drawn as far as they go, and odd pictures refused", "[raster]") {
  RasterSurface surface;
  add_square(surface, 0.5, 0, kRed);
  surface.mesh.positions.emplace_back(std::numeric_limits<double>::quiet_NaN(), 0, 0);
  surface.mesh.positions.emplace_back(1e300, 0, 0);
  surface.colors.resize(6, kGreen);
  surface.mesh.triangles.push_back({0, 1, 4});
  surface.mesh.triangles.push_back({0, 0, 1});
  surface.mesh.triangles.push_back({0, 1, 5});
  surface.wires = {{0, 4}, {0, 5}};
  CHECK(pixel(rasterize(surface, {}, 10, 10), 5, 5)[3] == 255);
  CHECK(rasterize({}, {}, 3, 2).pixels == std::vector<std::uint8_t>(24, 0));
  CHECK_THROWS_AS(rasterize(surface, {}, 0, 10), InputError);
  CHECK_THROWS_AS(rasterize(surface, {}, 10, 10000), InputError);
  CHECK_THROWS_AS(rasterize(surface, {.towards_viewer = Vec3(0, 2, 0)}, 10, 10), InputError);
  CHECK_THROWS_AS(rasterize(surface, {.towards_viewer = Vec3(0, 0, 0)}, 10, 10), InputError);
  surface.colors.pop_back();
  CHECK_THROWS_AS(rasterize(surface, {}, 10, 10), InputError);
}

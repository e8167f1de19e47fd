// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/raster.h"

#include "subvol/base/error.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace subvol {
namespace {

constexpr int kPixelSideSamples = 2;  ///< per pixel, in each direction
constexpr LinearColor kGray{0.35, 0.40, 0.45, 1};
constexpr double kAmbient = 0.3;     // share of the light that comes from everywhere
constexpr double kWireShade = 0.35;  ///< factor on the surface's color

double srgb(double linear) {
  const double x = std::clamp(linear, 0.0, 1.0);
  return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
}

/// Color and depth of every sample.
class Canvas {
 public:
  Canvas(const RasterView& view, int width, int height)
      : width_(width * kPixelSideSamples),
        height_(height * kPixelSideSamples),
        scale_(std::min(width_, height_) / (2 * view.radius)),
        center_(view.center),
        depths_(static_cast<std::size_t>(width_) * height_, -std::numeric_limits<double>::infinity()),
        colors_(depths_.size(), Vec3::Zero()),
        wired_(depths_.size()) {
    axes_.row(2) = view.towards_viewer.normalized();
    axes_.row(0) = view.up.cross(view.towards_viewer).normalized();
    axes_.row(1) = axes_.row(2).cross(axes_.row(0));
    if (!axes_.allFinite() || axes_.row(0).norm() < 0.5)
      throw InputError("rasterize: expected a view with a direction and an up that is not parallel to it");
  }

  /// Sample coordinates, x to the right and y down, and depth, which grows toward the viewer.
  Vec3 project(const Vec3& p) const {
    const Vec3 q = scale_ * (axes_ * (p - center_));
    return {0.5 * width_ + q[0], 0.5 * height_ - q[1], q[2]};
  }

  double shade(const Vec3& normal) const {
    const Vec3 light(-0.3, 0.45, 0.84);
    const Vec3 n = axes_ * normal;
    return kAmbient + (1 - kAmbient) * std::max(0.0, (n[2] < 0 ? Vec3(-n) : n).dot(light));
  }

  void draw_triangle(const std::array<Vec3, 3>& p, const std::array<Vec3, 3>& color) {
    constexpr double kTriangleEdgeTolerance = 1e-9;  // samples on an edge belong to both triangles; otherwise rounding
                                                     // could leave them to neither
    const double area = (p[1] - p[0]).head<2>().x() * (p[2] - p[0]).y() - (p[1] - p[0]).y() * (p[2] - p[0]).x();
    if (!(std::abs(area) > 0) || !std::isfinite(area)) return;
    const auto range = [](double low, double high, int limit) {
      return std::pair{static_cast<int>(std::clamp(std::ceil(low - 0.5), 0.0, double(limit))),
                       static_cast<int>(std::clamp(std::floor(high - 0.5), -1.0, double(limit - 1)))};
    };
    const auto [left, right] =
        range(std::min({p[0].x(), p[1].x(), p[2].x()}), std::max({p[0].x(), p[1].x(), p[2].x()}), width_);
    const auto [top, bottom] =
        range(std::min({p[0].y(), p[1].y(), p[2].y()}), std::max({p[0].y(), p[1].y(), p[2].y()}), height_);
    for (int y = top; y <= bottom; ++y)
      for (int x = left; x <= right; ++x) {
        const double dx = x + 0.5 - p[0].x(), dy = y + 0.5 - p[0].y();
        const double s = (dx * (p[2] - p[0]).y() - dy * (p[2] - p[0]).x()) / area;
        const double t = (dy * (p[1] - p[0]).x() - dx * (p[1] - p[0]).y()) / area;
        if (s < -kTriangleEdgeTolerance || t < -kTriangleEdgeTolerance || s + t > 1 + kTriangleEdgeTolerance) continue;
        put(x, y, (1 - s - t) * p[0].z() + s * p[1].z() + t * p[2].z(),
            (1 - s - t) * color[0] + s * color[1] + t * color[2]);
      }
  }

  /// Darkens the visible samples on a line, which lies slightly in front of its surface.
  void draw_line(const Vec3& a, const Vec3& b) {
    constexpr double kInFront = 2;  // samples
    const double steps = std::ceil(std::max(std::abs(b.x() - a.x()), std::abs(b.y() - a.y())));
    if (!(steps < 4.0 * (width_ + height_))) return;
    for (int k = 0; k <= static_cast<int>(steps); ++k) {
      const Vec3 p = steps > 0 ? Vec3(a + (b - a) * (k / steps)) : a;
      if (!(p.x() >= 0 && p.x() < width_ && p.y() >= 0 && p.y() < height_)) continue;
      const std::size_t i = index(static_cast<int>(p.x()), static_cast<int>(p.y()));
      if (p.z() + kInFront < depths_[i] || wired_[i]) continue;
      colors_[i] *= kWireShade;
      wired_[i] = true;
    }
  }

  Image image() const {
    Image image{width_ / kPixelSideSamples, height_ / kPixelSideSamples, {}};
    image.pixels.reserve(4 * depths_.size() / (kPixelSideSamples * kPixelSideSamples));
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        Vec3 sum = Vec3::Zero();
        int covered = 0;
        for (int k = 0; k < kPixelSideSamples * kPixelSideSamples; ++k) {
          const std::size_t i =
              index(kPixelSideSamples * x + k % kPixelSideSamples, kPixelSideSamples * y + k / kPixelSideSamples);
          if (!(depths_[i] > -std::numeric_limits<double>::infinity())) continue;
          sum += colors_[i];
          ++covered;
        }
        for (int channel = 0; channel < 3; ++channel)
          image.pixels.push_back(covered ? static_cast<std::uint8_t>(std::lround(255 * srgb(sum[channel] / covered)))
                                         : 0);
        image.pixels.push_back(static_cast<std::uint8_t>(255 * covered / (kPixelSideSamples * kPixelSideSamples)));
      }
    return image;
  }

 private:
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * width_ + x; }
  void put(int x, int y, double depth, const Vec3& color) {
    const std::size_t i = index(x, y);
    if (!(depth > depths_[i])) return;
    depths_[i] = depth;
    colors_[i] = color;
  }

  int width_, height_;
  double scale_;  // samples per unit of length
  Vec3 center_;
  Mat3 axes_;  // rows: right, up, toward the viewer
  std::vector<double> depths_;
  std::vector<Vec3> colors_;  // linear
  std::vector<bool> wired_;   // true if a line has darkened the sample: a second one leaves it
};

}  // namespace

RasterView view_of(std::span<const Vec3> positions) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : positions)
    if (p.allFinite()) box.extend(p);
  RasterView view;
  if (box.isEmpty() || !(box.diagonal().norm() > 0)) return view;
  const Vec3 sizes = box.sizes();
  int across = 0, along = 0;
  sizes.minCoeff(&across);
  sizes.maxCoeff(&along);
  if (along == across) along = (across + 1) % 3;
  const int beside = 3 - across - along;
  view.towards_viewer = Vec3::Zero();
  view.towards_viewer[across] = 1;
  view.towards_viewer[along] = 0.25;
  view.towards_viewer[beside] = 0.45;
  view.up = Vec3::Unit(beside);
  view.center = box.center();
  view.radius = 0.5 * box.diagonal().norm();
  return view;
}

Image rasterize(const RasterSurface& surface, const RasterView& view, int width, int height) {
  constexpr int kMostPixels = 8192;
  if (width < 1 || height < 1 || width > kMostPixels || height > kMostPixels)
    throw InputError("rasterize: expected 1 to " + std::to_string(kMostPixels) + " pixels a side");
  const std::vector<Vec3>& x = surface.mesh.positions;
  if (!surface.colors.empty() && surface.colors.size() != x.size())
    throw InputError("rasterize: expected one color per vertex");
  Canvas canvas(view, width, height);
  std::vector<Vec3> projected;
  for (const Vec3& p : x) projected.push_back(canvas.project(p));
  for (const auto& triangle : surface.mesh.triangles) {
    const auto& [a, b, c] = triangle;
    const Vec3 normal = (x[b] - x[a]).cross(x[c] - x[a]);
    if (!(normal.norm() > 0)) continue;
    const double shade = canvas.shade(normal.normalized());
    std::array<Vec3, 3> corners, colors;
    for (int k = 0; k < 3; ++k) {
      const LinearColor& color = surface.colors.empty() ? kGray : surface.colors[triangle[k]];
      corners[k] = projected[triangle[k]];
      colors[k] = shade * Vec3(color[0], color[1], color[2]);
    }
    canvas.draw_triangle(corners, colors);
  }
  for (const auto& [a, b] : surface.wires) canvas.draw_line(projected[a], projected[b]);
  return canvas.image();
}

}  // namespace subvol

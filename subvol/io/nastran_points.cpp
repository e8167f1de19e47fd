// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/nastran_points.h"

#include "subvol/base/text_scanner.h"

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>

namespace subvol::internal {

namespace {

/// Cartesian coordinates from those of a system of the kind 'r', 'c' (radius, angle, height) or 's' (radius, angle from
/// the z axis, angle around it). Angles are in degrees.
Vec3 cartesian(const Vec3& p, char kind) {
  constexpr double kRadiansPerDegree = std::numbers::pi / 180;
  const double a = p[1] * kRadiansPerDegree, b = p[2] * kRadiansPerDegree;
  if (kind == 'c') return {p[0] * std::cos(a), p[0] * std::sin(a), p[2]};
  if (kind == 's') return p[0] * Vec3(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
  return p;
}

}  // namespace

double NastranPoints::coordinate(const NastranCard& card, std::size_t field) {
  if (card.field(field).empty()) return 0;
  const auto value = nastran_number(card.field(field));
  if (!value) card.fail("expected a coordinate (a finite number), found " + in_quotes(card.field(field)));
  return *value;
}

std::int64_t NastranPoints::system_number(const NastranCard& card, std::size_t field) {
  const auto number = parse_integer(card.field(field));
  if (!number || *number < 0)
    card.fail("expected the number of a coordinate system, found " + in_quotes(card.field(field)));
  return *number;
}

void NastranPoints::add_point(const NastranCard& card) {
  const std::int64_t number = card.positive(1, "the number of a point");
  const Point point{{coordinate(card, 3), coordinate(card, 4), coordinate(card, 5)},
                    card.field(2).empty() ? kByDefault : system_number(card, 2),
                    card.place};
  const auto [known, is_new] = numbers_.try_emplace(number, static_cast<Index>(points_.size()));
  if (is_new)
    points_.push_back(point);
  else if (!(points_[static_cast<std::size_t>(known->second)] == point))
    card.fail("a second GRID " + std::to_string(number) + " in another place");
}

void NastranPoints::set_defaults(const NastranCard& card) {
  if (!card.field(2).empty()) default_system_ = system_number(card, 2);
}

void NastranPoints::add_system(const NastranCard& card) {
  const bool has_two = card.name()[4] == '1' && !card.field(5).empty();
  for (const std::size_t field : {std::size_t{1}, std::size_t{5}})
    if (const auto number = parse_integer(card.field(field)); number && (field == 1 || has_two))
      systems_.try_emplace(*number, System{card, field + 1});
}

std::optional<Index> NastranPoints::find(std::int64_t number) const {
  const auto found = numbers_.find(number);
  if (found == numbers_.end()) return std::nullopt;
  return found->second;
}

std::vector<Vec3> NastranPoints::positions() {
  std::vector<Vec3> positions;
  positions.reserve(points_.size());
  for (const Point& point : points_) {
    positions.push_back(in_basic(point.coordinates, point.system, point.place, 0));
    if (!positions.back().allFinite()) fail_at(point.place, "expected finite coordinates");
  }
  return positions;
}

Vec3 NastranPoints::in_basic(const Vec3& coordinates, std::int64_t system, const FilePlace& place, int depth) {
  constexpr int kMostCoordinateSystemDepth = 1000;  // of systems in one another, for the stack
  if (system == kByDefault) system = default_system_;
  if (system == 0) return coordinates;
  const auto found = systems_.find(system);
  const std::string name = "coordinate system " + std::to_string(system);
  if (found == systems_.end()) fail_at(place, "a point is in " + name + ", which the file does not have");
  System& used = found->second;
  if (used.state == State::open || depth > kMostCoordinateSystemDepth) used.card.fail(name + " refers to itself");
  if (used.state == State::unread) read_system(used, depth);
  return used.axes * cartesian(coordinates, used.card.name()[5]) + used.origin;
}

/// The second point is on the z axis, and the third on the half of the x-z plane where x is positive.
void NastranPoints::read_system(System& system, int depth) {
  system.state = State::open;
  const auto [origin, on_z, on_xz] = points_of(system, depth);
  const Vec3 z = (on_z - origin).normalized(), y = z.cross(on_xz - origin).normalized();
  if (!y.allFinite() || !(y.norm() > 0.5)) system.card.fail("the three points of a coordinate system are on a line");
  system.origin = origin;
  system.axes << y.cross(z), y, z;
  system.state = State::ready;
}

std::array<Vec3, 3> NastranPoints::points_of(const System& system, int depth) {
  const NastranCard& card = system.card;
  std::array<Vec3, 3> points;
  if (card.name()[4] == '1') {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto point = find(card.positive(system.first_field + i, "the number of a point"));
      if (!point)
        card.fail("a coordinate system names GRID " + card.field(system.first_field + i) +
                  ", which the file does not have");
      const Point& at = points_[static_cast<std::size_t>(*point)];
      points[i] = in_basic(at.coordinates, at.system, at.place, depth + 1);
    }
    return points;
  }
  const std::int64_t reference = card.field(2).empty() ? 0 : system_number(card, 2);
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 p(coordinate(card, 3 + 3 * i), coordinate(card, 4 + 3 * i), coordinate(card, 5 + 3 * i));
    points[i] = in_basic(p, reference, card.place, depth + 1);
  }
  return points;
}

}  // namespace subvol::internal

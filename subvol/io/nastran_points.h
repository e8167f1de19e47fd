// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/io/nastran_cards.h"

#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

namespace subvol::internal {

/// The points of a Nastran file, and the coordinate systems that they are given in.
class NastranPoints {
 public:
  /// Takes a card GRID. InputError, with the place: a second point of this number elsewhere, a coordinate that is no
  /// number.
  void add_point(const NastranCard& card);
  /// Takes a card GRDSET, which may name the system of the points that name none.
  void set_defaults(const NastranCard& card);
  /// Takes a card CORD1R, CORD1C, CORD1S, CORD2R, CORD2C or CORD2S.
  void add_system(const NastranCard& card);

  bool empty() const { return points_.empty(); }
  /// Returns the place of a point in `positions`; nothing if there is no point of this number.
  std::optional<Index> find(std::int64_t number) const;
  /// Returns the positions of all points in the basic system, in the order of the file. InputError, with the place: a
  /// system that does not exist, refers to itself, or whose three points are on a line.
  std::vector<Vec3> positions();

 private:
  struct Point {
    Vec3 coordinates;
    std::int64_t system;  ///< kByDefault: that of GRDSET
    FilePlace place;
    bool operator==(const Point& other) const { return coordinates == other.coordinates && system == other.system; }
  };
  enum class State { unread, open, ready };
  /// x -> axes x + origin takes its Cartesian coordinates into the basic system.
  struct System {
    NastranCard card;
    std::size_t first_field;  ///< of its points on the card
    State state = State::unread;
    Mat3 axes = Mat3::Identity();
    Vec3 origin = Vec3::Zero();
  };
  static constexpr std::int64_t kByDefault = -1;

  static double coordinate(const NastranCard& card, std::size_t field);
  static std::int64_t system_number(const NastranCard& card, std::size_t field);
  Vec3 in_basic(const Vec3& coordinates, std::int64_t system, const FilePlace& place, int depth);
  void read_system(System& system, int depth);
  std::array<Vec3, 3> points_of(const System& system, int depth);

  std::vector<Point> points_;
  std::unordered_map<std::int64_t, Index> numbers_;
  std::unordered_map<std::int64_t, System> systems_;
  std::int64_t default_system_ = 0;
};

}  // namespace subvol::internal

// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/crowded_edges.h"

#include "subvol/base/text_scanner.h"

namespace subvol::internal {

namespace {

constexpr std::size_t kMostListedPlaces = 10;  // in a message

}  // namespace

void PlaceList::add(const std::string& place) {
  if (++count_ > kMostListedPlaces) return;
  list_ += (list_.empty() ? "" : "; ") + place;
}

std::string PlaceList::text(const std::string& one, const std::string& many) const {
  return std::to_string(count_) + " " + (count_ == 1 ? one : many) +
         (count_ > kMostListedPlaces ? ", the first " + std::to_string(kMostListedPlaces) : "") + ": " + list_ +
         " (vertices are numbered from 0, those of no face left out)";
}

void CrowdedEdges::add(const std::string& from, const std::string& to, std::size_t num_faces) {
  places_.add("from vertex " + from + " to " + to + " has " + std::to_string(num_faces));
}

std::string CrowdedEdges::text() const {
  return places_.text("edge has more than two faces", "edges have more than two faces");
}

std::string vertex_text(Index number, const Vec3* position) {
  std::string text = std::to_string(number);
  if (!position) return text;
  const char* separator = " (";
  for (int i = 0; i < 3; ++i, separator = " ") {
    text += separator;
    append_number(text, (*position)[i]);
  }
  return text + ")";
}

}  // namespace subvol::internal

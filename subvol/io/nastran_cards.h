// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/io/file_place.h"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace subvol::internal {

/// A number of Nastran: "1.5", "1.5E+3", "1.5D3", and "1.5+3" without a letter.
std::optional<double> nastran_number(std::string_view field);

/// An entry of a Nastran file, with its continuations.
struct NastranCard {
  std::vector<std::string> fields;  ///< first its name in lower case without '*', then eight for each line
  FilePlace place;                  ///< of the first line
  std::string broken;               ///< tells which continuation belongs to another card; empty: none

  const std::string& name() const { return fields[0]; }
  /// Returns a field without blanks around it; empty if the card ends before.
  const std::string& field(std::size_t i) const;
  /// Returns a field as a positive whole number. InputError, with the place, if it is none.
  std::int64_t positive(std::size_t i, const char* what) const;
  [[noreturn]] void fail(const std::string& what) const { fail_at(place, what); }
};

/// The cards of a Nastran file and of those that it includes, in small, large and free fields, up to ENDDATA. Cards
/// that repeat the one before them ('=' in the first field) come with all their fields. Lines of the executive and case
/// control sections come as cards, too.
class NastranCards {
 public:
  /// name  path of the file: included ones are found beside it.
  NastranCards(const std::string& name, std::string_view bytes) : name_(name), bytes_(bytes), included_(name) {}

  /// Calls visit(card) for each card. InputError, with file and line: an included file that cannot be read or too many
  /// of them, too many repeated cards.
  void visit(const std::function<void(const NastranCard&)>& visit);

 private:
  void read_file_of(const std::string& file, std::string_view bytes, int depth);
  void read_line(std::string_view whole, const FilePlace& place);
  void continue_card(const std::string& line, const std::vector<std::string>& fields);
  void end_card();
  void repeat_with_changes();
  void repeat(std::int64_t times);

  std::string name_;
  std::string_view bytes_;
  IncludedFiles included_;
  std::function<void(const NastranCard&)> visit_;
  std::deque<std::string> files_;  ///< names, for the places of cards
  NastranCard card_;
  std::string mark_;                ///< what the next continuation of the card begins with
  NastranCard last_;                ///< the card before
  std::vector<std::string> steps_;  ///< what repeating adds to the fields of the card before; empty: nothing
  std::int64_t num_repeated_ = 0;
  bool in_card_ = false, is_over_ = false;
};

}  // namespace subvol::internal

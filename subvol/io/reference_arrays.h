// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace subvol::internal {

/// A one-component array of cell data whose values are all whole numbers.
struct CellNumbers {
  std::string name;
  bool is_real = false;  ///< true if the file stores floating-point numbers
  std::vector<std::int64_t> values;
};

/// Returns the place of the array that holds the cells' references, or nothing if there is none.
///
/// name    the array that is asked for; upper and lower case are the same unless a name matches exactly. If empty, the
///         array is chosen whose name comes first in a list of names that programs give to materials and regions;
///         without such a name, the first array of an integer type. Ghost arrays and arrays of cell or process numbers
///         are taken only if they are asked for.
/// others  names of the cell data that are unfit, for messages.
/// InputError (without the file's name): there is no array of that name; the message lists `arrays` and `others`.
std::optional<std::size_t> choose_references(const std::vector<CellNumbers>& arrays, const std::string& name,
                                             const std::vector<std::string>& others = {});

/// Appends warnings about the arrays of cell data that did not become references: their number, and that others might
/// be meant if none was asked for.
///
/// chosen      from `choose_references`.  was_asked  true if an array was asked for by name.
/// num_arrays  number of all arrays of cell data in the file.
void tell_of_references(const std::vector<CellNumbers>& arrays, std::optional<std::size_t> chosen, bool was_asked,
                        std::size_t num_arrays, std::vector<std::string>& warnings);

/// Returns the place of a name in the list of names that programs give to materials and regions, the most telling name
/// first; nothing if it is not in the list. Case, separators and a plural's s do not count.
std::optional<std::size_t> reference_name_rank(std::string_view name);

/// Returns true if the array may be chosen as references without being asked for.
bool may_be_references(const CellNumbers& array);

}  // namespace subvol::internal

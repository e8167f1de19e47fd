// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace subvol {

/// A one-component array of cell data whose values are all whole numbers.
struct CellNumbers {
  std::string name;
  bool is_real = false;  ///< the file's type is one of fractions
  std::vector<std::int64_t> values;
};

/// Which of the arrays are the cells' references: nothing where none is meant.
///
/// name  the array that is asked for, in any case of letters. Empty: the name that comes first in a list of names that
///       programs give to materials and regions; without one, the first array of a type of whole numbers. Arrays of
///       ghosts, of numbers of cells and of processes are never taken unless they are asked for.
/// InputError (without the file's name): there is none of that name; it lists those there are, `others` among them as
/// unfit.
std::optional<std::size_t> choose_references(const std::vector<CellNumbers>& arrays, const std::string& name,
                                             const std::vector<std::string>& others = {});

/// Whether an array of this name may be the references though nobody asks for it.
bool may_be_references(const CellNumbers& array);

}  // namespace subvol

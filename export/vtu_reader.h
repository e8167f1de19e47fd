// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/export/vtu_arrays.h"

#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace subvol::internal {

/// The data arrays of a .vtu in the form that subvol writes, by name; each is decoded on request. InputError, naming
/// the file: it is not such a file, or an array is missing, of another type or malformed. Cost: linear in the size of
/// the file.
class VtuArrays {
 public:
  /// name: of the file, for messages; `bytes` must outlive this object. version: of the file, "2.2" or, for linear
  /// cells, "1.0".
  VtuArrays(std::string name, std::string_view bytes, const std::string& version = "2.2");

  bool has(const std::string& array) const { return arrays_.contains(array); }

  template <class T>
  std::vector<T> get(const std::string& array) const {
    const auto found = arrays_.find(array);
    if (found == arrays_.end()) fail("expected a data array " + array);
    if (found->second.type != vtu_type<T>())
      fail(array + ": expected type " + vtu_type<T>() + ", found " + in_quotes(found->second.type));
    if (found->second.format != "binary") fail(array + ": expected format=\"binary\", as subvol writes it");
    const std::optional<std::string> bytes = decode_base64(found->second.digits);
    std::uint64_t size = 0;
    if (bytes && bytes->size() >= sizeof size) std::memcpy(&size, bytes->data(), sizeof size);
    if (!bytes || bytes->size() < sizeof size || bytes->size() - sizeof size != size || size % sizeof(T) != 0)
      fail(array + ": expected base64 of a length and as many bytes");
    std::vector<T> values(size / sizeof(T));
    if (size > 0) std::memcpy(values.data(), bytes->data() + sizeof size, size);
    return values;
  }

  [[noreturn]] void fail(const std::string& message) const { throw InputError(name_ + ": " + message); }

 private:
  struct Array {
    std::string_view type, format, digits;
  };
  std::string_view tag(std::string_view bytes, std::size_t begin) const;
  void add(std::string_view bytes, std::size_t begin);

  std::string name_;
  std::map<std::string, Array> arrays_;
};

}  // namespace subvol::internal

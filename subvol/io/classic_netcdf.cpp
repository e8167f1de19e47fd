// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/classic_netcdf.h"

#include "subvol/base/error.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace subvol::internal {

namespace {

/// Walks through a header. All numbers are big-endian; counts have 4 bytes, in CDF-5 8.
class ClassicHeader {
 public:
  ClassicHeader(const std::string& name, std::string_view bytes)
      : name_(name),
        rest_(bytes.substr(kNetcdfMagicBytes)),
        version_(bytes[kNetcdfMagicBytes - 1]),
        count_size_(version_ == 5 ? 8 : 4) {}

  void walk() {
    skip(count_size_);  // records
    for (std::uint64_t left = list(kDimension); left > 0; --left) {
      skip_name();
      lengths_.push_back(number(count_size_));
    }
    skip_attributes();
    for (std::uint64_t left = list(kVariable); left > 0; --left) skip_variable();
  }

  static constexpr std::size_t kNetcdfMagicBytes = 4;

 private:
  static constexpr std::uint64_t kDimension = 10, kVariable = 11, kAttribute = 12;

  [[noreturn]] void fail(const std::string& what) const { throw InputError(name_ + ": netCDF header: " + what); }

  void skip(std::uint64_t size) {
    if (size > rest_.size()) fail("is cut short");
    rest_.remove_prefix(size);
  }
  std::uint64_t number(std::size_t size) {
    if (size > rest_.size()) fail("is cut short");
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i) value = value << 8 | static_cast<unsigned char>(rest_[i]);
    rest_.remove_prefix(size);
    return value;
  }
  /// A number of things that have at least so many bytes each.
  std::uint64_t count(std::size_t least_size) {
    const std::uint64_t value = number(count_size_);
    if (value > rest_.size() / least_size) fail("claims more than the file holds");
    return value;
  }
  /// The length of a list that begins with its tag; 0 and no tag if it is empty.
  std::uint64_t list(std::uint64_t tag) {
    const std::uint64_t found = number(4), length = count(count_size_);
    if (found != tag && (found != 0 || length != 0)) fail("has an unknown tag");
    return length;
  }
  /// Names and values are padded to a multiple of 4 bytes.
  void skip_padded(std::uint64_t size) { skip((size + 3) / 4 * 4); }
  void skip_name() { skip_padded(count(1)); }
  void skip_attributes() {
    for (std::uint64_t left = list(kAttribute); left > 0; --left) {
      skip_name();
      const std::size_t size = size_of_type();
      skip_padded(size * count(size));
    }
  }
  /// Reads a type, and returns the size of its values.
  std::size_t size_of_type() {
    constexpr std::array<std::size_t, 12> kNetcdfValueSizes{0, 1, 1, 2, 4, 4, 8, 1, 2, 4, 8, 8};  // by type
    const std::uint64_t type = number(4);
    if (type == 0 || type >= kNetcdfValueSizes.size()) fail("has an unknown type");
    return kNetcdfValueSizes[type];
  }

  /// The dimension of length 0, which is that of the records, may only be a variable's first one.
  void skip_variable() {
    constexpr std::uint64_t kMostDimensions = 1024;  // NC_MAX_VAR_DIMS
    skip_name();
    const std::uint64_t dimensions = count(count_size_);
    if (dimensions > kMostDimensions) fail("a variable has more than 1024 dimensions");
    for (std::uint64_t k = 0; k < dimensions; ++k) {
      const std::uint64_t dimension = number(count_size_);
      if (dimension >= lengths_.size()) fail("a variable names a dimension that is not there");
      if (k > 0 && lengths_[dimension] == 0) fail("a variable has a later dimension of length 0");
    }
    skip_attributes();
    size_of_type();
    skip(count_size_ + (version_ == 1 ? 4 : 8));  // size, place
  }

  std::string name_;
  std::string_view rest_;
  int version_;
  std::size_t count_size_;
  std::vector<std::uint64_t> lengths_;  ///< of the dimensions
};

}  // namespace

void require_sound_netcdf_header(const std::string& name, std::string_view bytes) {
  if (bytes.size() < ClassicHeader::kNetcdfMagicBytes || !bytes.starts_with("CDF")) return;
  const char version = bytes[ClassicHeader::kNetcdfMagicBytes - 1];
  if (version == 1 || version == 2 || version == 5) ClassicHeader(name, bytes).walk();
}

}  // namespace subvol::internal

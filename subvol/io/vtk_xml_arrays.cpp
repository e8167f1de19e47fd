// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/vtk_xml_arrays.h"

#include "subvol/base/base64.h"
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"

#include <zlib.h>
#ifdef SUBVOL_LZ4
#include <lz4.h>
#endif

#include <algorithm>
#include <limits>
#include <optional>

namespace subvol::internal {

namespace {

struct XmlType {
  const char* name;
  ValueType type;
};
constexpr XmlType kXmlTypes[] = {
    {"Int8", kInt8},     {"UInt8", kUInt8}, {"Int16", kInt16},   {"UInt16", kUInt16},   {"Int32", kInt32},
    {"UInt32", kUInt32}, {"Int64", kInt64}, {"UInt64", kUInt64}, {"Float32", kFloat32}, {"Float64", kFloat64},
};

/// Largest ratios of decompression: each compressed byte holds at most so many.
constexpr std::uint64_t kZlibRatio = 1032, kLz4Ratio = 256;

[[noreturn]] void fail(const VtkXmlArray& array, const std::string& what) {
  throw InputError("array " + in_quotes(array.name) + ": " + what);
}

/// Takes bytes from raw data or from base64, where every run of bytes is encoded on its own.
class ByteSource {
 public:
  ByteSource(const VtkXmlArray& array, std::string_view data, bool is_base64)
      : array_(array), data_(data), is_base64_(is_base64) {}

  /// Returns the first n bytes of the run that begins here, without taking it.
  std::string peek(std::uint64_t n) const {
    if (n > data_.size()) cut_short();
    if (!is_base64_) return std::string(data_.substr(at_).substr(0, n));
    const std::uint64_t digits = (n + 2) / 3 * 4;
    if (at_ > data_.size() || digits > data_.size() - at_) cut_short();
    std::optional<std::string> bytes = decode_base64(data_.substr(at_, digits));
    if (!bytes || bytes->size() < n) fail(array_, "expected base64");
    bytes->resize(n);
    return *bytes;
  }
  std::string take(std::uint64_t n) {
    std::string bytes = peek(n);
    if (bytes.size() < n) cut_short();
    at_ += is_base64_ ? (n + 2) / 3 * 4 : n;
    return bytes;
  }

 private:
  [[noreturn]] void cut_short() const { fail(array_, "the data end before the array does"); }

  const VtkXmlArray& array_;
  std::string_view data_;
  bool is_base64_;
  std::size_t at_ = 0;
};

std::uint64_t length_at(const std::string& bytes, std::size_t i, const VtkXmlStorage& storage) {
  const double value = decode(bytes.data() + i * storage.header.size, storage.header, storage.endian);
  return static_cast<std::uint64_t>(std::clamp(value, 0.0, 9e15));
}

std::string decompressed(const VtkXmlArray& array, const std::string& compressor, const std::string& block,
                         std::uint64_t size) {
  const bool is_zlib = compressor == "vtkZLibDataCompressor";
  if (size / (is_zlib ? kZlibRatio : kLz4Ratio) > block.size())
    fail(array, "a block claims to be larger than its data can be");
  std::string bytes(size, '\0');
  if (is_zlib) {
    uLongf length = static_cast<uLongf>(size);
    const int status = uncompress(reinterpret_cast<Bytef*>(bytes.data()), &length,
                                  reinterpret_cast<const Bytef*>(block.data()), static_cast<uLong>(block.size()));
    if (status != Z_OK || length != size) fail(array, "the data are not zlib's, or damaged");
    return bytes;
  }
#ifdef SUBVOL_LZ4
  constexpr std::uint64_t kMostLz4 = std::numeric_limits<int>::max();
  if (size > kMostLz4 || block.size() > kMostLz4) fail(array, "a block is too large for LZ4");
  const int length =
      LZ4_decompress_safe(block.data(), bytes.data(), static_cast<int>(block.size()), static_cast<int>(size));
  if (length < 0 || static_cast<std::uint64_t>(length) != size) fail(array, "the data are not LZ4's, or damaged");
#endif
  return bytes;
}

void require_compressor(const VtkXmlArray& array, const std::string& compressor) {
  if (compressor == "vtkZLibDataCompressor") return;
  if (compressor == "vtkLZ4DataCompressor") {
#ifndef SUBVOL_LZ4
    fail(array, "compressed with LZ4, which this program was built without; save it with zlib or uncompressed");
#else
    return;
#endif
  }
  fail(array, "compressed by " + in_quotes(compressor) + ", expected vtkZLibDataCompressor or vtkLZ4DataCompressor");
}

/// Blocks: their number, the size of each, that of the last if it is smaller, and their compressed sizes; then the
/// data.
std::string compressed_bytes(const VtkXmlArray& array, ByteSource source, const VtkXmlStorage& storage) {
  require_compressor(array, storage.compressor);
  const std::size_t size = storage.header.size;
  const std::uint64_t num_blocks = length_at(source.peek(size), 0, storage);
  constexpr std::uint64_t kMostBlocks = 1u << 30;
  if (num_blocks > kMostBlocks) fail(array, "expected a smaller number of blocks");
  const std::string lengths = source.take((3 + num_blocks) * size);
  std::uint64_t total = 0;
  for (std::uint64_t b = 0; b < num_blocks; ++b) {
    total += length_at(lengths, 3 + b, storage);
    if (total > (1ull << 52)) fail(array, "the data end before the array does");
  }
  const std::string data = source.take(total);
  const std::uint64_t whole = length_at(lengths, 1, storage), rest = length_at(lengths, 2, storage);
  std::string bytes;
  std::size_t at = 0;
  for (std::uint64_t b = 0; b < num_blocks; ++b) {
    const std::uint64_t length = length_at(lengths, 3 + b, storage);
    const bool is_last = b + 1 == num_blocks;
    bytes += decompressed(array, storage.compressor, data.substr(at, length), is_last && rest > 0 ? rest : whole);
    at += length;
  }
  return bytes;
}

std::string plain_bytes(ByteSource source, const VtkXmlStorage& storage) {
  const std::size_t size = storage.header.size;
  const std::uint64_t length = length_at(source.peek(size), 0, storage);
  return source.take(size + length).substr(size);
}

std::string without_blanks(std::string_view text) {
  std::string result;
  for (const char c : text)
    if (c != ' ' && c != '\n' && c != '\r' && c != '\t') result += c;
  return result;
}

std::vector<double> numbers_of_text(const VtkXmlArray& array) {
  std::vector<double> values;
  try {
    TextScanner scan("", array.text, TextScanner::Comments::none);
    while (const auto word = scan.next()) {
      const auto value = parse_number(*word);
      if (!value) fail(array, "expected a number, found " + in_quotes(*word));
      values.push_back(*value);
    }
  } catch (const InputError& error) {
    fail(array, error.what());
  }
  return values;
}

}  // namespace

std::vector<double> decode_vtk_xml_array(const VtkXmlArray& array, const VtkXmlStorage& storage) {
  const auto type =
      std::find_if(std::begin(kXmlTypes), std::end(kXmlTypes), [&](const XmlType& t) { return array.type == t.name; });
  if (type == std::end(kXmlTypes)) fail(array, "unknown type " + in_quotes(array.type));
  if (array.format == "ascii" || array.format.empty()) return numbers_of_text(array);
  std::string digits, bytes;
  std::string_view data;
  bool is_base64 = true;
  if (array.format == "binary") {
    digits = without_blanks(array.text);
    data = digits;
  } else if (array.format == "appended") {
    const auto offset = parse_integer(array.offset);
    if (!offset || *offset < 0 || static_cast<std::uint64_t>(*offset) > storage.appended.size())
      fail(array, "expected an offset within the appended data");
    data = storage.appended.substr(static_cast<std::size_t>(*offset));
    is_base64 = storage.appended_base64;
  } else {
    fail(array, "unknown format " + in_quotes(array.format));
  }
  const ByteSource source(array, data, is_base64);
  bytes = storage.compressor.empty() ? plain_bytes(source, storage) : compressed_bytes(array, source, storage);
  const std::size_t size = type->type.size;
  if (bytes.size() % size != 0) fail(array, "its length is no multiple of the size of a number");
  std::vector<double> values;
  values.reserve(bytes.size() / size);
  for (std::size_t i = 0; i < bytes.size(); i += size) values.push_back(decode(&bytes[i], type->type, storage.endian));
  return values;
}

}  // namespace subvol::internal
